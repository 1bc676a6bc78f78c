"""Robot descriptions in XML: one file, of which no part comes from elsewhere."""

import xml.etree.ElementTree as ElementTree
from os import PathLike
from pathlib import Path

import numpy as np

from clie_blocks.errors import ClieError

LARGEST_FILE = 20_000_000  # bytes


def read_root(path: str | PathLike[str], what: str) -> ElementTree.Element:
    """Read the root element of a file.

    Parameters
    ----------
    path : path-like
        The file.
    what : str
        Its kind, for messages.

    Raises
    ------
    ClieError
        If there is no file, it is too large, defines entities, is no XML, or must be expanded
        first (xacro).

    """
    place = Path(path)
    if not place.is_file():
        raise ClieError(f"{place} is no file; name the {what} of the robot")
    if place.stat().st_size > LARGEST_FILE:
        raise ClieError(f"{place} has {place.stat().st_size / 1e6:.0f} MB; a robot description "
                        f"has less than {LARGEST_FILE / 1e6:.0f} MB, without its meshes")
    text = place.read_text(encoding="utf-8", errors="replace")
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ClieError(f"{place} defines entities, which are not expanded here; remove the "
                        "<!DOCTYPE ...> from it")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        if "<xacro:" in text:
            raise _not_expanded(place) from None
        raise ClieError(f"{place} is no XML: {error}") from None
    if any("xacro}" in element.tag for element in root.iter()):
        raise _not_expanded(place)
    return root


def _not_expanded(place: Path) -> ClieError:
    return ClieError(f"{place} is not expanded; run: xacro {place} > robot.urdf")


def attribute_numbers(element: ElementTree.Element | None, key: str, counts: tuple[int, ...],
                      default: str, what: str, source: str) -> np.ndarray:
    """Numbers of an attribute, as many as one of some counts.

    Raises
    ------
    ClieError
        If there are others, or one is not finite.

    """
    text = default if element is None else element.get(key, default)
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        values = np.full(0, np.nan)
    if values.size not in counts or not np.isfinite(values).all():
        many = " or ".join(map(str, counts))
        raise ClieError(f"{source}: {key}={text!r} of {what} must be {many} finite number"
                        f"{'s' if counts[-1] > 1 else ''}")
    return values
