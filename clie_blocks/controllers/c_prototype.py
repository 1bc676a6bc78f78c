"""The arguments of a control law in C: their names say what they are."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Sequence
from pathlib import Path

from clie_blocks.errors import nearest
from clie_blocks.labels import DiagramError
from clie_blocks.robot_loop.sampled_law import (
    COMMAND,
    EXCITATION,
    OF_DRIVE,
    POSITION,
    REFERENCE,
)

INPUTS = (REFERENCE, POSITION, EXCITATION, *OF_DRIVE)
INPUT, STATE, PARAMETER, OUTPUT = "input", "state", "parameter", "output"
_KEYWORDS = {"if", "for", "while", "switch", "return", "sizeof"}
_INSIDE = r"\(((?:[^()]|\([^()]*\))*)\)\s*\{"  # the brackets of a definition
_FUNCTION = r"([\w\s*]*?)\b%s\s*" + _INSIDE
_ARGUMENT = re.compile(r"([\w\s]+?)\s*(\*?)\s*(?:const\s+|restrict\s+|__restrict\s+)?(\w+)\s*"
                       r"(?:\[([^\]]*)\])?")


@dataclasses.dataclass(frozen=True)
class Argument:
    """One argument of a law.

    Parameters
    ----------
    name : str
        Its name.
    kind : str
        `INPUT`, `STATE`, `PARAMETER` or `OUTPUT`.
    size : int or None
        How many numbers it holds; None where the file does not say.
    by_value : bool
        It is a number, no array.

    """

    name: str
    kind: str
    size: int | None
    by_value: bool = False


def arguments_of(text: str, name: str, path: Path) -> list[Argument]:
    """Arguments of a function, in their order.

    Parameters
    ----------
    text : str
        The file, preprocessed.
    name : str
        The function.
    path : Path
        The file, for messages.

    Raises
    ------
    DiagramError
        If there is no such function, or an argument is not what a law has.

    """
    found = re.search(_FUNCTION % re.escape(name), text)
    if found is None:
        defined = {one for one, _ in re.findall(r"\b(\w+)\s*" + _INSIDE, text)} - _KEYWORDS
        raise DiagramError(f"{path}: it defines no function {name!r}; {nearest(name, defined)}")
    returned = set(found.group(1).split()) - {"static", "inline", "extern"}
    if returned != {"void"}:
        raise DiagramError(f"{path}: {name} returns {' '.join(returned) or 'nothing'}, and a law "
                           f"writes its command into u: void {name}(..., double u[])")
    arguments = [_argument(one.strip(), f"{path}: {name}") for one in found.group(2).split(",")]
    _check(arguments, f"{path}: {name}")
    return arguments


def _argument(text: str, where: str) -> Argument:
    found = _ARGUMENT.fullmatch(text)
    words = set(found.group(1).split()) if found else set()
    if found is None or "double" not in words or words - {"double", "const"}:
        raise DiagramError(f"{where} takes {text!r}, and a law takes numbers of the type double "
                           "and arrays of them: const double q_d[], const double kp[], double "
                           "integral[], double u[]; put what else it needs into these")
    _, star, name, inside = found.groups()
    by_value = not star and inside is None
    kind = (INPUT if name in INPUTS else OUTPUT if name == COMMAND
            else PARAMETER if by_value or "const" in words else STATE)
    if by_value and kind != PARAMETER:
        raise DiagramError(f"{where} takes {text!r} as a number, and it is an array with one "
                           f"number per joint: {name}[]")
    return Argument(name, kind, 1 if by_value else _size(inside, f"{where}, {text}"), by_value)


def _size(inside: str | None, where: str) -> int | None:
    """Length of an array, a product of whole numbers; None where it is not stated."""
    factors = re.sub(r"[()\s]|static", "", inside or "").split("*")
    if factors == [""]:
        return None
    if not all(factor.isdecimal() for factor in factors):
        raise DiagramError(f"{where}: its length is {inside!r}; write a whole number, a macro "
                           "that is one, or nothing for one number per joint")
    return math.prod(map(int, factors))


def _check(arguments: Sequence[Argument], where: str) -> None:
    names = [one.name for one in arguments]
    for needed in (POSITION, COMMAND):
        if needed not in names:
            raise DiagramError(
                f"{where} has no argument {needed!r}; its names say what they are: const double "
                f"{', '.join(f'{name}[]' for name in INPUTS)} are signals, double u[] is the "
                f"command, other const arrays are parameters, other arrays states; it has "
                f"{', '.join(names)}")
