"""From goal to motion of a servo whose law is unknown: dead time, and how it divides.

A servo reaches 5 % of a step some time after the goal even without any delay, and dry friction
makes it later still.  So lag, delay and friction are fitted together, and each is left out in
turn: a late set-point shifts the whole motion, friction holds it back where it starts and turns.

    ddq = w^2 (goal(t - T) + offset - q - f) - 2 D w dq,   |f| <= level, f against the motion
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.records import Record
from clie_blocks.errors import NotIdentifiableError
from clie_blocks.linear_filters import zero_order_hold

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

    from clie_blocks.compiled import Program

REACHED = 0.05  # of a step
FINE = 10  # steps of the fitted servo per sample of the log
SETTLE = 50  # samples after the start that are not judged
STARTS = (15.0, 40.0)  # rad/s
BLOCK = 2.0  # s, in which errors hang together
NUMBERS = ("frequency", "damping_ratio", "offset", "delay", "level")
FIRST = {"damping_ratio": 1.0, "offset": 0.0, "level": 2e-3}
SCALE = (5.0, 0.2, 0.01, 0.01, 2e-3)
BOUNDS = {"frequency": (1.0, 300.0), "damping_ratio": (0.2, 5.0), "offset": (-1.0, 1.0),
          "delay": (0.0, 0.3), "level": (0.0, 0.5)}
EXPLAINED_BY = {"lag": (), "setpoint_delay": ("delay",), "coulomb": ("level",),
                "both": ("delay", "level")}


@dataclasses.dataclass(frozen=True)
class GoalPath:
    """How a servo follows its goal.

    Parameters
    ----------
    frequency : float
        Of the servo as a second-order lag [rad/s].
    damping_ratio : float
        Of that lag.
    offset : float
        Constant error [rad].
    delay : float
        Pure delay of goal and reading together [s].
    level : float
        Dry friction, as the position error that just moves the servo [rad].
    left : float
        RMS of what this does not explain [rad].
    half_widths : dict
        Of the 95 % intervals of the fitted numbers, by name.

    """

    frequency: float
    damping_ratio: float
    offset: float
    delay: float
    level: float
    left: float
    half_widths: dict[str, float]


def dead_times(record: Record, k: int, least: float = 0.05, rest: int = 5) -> np.ndarray:
    """Times from each step of the goal to 5 % of the motion [s].

    Parameters
    ----------
    record : Record
        With goals qd and positions q.
    k : int
        Joint.
    least : float
        Smallest step of the goal that counts [rad].
    rest : int
        Samples for which the goal must have stood still before.

    """
    goal, q = record.qd[:, k], record.q[:, k]
    moved = np.diff(goal)
    found = []
    for i in np.flatnonzero(np.abs(moved) > least) + 1:
        if i >= rest and not moved[i - rest:i - 1].any():
            after = np.sign(moved[i - 1]) * (q[i:] - q[i])
            late = np.flatnonzero(after > REACHED * abs(moved[i - 1]))
            found += [record.time[i + late[0]] - record.time[i]] if late.size else []
    return np.array(found)


def goal_path(record: Record, k: int, causes: Sequence[str] = ("delay",)) -> GoalPath:
    """Fit the path from goal to motion of one joint.

    Parameters
    ----------
    record : Record
        With goals qd and positions q on an even clock.
    k : int
        Joint.
    causes : sequence of str
        What there is beside the lag: ``delay``, ``level``.

    Raises
    ------
    NotIdentifiableError
        If the goal never moves.

    """
    from scipy.optimize import least_squares

    goal, q, period = record.qd[:, k], record.q[:, k], record.sample_time
    if np.ptp(goal) == 0.0:
        raise NotIdentifiableError(f"{record.source}: the goal of {record.joints[k]} never moves, "
                                   "so that its path cannot be told")
    free = [name for name in NUMBERS if name in (*NUMBERS[:3], *causes)]

    def numbers(p: np.ndarray) -> dict[str, float]:
        return {"delay": 0.0, "level": 0.0, **dict(zip(free, map(float, p), strict=True))}

    def error(p: np.ndarray) -> np.ndarray:
        return (servo_response(goal, q[0], period, **numbers(p)) - q)[SETTLE:]

    low, high = np.transpose([BOUNDS[name] for name in free])
    first = FIRST | {"delay": period}
    fits = [least_squares(error, [(first | {"frequency": start})[name] for name in free],
                          x_scale=[SCALE[NUMBERS.index(name)] for name in free],
                          bounds=(low, high), max_nfev=60) for start in STARTS]
    best = min(fits, key=lambda fit: fit.cost)
    half_widths = 1.96 * np.linalg.norm(block_influence(best, round(BLOCK / period)), axis=0)
    return GoalPath(**numbers(best.x), left=float(np.sqrt(np.mean(best.fun**2))),
                    half_widths=dict(zip(free, half_widths.tolist())))


def block_influence(fit: OptimizeResult, width: int) -> np.ndarray:
    """How far each block of samples pulls the numbers of a least-squares fit, (blocks, numbers).

    Errors within a block hang together, blocks do not: the root of the sum of squares of a column
    is the standard deviation of its number.
    """
    blocks = range(width, len(fit.fun), width)
    gradients = np.array([rows.T @ error for rows, error in zip(
        np.split(fit.jac, blocks), np.split(fit.fun, blocks))])
    return gradients @ np.linalg.pinv(fit.jac.T @ fit.jac)


def describe(record: Record, k: int) -> str:
    """Path of one joint in a sentence: what is delay, what is friction, and the dead time."""
    path, late = goal_path(record, k, ("delay", "level")), dead_times(record, k)
    delay, level = (_with_intervals(path, *number) for number in (("delay", 1e3), ("level", 1e3)))
    said = (f"{record.joints[k]}: goals act {delay} ms late, and dry friction holds up to {level} "
            "mrad of error.")
    if not late.size:
        return said
    first, tick = 1e3 * np.median(late), 1e3 * record.sample_time
    return (f"{said} With lag and friction the dead time is {first + tick:.0f} ms, from the last "
            f"reading under an old goal to the first beyond {100 * REACHED:.0f} % of a step "
            f"({first:.0f} ms from the tick of the new goal; median of {late.size}).")


def _with_intervals(path: GoalPath, name: str, scale: float) -> str:
    return f"{scale * getattr(path, name):.3g} +- {scale * path.half_widths[name]:.2g}"


def error_by_hypothesis(fitted: Record, judged: Record, k: int,
                        ) -> dict[str, tuple[GoalPath, float]]:
    """RMS error on a log that was not used, by what the servo is said to have beside its lag.

    Parameters
    ----------
    fitted, judged : Record
        Log to fit on, and log to judge on.
    k : int
        Joint.

    Returns
    -------
    dict
        ``lag``, ``setpoint_delay``, ``coulomb``, ``both`` -> (GoalPath, RMS on `judged` [rad]).

    """
    return {name: (path, validation_error(path, judged, k))
            for name, path in paths_by_hypothesis(fitted, k).items()}


def paths_by_hypothesis(record: Record, k: int, ways: Sequence[str] = tuple(EXPLAINED_BY),
                        ) -> dict[str, GoalPath]:
    """Path of one joint by what the servo is said to have beside its lag, see `explained`."""
    return {name: goal_path(record, k, EXPLAINED_BY[name]) for name in ways}


def validation_error(path: GoalPath, record: Record, k: int) -> float:
    """RMS of what a path does not predict of a log, but for a constant [rad]."""
    numbers = {number: getattr(path, number) for number in NUMBERS}
    found = servo_response(record.qd[:, k], record.q[0, k], record.sample_time, **numbers)
    return float(np.std((found - record.q[:, k])[SETTLE:]))


def servo_response(goal: np.ndarray, start: float, period: float, frequency: float,
                   damping_ratio: float, offset: float, delay: float, level: float = 0.0,
                   ) -> np.ndarray:
    """Position of a servo that holds each goal and is read late, shape (N,)."""
    step = period / FINE
    rates = np.array([[0.0, 1.0], [-frequency**2, -2 * damping_ratio * frequency]])
    drive = np.array([[0.0], [frequency**2]])
    a, b = zero_order_hold(rates, drive, step)
    pulled = np.repeat(goal, FINE) + offset - start
    fine = start + np.asarray(_servo().run(
        pulled.size, inputs={"goal": pulled[:, None]}, initial_state=np.zeros(2),
        params={"a": a, "b": b[:, 0], "level": np.array(level)}).outputs).ravel()[:pulled.size]
    time = step * np.arange(fine.size)
    return np.interp(period * np.arange(len(goal)) - delay, time, fine)


@functools.cache
def _servo() -> Program:
    """Compiled step of the servo, held by dry friction where that can hold it."""
    import control as ct

    from clie_blocks.compiled import compile_diagram

    def update(t: float, x: np.ndarray, u: np.ndarray, params: dict[str, np.ndarray],
               ) -> np.ndarray:
        (a_qq, a_qv), (a_vq, a_vv) = params["a"]
        b_q, b_v = params["b"]
        q, dq = x
        free = a_vq * q + a_vv * dq + b_v * u[0]
        held = np.clip(free / b_v, -params["level"], params["level"])
        return np.array([a_qq * q + a_qv * dq + b_q * (u[0] - held), free - b_v * held])

    return compile_diagram(ct.nlsys(
        update, lambda t, x, u, params: x[:1], name="servo", dt=1.0, inputs=["goal[0]"],
        outputs=["q[0]"], states=["q", "dq"],
        params={"a": np.eye(2), "b": np.ones(2), "level": np.array(0.1)}))
