"""Faults of a user's loop, reported before anything is fitted to it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.gap.problem.log import LEAST_SAMPLES
from clie_blocks.analysis.records import Record
from clie_blocks.errors import ClieError, DivergedError, NotIdentifiableError, RecordError

if TYPE_CHECKING:
    from control import NonlinearIOSystem

Answer = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]

SAME_CLOCK = 1e-3  # largest relative difference of sample times
MOST_GROWTH = 7.0  # e-folds of a small error within a log: a thousandfold
FASTEST = 2.5  # pole times step, from which on a Runge-Kutta step of fourth order runs away


def check_records(records: Sequence[Record], n: int, name: str) -> None:
    """Refuse logs that do not fit a loop, or each other.

    Raises
    ------
    RecordError
        If a log has other joints or another clock, or does not say what was asked.
    NotIdentifiableError
        If a log is too short.
    """
    if not records:
        raise RecordError("there is no record to diagnose: give one, or a list of them")
    for record in records:
        if record.q.shape[1] != n:
            raise RecordError(f"{record.source} has {record.q.shape[1]} joints and the loop "
                              f"{name!r} has {n}")
        if record.qd is None and record.pe is None:
            raise RecordError(
                f"{record.source} has neither a reference qd nor an excitation pe, so that "
                f"nothing says what the loop {name!r} was asked: log one of them")
        if len(record) < LEAST_SAMPLES:
            raise NotIdentifiableError(
                f"{record.source} has {len(record)} samples; a diagnosis needs at least "
                f"{LEAST_SAMPLES} per log, better 20 s of motion: record longer")
        period = records[0].sample_time
        if abs(record.sample_time - period) > SAME_CLOCK * period:
            raise RecordError(
                f"{record.source} has a sample every {record.sample_time:g} s, "
                f"{records[0].source} every {period:g} s; bring them to one clock with "
                "clie_blocks.analysis.records.resample")


def guarded_loop(loop: NonlinearIOSystem) -> Answer:
    """Return ``f(x, u) -> (rates or next state, outputs)`` that tells a loop's faults in words."""
    def answer(x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        try:
            with np.errstate(all="ignore"):
                moved, shown = (np.array(part, float).ravel() for part in (
                    loop.dynamics(0.0, x, u), loop.output(0.0, x, u)))
        except Exception as error:
            raise ClieError(f"{loop.name}: {_explained(error, x, u)}") from error
        for found, wanted, what in ((moved, loop.nstates, "update"),
                                    (shown, loop.noutputs, "output")):
            if len(found) != wanted:
                raise ClieError(f"{loop.name}: the {what} function returns {len(found)} numbers "
                                f"where {wanted} are declared")
            if not np.isfinite(found).all():
                raise ClieError(
                    f"{loop.name}: the {what} function gives NaN or infinity, {_at(x, u)}, where "
                    "the joints stand as in the first sample of the log or a little beside it; "
                    "keep roots, logarithms and divisions off zero")
        return moved, shown

    return answer


def _explained(error: Exception, x: np.ndarray, u: np.ndarray) -> str:
    if "algebraic loop" in str(error):
        return ("algebraic loop: signals pass from block to block without a state or a sample of "
                "delay. Break it with a filter or drive as the robot has it, or solve it "
                "analytically")
    return (f"the loop fails with {type(error).__name__}: {error}, {_at(x, u)}; run "
            "loop.dynamics(0, x, u) and loop.output(0, x, u) there")


def _at(x: np.ndarray, u: np.ndarray) -> str:
    return f"at t = 0, x = {np.round(x, 6).tolist()}, u = {np.round(u, 6).tolist()}"


def check_poles(loop: NonlinearIOSystem, poles: np.ndarray, period: float, duration: float,
                most_substeps: int) -> None:
    """Refuse a linearised loop that no log can be held beside, or that is too fast to be run.

    Parameters
    ----------
    loop : control.NonlinearIOSystem
        The loop.
    poles : ndarray
        Of the linearised loop, in its own time [rad/s], or of z.
    period : float
        Sample time of the log [s].
    duration : float
        Of the log [s].
    most_substeps : int
        Steps of the simulation in one sample.

    Raises
    ------
    DivergedError
        If a small error grows a thousandfold within the log.
    ClieError
        If a pole is faster than the steps of the simulation.

    """
    growth = (np.log(np.abs(poles) + 1e-300) / period if loop.dt else poles.real).max(initial=0.0)
    if growth * duration > MOST_GROWTH:
        raise DivergedError(
            f"{loop.name} is unstable: linearised at the first sample of the log, an error grows "
            f"e-fold every {1.0 / growth:.3g} s, and the log lasts {duration:.3g} s, so that no "
            "model of it stays beside the log. Check the signs of the feedback and the units of "
            "the gains; a machine without feedback needs its controller in the loop")
    fastest = np.abs(poles).max(initial=0.0)
    if not loop.dt and fastest * period / most_substeps > FASTEST:
        raise ClieError(
            f"{loop.name} has a pole at {fastest:.3g} rad/s, and the diagnosis runs a loop in at "
            f"most {most_substeps} steps per sample of the log, which holds poles up to "
            f"{FASTEST * most_substeps / period:.3g} rad/s. Put what is faster, as a current "
            "controller, in its steady state: the logs cannot show it")
