"""Experiments that could be run next, inside what the robot may do.

Limits are those of the robot file; the command's is else that of the law.  Where nothing is
stated, a run stays inside what the logs have reached.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis
from clie_blocks.analysis.gap.method.assessment import AssessmentMethod
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.noise import decimated
from clie_blocks.analysis.records.robot_sections import Limits as StatedLimits
from clie_blocks.errors import DivergedError

_TRIALS = 3  # of a scale, before an experiment is given up
_ON_DIVERGENCE = 0.3  # factor on an experiment in which the model diverges
_BEGIN = 1.0  # s, after which a run moves as far as it is meant to
_CLOSE = 0.7  # share of the intended use of a limit that is close enough to it


@dataclasses.dataclass(frozen=True, eq=False)
class Limits:
    """What a run may reach, per joint.

    Parameters
    ----------
    lowest, highest : ndarray, shape (n,)
        Positions [rad].
    speed, torque : ndarray, shape (n,)
        Largest speed [rad/s] and command [N m].

    """

    lowest: np.ndarray
    highest: np.ndarray
    speed: np.ndarray
    torque: np.ndarray

    @property
    def centre(self) -> np.ndarray:
        """Middle of the positions."""
        return (self.lowest + self.highest) / 2

    @property
    def reach(self) -> np.ndarray:
        """Largest distance from the middle."""
        return (self.highest - self.lowest) / 2 + 1e-9


def motion_limits(problem: Problem) -> Limits:
    """Return the limits of a robot: the stated ones, else what its logs have reached."""
    stated, shift = _stated_limits(problem)
    logs, reached = problem.logs, _largest_torque(problem)
    velocities = [_velocity(log.q, problem.period) for log in logs]
    of_law = np.where(np.isfinite(problem.law.saturation), problem.law.saturation, reached)
    return Limits(
        np.min([log.q.min(axis=0) for log in logs], axis=0) if stated.lower is None
        else stated.lower + shift,
        np.max([log.q.max(axis=0) for log in logs], axis=0) if stated.upper is None
        else stated.upper + shift,
        np.max([np.abs(velocity).max(axis=0) for velocity in velocities], axis=0)
        if stated.speed is None else stated.speed,
        of_law if stated.command is None else stated.command)


def trusted_limits(problem: Problem, method: AssessmentMethod) -> Limits:
    """Return the limits of a run whose torques the drives are known to give.

    A drive that loses too little for any log to show it may lose much at many times the torque,
    and the robot then leaves the limits that no model would leave.
    """
    limits = motion_limits(problem)
    known = np.maximum(method.experiment_torque_growth * _largest_torque(problem),
                       method.experiment_least_torque * limits.torque)
    return dataclasses.replace(limits, torque=np.minimum(limits.torque, known))


def _largest_torque(problem: Problem) -> np.ndarray:
    """Largest command of each joint in any log, shape (n,) [N m]."""
    largest: np.ndarray = np.max([np.abs(log.u).max(axis=0) for log in problem.logs], axis=0)
    return largest


def _stated_limits(problem: Problem) -> tuple[StatedLimits, np.ndarray]:
    """Limits of the robot file, and the positions of the diagnosis less those of the logs.

    Motors that turn several joints move within other limits than those of the joints.
    """
    statement, robot = problem.statement, problem.robot
    if statement is None or robot is None or problem.links.motor_coupling is not None:
        return StatedLimits(), np.zeros(problem.n)
    return robot.limits, problem.records[0].q[0] - statement.records[0].q[0]


def _velocity(q: np.ndarray, period: float) -> np.ndarray:
    """Velocities of positions without their noise [rad/s]."""
    slow = decimated(q, period)
    return np.gradient(slow, len(q) / len(slow) * period, axis=0)


def elementary_motions(problem: Problem, limits: Limits, method: AssessmentMethod) -> list[Log]:
    """Named experiments that an engineer would think of, as logs without an answer."""
    time, duration = _time(problem, method), method.experiment_duration
    triangle = 2 / np.pi * np.arcsin(np.sin(2 * np.pi * time / 10.0))
    sweep = np.sin(2 * np.pi * (0.1 * time + (8.0 - 0.1) * time**2 / (2 * duration)))
    ladder = np.sin(2 * np.pi * 0.25 * time) * np.floor(1 + 4 * time / duration) / 4
    still = 0.0 * limits.reach + 0.0 * time
    return [test_motion(problem, limits, *parts) for parts in (
        ("slow triangle over the full travel", limits.reach * triangle, still),
        ("ladder of amplitudes", limits.reach * ladder, still),
        ("chirp of torque, 0.1 to 8 Hz", still, limits.torque * sweep))]


def multisine_motion(problem: Problem, limits: Limits, band: tuple[float, float],
                     phases: np.ndarray, share: float, method: AssessmentMethod) -> Log:
    """A multisine of torque and set-point; joints have lines of their own.

    Parameters
    ----------
    problem : Problem
        The robot.
    limits : Limits
        What it may reach.
    band : tuple of float
        Lowest and highest line [Hz].
    phases : ndarray, shape (2, lines, n)
        Of the lines of set-point and torque [rad].
    share : float
        Of the motion that comes from the set-point.
    method : AssessmentMethod
        Duration, period and number of lines.

    """
    n, samples, repeat = problem.n, len(_time(problem, method)), method.experiment_period
    lines = np.unique(np.round(np.geomspace(*band, method.experiment_lines) * repeat))
    waves = np.stack([[
        sum_of_sines((lines + k / n) / repeat * problem.period, of_kind[:len(lines), k], samples)
        for k in range(n)] for of_kind in phases]).swapaxes(1, 2)
    waves /= np.abs(waves).max(axis=1, keepdims=True)
    name = f"multisine, {band[0]:g} to {band[1]:g} Hz, {100 * share:.0f} % of it as set-point"
    return test_motion(problem, limits, name, share * limits.reach * waves[0],
                       (1 - share) * limits.torque * waves[1])


def sum_of_sines(frequencies: np.ndarray, phases: np.ndarray, samples: int) -> np.ndarray:
    """Sum of sines of some frequencies [periods per sample] and phases [rad].

    A turn to a sample is one to the start of its block and one inside the block, so that few
    turns have to be computed and the rest is a product of matrices.
    """
    block = int(np.ceil(np.sqrt(samples)))
    turns = 2j * np.pi * frequencies[:, None]
    starts = np.exp(turns * block * np.arange(-(-samples // block)) + 1j * phases[:, None])
    return np.imag(starts.T @ np.exp(turns * np.arange(block))).ravel()[:samples]


def _time(problem: Problem, method: AssessmentMethod) -> np.ndarray:
    """Instants of an experiment [s], shape (N, 1)."""
    return problem.period * np.arange(round(method.experiment_duration / problem.period))[:, None]


def test_motion(problem: Problem, limits: Limits, name: str, motion: np.ndarray,
                torque: np.ndarray) -> Log:
    """One experiment around the middle of the positions, as a log without an answer.

    The motion [rad] and the torque [N m] have shape (N, n).  The robot starts there at rest, so
    both begin gently.
    """
    begun = np.clip(problem.period * np.arange(len(motion))[:, None] / _BEGIN, 0.0, 1.0)
    gently = begun**2 * (3.0 - 2.0 * begun)
    q_d, zero = limits.centre + gently * motion, np.zeros_like(motion)
    supply = problem.fit[0].supply
    return Log(name, q_d, zero + np.nan, q_d, gently * torque, limits.centre,
               problem.fit[0].at_rest, zero, supply=(
                   None if supply is None else zero + supply.mean(axis=0)))


def scale_inside(models: Sequence[Hypothesis], log: Log, limits: Limits, use: float,
                 ) -> tuple[Log, list[np.ndarray]] | None:
    """Scale an experiment down (or up) until every model of the robot stays inside limits.

    Any of the models may be the robot, so the one that comes closest to a limit sets the scale:
    it uses a share `use` of it.
    Returns the experiment and the models' motions in it, (N, n) [rad] each; None where one of them
    diverges or even small motions leave the limits.
    """
    for _ in range(_TRIALS):
        try:
            runs = [model.simulator.run(log, model.of_log(0))[:2] for model in models]
        except DivergedError:
            factor = _ON_DIVERGENCE
        else:
            used = max(float(used_limits(q, u, limits, models[0].problem.period).max())
                       for q, u in runs)
            if _CLOSE * use < used <= 1.0:
                return log, [q for q, _ in runs]
            factor = use / used
        q_d = limits.centre + factor * (log.q_d - limits.centre)
        log = dataclasses.replace(log, q=q_d, q_d=q_d, pe=factor * log.pe)
    return None


def used_limits(q: np.ndarray, u: np.ndarray, limits: Limits, period: float) -> np.ndarray:
    """Shares of the limits of position, speed and torque that a run uses, shape (3, n)."""
    velocity = _velocity(q, period)
    return np.array([np.abs(q - limits.centre).max(axis=0) / limits.reach,
                     np.abs(velocity).max(axis=0) / (limits.speed + 1e-9),
                     np.abs(u).max(axis=0) / (limits.torque + 1e-12)])
