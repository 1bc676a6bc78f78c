"""The catalogue of effects: ``clie effects``, and one effect's page: ``clie effects backlash``."""

import sys
import textwrap
from collections.abc import Sequence

from clie_blocks.analysis.catalogue.answer import ANSWERS, answer
from clie_blocks.analysis.catalogue.text_curve import text_curve
from clie_blocks.analysis.export.truth_table import TARGETS, support
from clie_blocks.analysis.gap.causes.vocabulary import describe_answer
from clie_blocks.effects import LIBRARY
from clie_blocks.effects.effect import FAMILIES, Effect
from clie_blocks.output import command_parser, print_table, run_main, save_figure, to_json

WIDTH, HEAD = 98, 30


HEADS = ("effect", "family", "port", "equation")


def catalogue() -> list[tuple[str, ...]]:
    """Return one row per effect, by family: name, family, port, equation."""
    return [(name, family, LIBRARY[name].port, _short(LIBRARY[name].equation, 42))
            for family in FAMILIES for name in LIBRARY if LIBRARY[name].family == family]


def page(name: str) -> str:
    """Return the page of one effect as text, with its characteristic."""
    effect = LIBRARY[name]
    parts = [f"{name}: family {effect.family}, port {effect.port}", _indented(effect.equation),
             _parameters(effect), _drawing(effect),
             _entry("looks like", effect.signature),
             _entry("in a diagnosis", describe_answer(name)),
             "confused with\n" + "\n".join(_entry(f"  {other}", experiment)
                                           for other, experiment in effect.confused_with.items()),
             "in simulators\n" + "\n".join(_entry(f"  {other}", where)
                                           for other, where in effect.simulators.items()),
             "exported ('clie export')\n" + "\n".join(
                 _entry(f"  {target}", str(support(name, target))) for target in TARGETS),
             _entry("wrong where", effect.wrong), _entry("physics", _physics(effect)),
             _entry("reference", effect.reference)]
    return "\n\n".join(part for part in parts if part)


def _parameters(effect: Effect) -> str:
    rows = [("parameter", "unit", "range", "typical", "neutral", "")]
    rows += [(p.name, p.unit, f"{p.lower:g} .. {p.upper:g}", f"{p.typical:g}",
              "-" if p.neutral is None else f"{p.neutral:g}", p.meaning)
             for p in effect.parameters]
    widths = [max(len(row[k]) for row in rows) + 2 for k in range(5)]
    indent = sum(widths)
    lines = []
    for *cells, meaning in rows:
        start = "".join(f"{cell:{width}}" for cell, width in zip(cells, widths))
        lines.append(textwrap.fill(start + meaning, WIDTH, subsequent_indent=" " * indent,
                                   drop_whitespace=True).rstrip())
    return "\n".join(lines)


def _drawing(effect: Effect) -> str:
    if effect.curve is not None:
        swept, _ = effect.curve
        path = effect.typical().characteristic()
        output = "torque" if swept == "twist" else effect.build.outputs[0]
        return text_curve(*path, x_label=swept, y_label=output)
    if effect.name in ANSWERS:
        t, y, inputs = answer(effect.name)
        return text_curve(t, y, x_label="t", y_label=f"{effect.build.outputs[0]}, answer to "
                          f"{' and '.join(inputs)}")
    return ""


def _physics(effect: Effect) -> str:
    return ", ".join((
        "never gives energy" if effect.passive else "can give energy",
        {"none": "neither odd nor even"}.get(effect.symmetry, effect.symmetry),
        "each joint on its own" if effect.per_joint else "joints act on each other"))


def _entry(head: str, text: str) -> str:
    return textwrap.fill(f"{head:{HEAD}}{text}", WIDTH, subsequent_indent=" " * HEAD)


def _indented(text: str) -> str:
    return textwrap.fill(text, WIDTH, initial_indent="    ", subsequent_indent="        ")


def _short(text: str, width: int) -> str:
    return text if len(text) <= width else text[:width - 3].rstrip() + "..."


def main(argv: Sequence[str] | None = None) -> int:
    """Print the catalogue or one effect."""
    parser = command_parser(
        "clie effects", "Show the catalogue of effects, or the page of one.",
        output_help="folder for the picture of the effect: characteristic and response")
    parser.add_argument("name", nargs="?", metavar="NAME", help="one effect")
    options = parser.parse_args(argv)
    if options.output and not options.name:
        parser.error("-o needs the NAME of an effect; all of them are in docs/effects.md")
    if options.json:
        names = [options.name] if options.name else LIBRARY
        print(to_json({"schema_version": 1,
                       "effects": [
            LIBRARY[name].as_dict() | {"exported": {
                target: str(support(name, target)) for target in TARGETS}} for name in names]}))
    elif options.name:
        print(page(options.name))
    else:
        print_table(HEADS, catalogue(), "<<<<")
        print(f"\n{len(LIBRARY)} effects; 'clie effects NAME' shows one")
    if options.output:
        _save(options.name, options.output)
    return 0


def _save(name: str, folder: str) -> None:
    from clie_blocks.analysis.catalogue.figure import effect_figure

    for path in save_figure(effect_figure(name), folder, name):
        print(f"wrote {path}", file=sys.stderr)


if __name__ == "__main__":
    run_main(main)
