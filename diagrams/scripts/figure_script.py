"""What a script does that holds a diagram and no experiment: it draws the diagram."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from clie_blocks.diagrams.picture import draw
from clie_blocks.output import save_figure

if TYPE_CHECKING:
    import control as ct


def draw_script(build: Callable[[], ct.InterconnectedSystem], stem: str, description: str,
                argv: Sequence[str] | None = None, *, names: Mapping[str, str] | None = None,
                epilog: str = "") -> None:
    """Run the command line of a script that draws one diagram.

    Parameters
    ----------
    build : callable
        Returns the diagram.
    stem : str
        Name of the script and of the picture, without ending.
    description : str
        What is drawn.
    argv : sequence of str, optional
        Arguments; by default those of the command line.
    names : dict of str to str, optional
        Names to show instead of the blocks' own.
    epilog : str
        Last line of the help.

    """
    parser = argparse.ArgumentParser(
        prog=f"{stem}.py", formatter_class=argparse.ArgumentDefaultsHelpFormatter,
        description=description, epilog=epilog)
    parser.add_argument("-o", "--output", default=f"out/{stem}", metavar="DIR",
                        help="folder for the picture")
    folder = parser.parse_args(argv).output
    print(*save_figure(draw(build(), names=names), folder, stem), sep="\n")
