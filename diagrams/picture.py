"""Pictures of diagrams, in the manner of Simulink."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import TYPE_CHECKING

from clie_blocks.diagrams.drawing.layout import layout
from clie_blocks.diagrams.drawing.paint import Shades, paint
from clie_blocks.errors import nearest
from clie_blocks.signals import DiagramError

if TYPE_CHECKING:
    import control as ct
    from matplotlib.figure import Figure


def draw(diagram: ct.InputOutputSystem, *, expand: bool | Collection[str] = False,
         names: Mapping[str, str] | None = None, values: Mapping[str, float] | None = None,
         value_label: str = "", title: str = "") -> Figure:
    """Draw any `control.InterconnectedSystem`, or a single block, as a block diagram.

    Signals flow from left to right and feedback runs back below or above its loop.  A vector
    signal is one thick line with its size over it.  A static block of ones is a summing circle, a
    linear block shows its formula, a static block of one input its characteristic.

    Parameters
    ----------
    diagram : control.InputOutputSystem
        The diagram, or a block.
    expand : bool or collection of str
        True opens every nested diagram; a collection of keys such as ``'plant'`` or
        ``'plant/motor'`` only those.
    names : dict of str to str, optional
        Names to show instead of the blocks' own, by key.
    values : dict of str to float, optional
        Colours blocks by a value, such as each one's share of a gap; adds a colour bar.
    value_label : str
        What the values are, with unit.
    title : str
        Heading.

    Returns
    -------
    matplotlib.figure.Figure
        Save it with `clie_blocks.output.save_figure`: the same diagram gives the same bytes.

    Raises
    ------
    DiagramError
        If `diagram` is neither, or a key names none of its blocks.

    """
    if not hasattr(diagram, "syslist"):
        diagram = _alone(diagram)
    _check_names(expand if not isinstance(expand, bool) else (), _inner_keys(diagram), "expand")
    plan = layout(diagram, expand, names)
    for mapping, what in ((names, "names"), (values, "values")):
        _check_names(mapping or (), plan.boxes, what)
    return paint(plan, _shades(values) if values else None, value_label, title)


def _alone(block: ct.InputOutputSystem) -> ct.InterconnectedSystem:
    """A block as a diagram of its own."""
    import control as ct

    if not isinstance(block, ct.InputOutputSystem):
        raise DiagramError(f"cannot draw {block!r}: it is no block of python-control; draw what "
                           "ct.nlsys, ct.ss, ct.tf or interconnect returns")
    if not isinstance(block, ct.NonlinearIOSystem):  # a transfer function
        block = ct.ss(block, name=block.name, inputs=block.input_labels,
                      outputs=block.output_labels)
    return ct.interconnect([block], inplist=[f"{block.name}.{one}" for one in block.input_labels],
                           inputs=block.input_labels,
                           outlist=[f"{block.name}.{one}" for one in block.output_labels],
                           outputs=block.output_labels, name=f"{block.name}_alone")


def _shades(values: Mapping[str, float]) -> Shades:
    plain = {key: float(value) for key, value in values.items()}
    low, high = min(0.0, *plain.values()), max(plain.values())
    return Shades(plain, low, high if high > low else low + 1.0)


def _inner_keys(diagram: ct.InterconnectedSystem, path: str = "") -> list[str]:
    found = []
    for block in diagram.syslist:
        if hasattr(block, "syslist"):
            found += [f"{path}{block.name}", *_inner_keys(block, f"{path}{block.name}/")]
    return found


def _check_names(keys: Iterable[str], known: Collection[str], what: str) -> None:
    for key in keys:
        if key not in known:
            raise DiagramError(f"draw: {what} has {key!r}, which is no block of the picture; "
                               f"{nearest(key, known)}")
