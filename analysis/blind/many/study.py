"""The study of several effects at once: made, sealed, diagnosed, unsealed, scored."""

from pathlib import Path
from typing import Any

from clie_blocks.analysis.blind.many.robots import MANY_CAUSES
from clie_blocks.analysis.blind.many.scoring import is_missed, score, terminal_lines
from clie_blocks.analysis.blind.protocol.study import run_sealed

__all__ = ["is_missed", "run_study", "terminal_lines"]


def run_study(folder: Path, count: int, seed: int, jobs: int = 1) -> dict[str, Any]:
    """Make, diagnose and open a study of some robots, or continue it, and return its figures."""
    from clie_blocks.analysis.gap.causes.vocabulary import class_of

    return score(*run_sealed(folder, count, seed, jobs, MANY_CAUSES), class_of)
