"""The PD law that made the commands of a log, found by regression, for a robot file to start with.

Gains follow linearly once the velocity filter is known; the corners of G1 (47) are searched for.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from clie_blocks.analysis.records.checks.law import EXACT, LawFit, fit_variant
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.replay import variants
from clie_blocks.linear_filters import DISCRETISATIONS

SAMPLES = 6000  # of a log, enough to tell a filter
CORNERS = 100.0, 500.0  # rad/s, from which the search starts
STEPS = 80  # of it, per discretisation
WIDE = 4.0  # log of a corner over the first one beyond which no controller has it
UNEXPLAINED = 20.0  # log of a share, of a joint whose law cannot be fitted
SIMPLER = 1.1  # times the misfit of G1 that a filter without corners may leave per joint
LOGS = 3  # that are tried
AGREE = 0.02  # by which the gains on reference and position of a PD law may differ


@dataclasses.dataclass(frozen=True, eq=False)
class LawOfLog:
    """A PD law by regression, and the largest share of a command that it leaves."""

    controller: Controller
    share: float

    @property
    def is_certain(self) -> bool:
        """Whether it explains the commands of every joint but for their rounding."""
        return self.share < EXACT


def law_of_logs(records: Sequence[Record]) -> LawOfLog | None:
    """Return the law of the log that shows it best; None where no log shows a PD law.

    Parameters
    ----------
    records : sequence of Record
        Logs of one robot.

    """
    found = [law for record in records[:LOGS] if (law := _law(record)) is not None]
    return min(found, key=lambda law: law.share, default=None)


def _law(record: Record) -> LawOfLog | None:
    if record.u is None or record.qd is None:
        return None
    record = record.replace(robot=None).part(0, SAMPLES)
    simple = _best(record, _without_corners(record))
    cornered = _best(record, _cornered(record))
    is_simple = simple.misfit < cornered.misfit + record.n * np.log(SIMPLER)
    controller, variant, fits, _ = simple if is_simple else cornered
    if not all(fit is not None and _is_pd(fit) for fit in fits):
        return None
    known = [fit for fit in fits if fit is not None]
    stated: dict[str, Any] = {"velocity_filter": variant} if variant not in DISCRETISATIONS else {
        "highpass": controller.highpass, "lowpass": controller.lowpass,
        "discretisation": variant}
    kp, kd = (np.array([fit.gains[signal][0] for fit in known]) for signal in ("q", "dq"))
    share = max(fit.rms / _size(record, k) for k, fit in enumerate(known))
    law = Controller(law="pd", kp=kp, kd=kd, sample_time=_period(record), **stated)
    return LawOfLog(law, share)


class _Candidate(NamedTuple):
    """A controller of gain one, how it forms its velocity, and what its fit leaves."""

    controller: Controller
    variant: str
    fits: list[LawFit | None]
    misfit: float


def _best(record: Record, candidates: Iterable[tuple[Controller, str]]) -> _Candidate:
    tried = []
    for controller, variant in candidates:
        fits = _fits(record, controller, variant)
        tried.append(_Candidate(controller, variant, fits, _misfit(record, fits)))
    return min(tried, key=lambda one: one.misfit)


def _without_corners(record: Record) -> Iterator[tuple[Controller, str]]:
    plain = _controller(record.n)
    yield from ((plain, variant) for variant in variants(record, plain))


def _cornered(record: Record) -> Iterator[tuple[Controller, str]]:
    for discretisation in ("tustin", "zoh", "backward", "matched"):
        yield _with_corners(record, discretisation), discretisation


def _controller(n: int, **filter_: Any) -> Controller:
    one = np.ones(n)
    return Controller(law="pd", kp=one, kd=one, **filter_)


def _with_corners(record: Record, discretisation: str) -> Controller:
    """Controller with the corners of G1 that leave least."""
    from scipy.optimize import minimize

    start = np.log(CORNERS)

    def of(x: np.ndarray) -> Controller:
        low, high = sorted(np.exp(x))
        return _controller(record.n, highpass=low, lowpass=high, discretisation=discretisation)

    def misfit(x: np.ndarray) -> float:
        if np.abs(x - start).max() > WIDE:
            return UNEXPLAINED * record.n
        return _misfit(record, _fits(record, of(x), discretisation))

    found = minimize(misfit, start, method="Nelder-Mead",
                     options={"maxfev": STEPS, "xatol": 1e-3, "fatol": 1e-3})
    return of(np.clip(found.x, start - WIDE, start + WIDE))


def _fits(record: Record, controller: Controller, variant: str) -> list[LawFit | None]:
    return [fit_variant(record, controller, k, variant) for k in range(record.n)]


def _misfit(record: Record, fits: Sequence[LawFit | None]) -> float:
    """Sum of the logs of the shares that are left, so that joints count alike."""
    return float(sum(UNEXPLAINED if fit is None else np.log(fit.rms / _size(record, k) + 1e-12)
                     for k, fit in enumerate(fits)))


def _size(record: Record, k: int) -> float:
    return float(np.nanstd(record.signal("u")[:, k])) or 1.0


def _is_pd(fit: LawFit) -> bool:
    """Whether gains are those of a PD law: positive, and alike on reference and position."""
    gains = {name: value for name, (value, _) in fit.gains.items()}
    kp = gains.get("q", 0.0)
    return (kp > 0.0 and gains.get("dq", 0.0) > 0.0
            and abs(gains.get("qd", kp) - kp) < AGREE * kp
            and abs(gains.get("pe", 1.0) - 1.0) < AGREE)


def _period(record: Record) -> float:
    """Period of the log without the rounding of its stamps [s]."""
    return float(f"{record.sample_time:.4g}")
