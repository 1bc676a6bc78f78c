"""The user's SDF with the correction in it: plugins, and what is left to the engine's joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from xml.sax.saxutils import escape

from clie_blocks.analysis.export.core import Core
from clie_blocks.analysis.export.correction import check_joint_names, check_kind
from clie_blocks.analysis.export.xml_text import Element, XmlText
from clie_blocks.errors import ClieError

KINDS = {"hinge": ("revolute", "continuous"), "slide": ("prismatic",)}
_OTHERS = {"mujoco": "it is an MJCF, which --to mujoco patches",
           "robot": "it is a URDF: write an SDF with 'gz sdf -p robot.urdf > robot.sdf'"}


def read_sdf(text: str, source: str) -> XmlText:
    """Return an SDF that can be edited.

    Raises
    ------
    RecordError
        If it is no well-formed XML.
    ClieError
        If it is another kind of model.

    """
    document = XmlText(text, source)
    if (name := document.root.name) != "sdf":
        raise ClieError(f"{source} begins with <{name}>, and an SDF with <sdf>; "
                        + _OTHERS.get(name, "give the SDF of the robot or of its world"))
    return document


def step_of(document: XmlText) -> float | None:
    """Return the step of the engine that a world states [s]; None where none is stated."""
    found = next(document.root.every("max_step_size"), None)
    return None if found is None else float(found.text)


def patch(document: XmlText, source: str, cores: Sequence[Core], friction: Sequence[float],
          renamed: Mapping[str, str]) -> str:
    """Return an SDF with the plugin of every joint, all else as it stands.

    Parameters
    ----------
    document : XmlText
        The SDF.
    source : str
        What to call it in a message.
    cores : sequence of Core
        Blocks of the joints.
    friction : sequence of float
        Dry friction that the engine holds, one per joint [N m or N].
    renamed : dict of str to str
        Name in the model by name in the logs.

    Raises
    ------
    ClieError
        If a joint is missing, is there twice, moves otherwise, or is corrected already.

    """
    known = _joints(document)
    names = [renamed.get(one.block.joint.name, one.block.joint.name) for one in cores]
    included = [one.child("uri") for one in document.root.every("include")]
    uris = ", ".join(one.text.strip() for one in included if one is not None)
    check_joint_names(names, list(known), f"{source} (without {uris}, which it includes: give "
                      "that file as the model)" if uris else source)
    for made, name, level in zip(cores, names, friction, strict=True):
        if len(known[name]) > 1:
            raise ClieError(f"{source} has {len(known[name])} joints {name!r}; say which with "
                            f"--joint {made.block.joint.name}=MODEL::{name}")
        _edit(document, source, known[name][0], made, level)
    return document.text


def plugin(made: Core, name: str) -> str:
    """Return the element that loads the system of a joint."""
    per_force = ("" if abs(made.command_per_force - 1.0) < 1e-9 else
                 f"\n  <command_per_force>{made.command_per_force:.9g}</command_per_force>")
    return (f'<plugin filename="{made.name}_gazebo" name="corrected::{made.class_name}">\n'
            f"  <joint_name>{escape(name)}</joint_name>{per_force}\n</plugin>")


def _joints(document: XmlText) -> dict[str, list[Element]]:
    """Joints by name, and by ``model::name``."""
    found: dict[str, list[Element]] = {}
    for one in document.root.every("joint"):
        name, model = one.attributes.get("name", ""), one.parent
        for key in (name, f"{model.attributes.get('name', '') if model else ''}::{name}"):
            found.setdefault(key, []).append(one)
    return found


def _edit(document: XmlText, source: str, element: Element, made: Core, level: float) -> None:
    name, model = element.attributes["name"], element.parent
    joint = made.block.joint
    check_kind(joint, name, element.attributes.get("type", ""), KINDS[joint.kind], source)
    if model is None or model.name != "model":
        raise ClieError(f"{source}: the joint {name!r} stands in no <model>, which loads the "
                        "plugin; move it into one")
    if any(one.attributes.get("filename") == f"{made.name}_gazebo"
           for one in model.every("plugin")):
        raise ClieError(f"{source} loads {made.name}_gazebo already; give the model as it was "
                        "before the first export, which is kept as NAME.original.sdf")
    axis = element.child("axis")
    if axis is None:
        raise ClieError(f"{source}: the joint {name!r} has no <axis>; state it")
    dynamics = axis.child("dynamics")
    if dynamics is None:
        if level:
            document.append(axis, f"<dynamics>\n  <friction>{level:.9g}</friction>\n</dynamics>")
    else:
        for key, value in (("damping", 0.0), ("friction", level)):
            if (one := dynamics.child(key)) is not None:
                document.write(one, f"{value:.9g}")
            elif value:
                document.append(dynamics, f"<{key}>{value:.9g}</{key}>")
    document.append(model, plugin(made, name))
