"""Elements of an MJCF: where they are in a text, and how new ones are written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from xml.sax.saxutils import quoteattr

from clie_blocks.analysis.export.xml_text import Element, XmlText

TINY = 1e-9  # kg, kg m^2: the engine refuses bodies without mass


def joints_of(document: XmlText) -> dict[str, Element]:
    """Return the joints of the bodies by name."""
    return {one.attributes["name"]: one for section in document.root.children
            if section.name == "worldbody" for one in section.every("joint")
            if "name" in one.attributes}


def tendons_of(document: XmlText) -> dict[str, Element]:
    """Return the fixed tendons by name."""
    return {one.attributes["name"]: one for section in document.root.children
            if section.name == "tendon" for one in section.every("fixed")
            if "name" in one.attributes}


def in_words(document: XmlText, source: str) -> str:
    """Return the file in words, with what it includes, which is not searched."""
    included = [one.attributes.get("file", "") for one in document.root.every("include")]
    return source if not included else (
        f"{source} (without {', '.join(included)}, which it includes: give that file as the "
        "model, or write all into one with mujoco.MjSpec.from_file(...).to_xml())")


def is_radian(document: XmlText) -> bool:
    """Whether the angles of a model are in radians; they are in degrees by default."""
    compiler = next((one for one in document.root.children if one.name == "compiler"), None)
    return compiler is not None and compiler.attributes.get("angle") == "radian"


def pose_of(body: Element) -> dict[str, str]:
    """Return the attributes that say where a body is."""
    return {key: body.attributes[key] for key in ("pos", "quat", "euler", "axisangle", "xyaxes",
                                                  "zaxis") if key in body.attributes}


def actuators_of(document: XmlText) -> list[Element]:
    """Return the actuators in the order of the file, which is that of their numbers."""
    return [one for section in document.root.children if section.name == "actuator"
            for one in section.children]


def point_mass(mass: float) -> str:
    """Return the inertial element of a point of a mass [kg]."""
    return tag("inertial", {"pos": "0 0 0", "mass": mass,
                             "diaginertia": f"{TINY} {TINY} {TINY}"})


def tag(name: str, attributes: Mapping[str, Any], inside: Sequence[str] = ()) -> str:
    """Return an element with its content indented."""
    shown = "".join(f" {key}={quoteattr(value if isinstance(value, str) else f'{value:.9g}')}"
                    for key, value in attributes.items())
    if not inside:
        return f"<{name}{shown}/>"
    lines = "\n".join(f"  {line}" for part in inside for line in part.splitlines())
    return f"<{name}{shown}>\n{lines}\n</{name}>"
