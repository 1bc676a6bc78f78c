"""Build the gallery of effects, ``docs/effects.md`` and its pictures, from the catalogue itself.

``python docs/effects_gallery.py`` takes about a minute.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import matplotlib

from clie_blocks.analysis.catalogue.figure import effect_figure
from clie_blocks.analysis.catalogue.formula import as_latex
from clie_blocks.analysis.gap.causes.vocabulary import describe_answer
from clie_blocks.effects import LIBRARY
from clie_blocks.effects.effect import FAMILIES
from clie_blocks.output import progress, run_main, save_figure, write

PICTURES = "effects"
HEAD = """# Gallery of effects

Made by `python docs/effects_gallery.py`; `clie effects NAME` shows one of them in a terminal.

    from clie_blocks.effects import LIBRARY, with_effects

    robot = with_effects(plant, [LIBRARY["coulomb"](level=0.3, joints=[1]),
                                 LIBRARY["backlash"](half_gap=1e-3)], measured="motor")
    loop = with_effects(joint_loop(plant, kp, kd), [LIBRARY["gain_error"](kp_error=0.1)])
    law = with_effects(sampled_controller, [LIBRARY["time_delay"](delay=0.005)])

The result has the ports of what went in.  Zero, or the neutral value, removes an effect bit for
bit.  Torques are those of the motor, angles those of the joint.

Each effect stands at its typical parameters.  Left: its characteristic, or its answer in time.
Middle: the loop of Fig. 1 (A = 2, 2.4; B = 0.5, 0.6; Kp = 10, Kd = 5) with and without it under
one excitation for all, the joint that changes most.  Right: the difference of the two.  For
effects of the log the signal is the recorded command, for all others the position.
How the stiff ones converge with the step: [numerics](effects_numerics.md); how they compare with
another engine: [MuJoCo](effects_mujoco.md); what their words mean: [glossary](glossary.md).

"""


def gallery() -> str:
    """Return the text of the page."""
    families = [(family, [name for name in LIBRARY if LIBRARY[name].family == family])
                for family in FAMILIES]
    contents = "\n".join(f"- {family}: " + ", ".join(f"[{name}](#{name})" for name in names)
                         for family, names in families)
    sections = [f"## {family.capitalize()}\n\n" + "\n".join(_entry(name) for name in names)
                for family, names in families]
    return HEAD + contents + "\n\n" + "\n".join(sections)


def _entry(name: str) -> str:
    effect = LIBRARY[name]
    typical = "; ".join(f"`{p.name}` {p.typical:g} {p.unit if p.unit != '1' else ''}".rstrip()
                        for p in effect.parameters)
    confused = "\n".join(f"  - `{other}`: {experiment}"
                         for other, experiment in effect.confused_with.items())
    return (f"### {name}\n\n```math\n{as_latex(effect.equation)}\n```\n\n"
            f"![{name}]({PICTURES}/{name}.svg)\n\n"
            f"- Looks like: {effect.signature}\n"
            f"- In a diagnosis: {describe_answer(name)}\n- Typical: {typical}\n"
            f"- Confused with\n{confused}\n- Wrong where: {effect.wrong}\n"
            f"- Reference: {effect.reference}\n")


def main(argv: Sequence[str] | None = None) -> None:
    """Write the page and one SVG per effect."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", default=Path(__file__).parent, metavar="DIR",
                        type=Path, help="folder of the page; docs by default")
    folder = parser.parse_args(argv).output
    with progress("effects", len(LIBRARY)) as advance, \
            matplotlib.rc_context({"svg.fonttype": "none", "font.family": "sans-serif"}):
        for name in LIBRARY:
            save_figure(effect_figure(name), folder / PICTURES, name, formats=("svg",))
            advance(1)
    print(write(folder / "effects.md", gallery()))


if __name__ == "__main__":
    run_main(main)
