"""``clie loop``: the paper's identification, Fig. 2, with the gains of the user."""

from collections.abc import Sequence

from clie_blocks.diagrams.clie_loop import CASES
from clie_blocks.diagrams.scripts.paper_experiment import run_cases


def main(argv: Sequence[str] | None = None) -> int:
    """Draw and run the loop, and print the estimates beside Table 2."""
    return run_cases(CASES, argv, "clie loop")
