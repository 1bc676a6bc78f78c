"""Draw the figures that stand in the README from the very diagrams: ``python docs/figures.py``."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from clie_blocks import paper
from clie_blocks.diagrams.clie_composite import clie_composite
from clie_blocks.diagrams.clie_loop import clie_loop
from clie_blocks.diagrams.feedback_linearization import feedback_linearization
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.diagrams.picture import draw
from clie_blocks.output import guarded, save_figure
from clie_blocks.signals import Diagram

NAMES = {"pd": "PD controller", "plant": "robot", "pd_model": "PD controller",
         "model": "estimated model", "update": "update law", "controller": "controller (50)"}


def figures() -> dict[str, Diagram]:
    """Return the paper's diagrams by file name."""
    arm, gains = paper.paper_arm(), (paper.KP, paper.KD)
    return {"fig_1": joint_loop(arm, *gains), "fig_2": clie_loop(arm, *gains, paper.GAMMA),
            "fig_2_composite": clie_composite(arm, *gains, paper.GAMMA, paper.ALPHA[2]),
            "fig_5": feedback_linearization(arm, paper.THETA_HAT[1], *gains)}


def main(argv: Sequence[str] | None = None) -> None:
    """Write one SVG per figure."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("-o", "--output", default=Path(__file__).parent / "figures",
                         metavar="DIR", help="folder for the pictures")
    folder = options.parse_args(argv).output
    for stem, diagram in figures().items():
        names = {key: text for key, text in NAMES.items()
                 if key in {block.name for block in diagram.syslist}}
        print(*save_figure(draw(diagram, names=names), folder, stem, formats=("svg",)))


if __name__ == "__main__":
    raise SystemExit(guarded(main))
