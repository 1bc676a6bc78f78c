"""Pictures of diagrams, in the manner of Simulink."""

from __future__ import annotations

import argparse
import weakref
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from clie_blocks.diagrams.drawing.hints import hints_of
from clie_blocks.diagrams.drawing.layout import layout
from clie_blocks.diagrams.drawing.paint import Shades, paint
from clie_blocks.diagrams.drawing.plan import Layout
from clie_blocks.diagrams.drawing.single import alone
from clie_blocks.diagrams.drawing.words import words_of
from clie_blocks.errors import nearest
from clie_blocks.labels import DiagramError
from clie_blocks.output import describe, run_main, save_figure
from clie_blocks.user_files import run_file

if TYPE_CHECKING:
    import control as ct
    from matplotlib.figure import Figure

_PLANS: weakref.WeakKeyDictionary[Figure, Layout] = weakref.WeakKeyDictionary()


def draw(diagram: ct.InputOutputSystem, *, expand: bool | Collection[str] = False,
         names: Mapping[str, str] | None = None, columns: Sequence[Sequence[str]] = (),
         order: Sequence[str] = (), like: Figure | None = None,
         values: Mapping[str, float] | None = None, value_label: str = "",
         title: str = "") -> Figure:
    """Draw any `control.InterconnectedSystem`, or a single block, as a block diagram.

    Signals flow from left to right and feedback runs back below or above its loop.  A vector
    signal is one thick line with its size over it.  A static block of ones is a summing circle, a
    linear block shows its formula, a static block of one input its characteristic.  The order in
    which the diagram lists its blocks does not matter.

    Parameters
    ----------
    diagram : control.InputOutputSystem
        The diagram, or a block.
    expand : bool or collection of str
        True opens every nested diagram; a collection of keys such as ``'plant'`` or
        ``'plant/motor'`` only those.
    names : dict of str to str, optional
        Names to show instead of the blocks' own, by key.
    columns : list of list of str
        Keys of blocks that share a column, the columns from left to right, such as
        ``[["pd", "pd_model"], ["plant", "model"]]``; other blocks find their own.
    order : list of str
        Keys from top to bottom: of two in one column, the earlier stands above.  Inputs are
        ``'>q_d'``, outputs ``'q>'``.
    like : matplotlib.figure.Figure, optional
        A former picture: its blocks keep their columns, their order in them and the order of
        their ports, unless `columns` or `order` say otherwise.  For diagrams that grow.
    values : dict of str to float, optional
        Colours blocks by a value, such as each one's share of a gap; adds a colour bar.
    value_label : str
        What the values are, with unit.
    title : str
        Heading.

    Returns
    -------
    matplotlib.figure.Figure
        Save it with `clie_blocks.output.save_figure`: the same diagram gives the same bytes, and
        an SVG holds the picture in words.

    Raises
    ------
    DiagramError
        If `diagram` is neither, a key names none of its blocks or is named twice, or `like` is no
        picture that `draw` returned.

    """
    name = getattr(diagram, "name", "")
    if not hasattr(diagram, "syslist"):
        diagram = alone(diagram)
    _check_names(expand if not isinstance(expand, bool) else (), _inner_keys(diagram), "expand")
    plan = layout(diagram, expand, names, hints_of(_former(like), columns, order))
    blocks = {key for key, box in plan.boxes.items() if box.block.kind not in ("input", "output")}
    _check_names(_flat(columns), blocks, "columns")
    for keys, what in ((order, "order"), (names, "names"), (values, "values")):
        _check_names([keys] if isinstance(keys, str) else keys or (), plan.boxes, what)
    return picture_of(plan, name, values=values, value_label=value_label, title=title)


def picture_of(plan: Layout, name: str, *, values: Mapping[str, float] | None = None,
               value_label: str = "", title: str = "") -> Figure:
    """Paint a plan as `draw` does, with `name` for the diagram where there is no title."""
    figure = paint(plan, _shades(values) if values else None, value_label, title)
    _PLANS[figure] = plan
    describe(figure, title or f"Block diagram {name}",
             words_of(plan, values, value_label))
    return figure


def _former(picture: Figure | None) -> Layout | None:
    if picture is not None and picture not in _PLANS:
        raise DiagramError(f"draw: like has {type(picture).__name__}, which is no picture of a "
                           "diagram; give what draw returned for the former one")
    return _PLANS[picture] if picture is not None else None


def _flat(columns: Sequence[Sequence[str]]) -> list[str]:
    if any(isinstance(group, str) for group in [columns, *columns]):
        raise DiagramError(f"draw: columns is {columns!r}; give a list of keys for each column, "
                           'such as [["pd", "pd_model"], ["plant", "model"]]')
    return [key for group in columns for key in group]


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
    seen: set[str] = set()
    for key in keys:
        if key not in known:
            raise DiagramError(f"draw: {what} has {key!r}, which is no block of the picture; "
                               f"{nearest(key, sorted(known))}")
        if key in seen:
            raise DiagramError(f"draw: {what} has {key!r} twice; a block has one place")
        seen.add(key)


def main(argv: Sequence[str] | None = None) -> None:
    """Draw a diagram that a Python file holds."""
    parser = argparse.ArgumentParser(
        prog="picture.py", description="Draw any python-control diagram that a Python file holds. "
        "The file is run.", epilog="Example: python diagrams/picture.py my_loop.py loop -o out")
    parser.add_argument("file", metavar="FILE", help="Python file that makes the diagram")
    parser.add_argument("name", metavar="NAME",
                        help="the diagram in it, or a function without arguments that returns it")
    parser.add_argument("--expand", action="store_true", help="open nested diagrams")
    parser.add_argument("--title", default="", help="heading")
    parser.add_argument("-o", "--output", default="out/picture", metavar="DIR",
                        help="folder for the picture (default: out/picture)")
    args = parser.parse_args(argv)
    found = run_file(args.file, "file of the diagram")
    if args.name not in found:
        raise DiagramError(f"{args.file} defines no {args.name!r}; " + nearest(
            args.name, [name for name in found if not name.startswith("_")]))
    diagram = found[args.name]
    is_function = callable(diagram) and not hasattr(diagram, "input_labels")
    figure = draw(diagram() if is_function else diagram, expand=args.expand, title=args.title)
    print(*save_figure(figure, args.output, args.name), sep="\n")


if __name__ == "__main__":
    run_main(main)
