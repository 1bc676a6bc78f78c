"""What a check says about a log."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.records.model import Record

SEVERITIES = ("error", "warning", "repair")
MOST_RANGES = 200  # listed per finding


@dataclasses.dataclass(frozen=True)
class Finding:
    """One fault of a log: what, where, why it matters, how to correct it.

    Parameters
    ----------
    severity : str
        ``error``: nothing sound can be learned until it is corrected; ``warning``: some answers
        are out of reach or less certain; ``repair``: handled, and the answers stand.
    check : str
        Stable name for programs, ``family.fault``.
    what, why, fix : str
        Sentences.
    joint : str, optional
        Joint name; None for the whole log.
    samples : tuple of (int, int)
        Half-open sample ranges; empty for the whole log.
    rescale : (str, float), optional
        Signal of the joint and the factor that would bring it to the right unit.

    """

    severity: str
    check: str
    what: str
    why: str
    fix: str
    joint: str | None = None
    samples: tuple[tuple[int, int], ...] = ()
    rescale: tuple[str, float] | None = None

    def __str__(self) -> str:
        where = f"{self.joint}: " if self.joint else ""
        return f"{where}{self.what} {self.why} {self.fix}".strip()


def fix_units(record: Record, findings: Sequence[Finding]) -> Record:
    """Return the record with the factors applied that the findings propose, each one noted."""
    for finding in findings:
        if finding.rescale and finding.joint is not None:
            signal, factor = finding.rescale
            x = getattr(record, signal).copy()
            x[:, record.joint(finding.joint)] *= factor
            record = record.replace(**{signal: x}).noted(
                f"Multiplied {signal} of {finding.joint} by {factor:.6g}, as requested: "
                f"{finding.what}")
    return record


def ranges(mask: np.ndarray) -> tuple[tuple[int, int], ...]:
    """Half-open ranges in which a mask is true."""
    edges = [*(mask[1:] != mask[:-1]).nonzero()[0] + 1]
    edges = [0, *map(int, edges), len(mask)]
    return tuple((a, b) for a, b in zip(edges, edges[1:], strict=False) if mask[a])
