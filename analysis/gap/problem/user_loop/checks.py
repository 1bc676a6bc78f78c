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

LoopFunction = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
"""State and inputs of a loop -> its rates or next state, and its outputs."""

SAME_SAMPLE_TIME = 1e-3  # largest relative difference of the sample times of logs on one clock
LARGEST_GROWTH = 7.0  # e-folds of a small error within a log: a thousandfold
# Pole times step, above which a Runge-Kutta step of fourth order is unstable (2.79 on the axis).
STABILITY_LIMIT = 2.5


def check_records(records: Sequence[Record], n: int, name: str) -> None:
    """Refuse logs that do not fit a loop, or each other.

    Raises
    ------
    RecordError
        If a log has other joints or another clock, or holds neither reference nor excitation.
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
                f"nothing says what drove the loop {name!r}: log one of them")
        if len(record) < LEAST_SAMPLES:
            raise NotIdentifiableError(
                f"{record.source} has {len(record)} samples; a diagnosis needs at least "
                f"{LEAST_SAMPLES} per log, better 20 s of motion: record longer")
        period = records[0].sample_time
        if abs(record.sample_time - period) > SAME_SAMPLE_TIME * period:
            raise RecordError(
                f"{record.source} has a sample every {record.sample_time:g} s, "
                f"{records[0].source} every {period:g} s; bring them to one clock with "
                "clie_blocks.analysis.records.resample")


def guarded_loop(loop: NonlinearIOSystem) -> LoopFunction:
    """Return ``f(x, u) -> (rates or next state, outputs)`` that reports the faults of a loop."""
    def evaluate(x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        try:
            with np.errstate(all="ignore"):
                rates, outputs = (np.array(part, float).ravel() for part in (
                    loop.dynamics(0.0, x, u), loop.output(0.0, x, u)))
        except Exception as error:
            raise ClieError(f"{loop.name}: {_describe_failure(error, x, u)}") from error
        for values, declared, name in ((rates, loop.nstates, "update"),
                                       (outputs, loop.noutputs, "output")):
            if len(values) != declared:
                raise ClieError(f"{loop.name}: the {name} function returns {len(values)} numbers "
                                f"where {declared} are declared")
            if not np.isfinite(values).all():
                raise ClieError(
                    f"{loop.name}: the {name} function gives NaN or infinity, {_at(x, u)}, where "
                    "the joints are at or near their position in the first sample of the log; "
                    "keep roots, logarithms and divisions off zero")
        return rates, outputs

    return evaluate


def _describe_failure(error: Exception, x: np.ndarray, u: np.ndarray) -> str:
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
    """Refuse a linearised loop that diverges within a log, or that is too fast to be simulated.

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
    if growth * duration > LARGEST_GROWTH:
        raise DivergedError(
            f"{loop.name} is unstable: linearised at the first sample of the log, an error grows "
            f"e-fold every {1.0 / growth:.3g} s, and the log lasts {duration:.3g} s, so that no "
            "model of it can follow the log. Check the signs of the feedback and the units of "
            "the gains; a machine without feedback needs its controller in the loop")
    fastest = np.abs(poles).max(initial=0.0)
    if not loop.dt and fastest * period / most_substeps > STABILITY_LIMIT:
        raise ClieError(
            f"{loop.name} has a pole at {fastest:.3g} rad/s, and the diagnosis runs a loop in at "
            f"most {most_substeps} steps per sample of the log, which are stable for poles up to "
            f"{STABILITY_LIMIT * most_substeps / period:.3g} rad/s. Replace faster parts, such as "
            "a current controller, by their steady state: the logs cannot show them")
