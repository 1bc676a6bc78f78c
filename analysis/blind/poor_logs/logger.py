"""An arm under its law in MuJoCo, and what a logger keeps of it."""

import dataclasses
import math
from collections.abc import Callable

import numpy as np

from clie_blocks.analysis.blind.engine.controller import SampledFilter, filter_coefficients
from clie_blocks.analysis.blind.laws.arm import Arm
from clie_blocks.analysis.blind.laws.run import SOUND, Effect, Machine, Motion
from clie_blocks.analysis.blind.poor_logs.kinds import JOINT, Condition, Content

Signals = dict[str, np.ndarray]  # each of shape (N, n), time of shape (N,)
TORQUE_NOISE, TORQUE_STEP = 5e-3, 1e-3  # of a torque sensor, of the largest command
COARSE = 0.02  # step of a coarse torque, of the largest command
TENTH_OF_DEGREE = math.radians(0.1)
CORNERS = (20.0, 40.0)  # Hz, of the low-pass of a channel
DROPPED = 0.02  # share of the rows that a jittering logger loses
TICKS = (1, 2, 3)  # samples of the controller from one of its rows to the next


@dataclasses.dataclass(frozen=True, eq=False)
class Controller:
    """PD law on a filtered velocity, or a P law, as of a hobby servo.

    Parameters
    ----------
    kp, kd : ndarray, shape (n,)
        Gains, motor side [N m/rad, N m s/rad]; `kd` is zero for a servo.
    highpass, lowpass : float
        Corners of the velocity filter [rad/s].
    step : float
        To which commands are rounded [N m].

    """

    kp: np.ndarray
    kd: np.ndarray
    highpass: float
    lowpass: float
    step: float

    def start(self, period: float) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
        """Return the law at the start of an experiment, a function of reference and position."""
        corners = np.full(len(self.kp), self.highpass), np.full(len(self.kp), self.lowpass)
        rate = SampledFilter(*filter_coefficients(*corners, period, "tustin"))

        def law(q_d: np.ndarray, q: np.ndarray) -> np.ndarray:
            free = self.kp * (q_d - q) - self.kd * rate(q)
            return _rounded(free, self.step)
        return law


@dataclasses.dataclass(frozen=True)
class Encoder:
    """Noise [rad] and step [rad] of both encoders of a joint."""

    sigma: float
    step: float

    def read(self, q: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """What it reports of positions."""
        read: np.ndarray = np.rint((q + self.sigma * rng.normal(size=len(q))) / self.step)
        return read * self.step


def run(arm: Arm, controller: Controller, encoder: Encoder, motion: Motion,
        rng: np.random.Generator, condition: Condition, acts_on: str = JOINT,
        effect: Effect = SOUND) -> Signals:
    """Signals of an experiment at each sample of the controller; fewer where it is unstable.

    Parameters
    ----------
    arm : Arm
        The robot.
    controller : Controller
        Its law.
    encoder : Encoder
        Its sensors of position.
    motion : callable
        Reference at a time.
    rng : numpy.random.Generator
        Of the encoders.
    condition : Condition
        Has the period and the length.
    acts_on : str
        Position on which the law acts.
    effect : Effect
        What the robot has beyond its model.

    Returns
    -------
    dict of str to ndarray
        `time`, `q`, `q_motor`, `qd`, `command`, and `torque` of the motors over the sample.

    """
    machine, law = Machine(arm, effect, condition.period), controller.start(condition.period)
    rows: list[tuple[np.ndarray, ...]] = []
    for k in range(round(condition.seconds / condition.period)):
        read = {"q": encoder.read(machine.q, rng), "q_motor": encoder.read(machine.q_motor, rng)}
        q_d = np.round(motion(k * condition.period)[0], 9)
        u = law(q_d, read[acts_on])
        rows.append((read["q"], read["q_motor"], q_d, u, machine.step(u)))
        if not machine.is_stable:
            break
    signals = dict(zip(("q", "q_motor", "qd", "command", "torque"), np.swapaxes(rows, 0, 1)))
    return {"time": condition.period * np.arange(len(rows)), **signals}


def log(signals: Signals, content: Content, condition: Condition, peak: np.ndarray,
        rng: np.random.Generator) -> Signals:
    """Return what a logger keeps of an experiment, by the columns of the log.

    Parameters
    ----------
    signals : dict
        As `run` gives them.
    content, condition : Content, Condition
        What is kept, and how.
    peak : ndarray, shape (n,)
        Largest commands [N m].
    rng : numpy.random.Generator
        Of the torque sensor and the logger.

    """
    noise = TORQUE_NOISE * peak * rng.normal(size=signals["torque"].shape)
    measured = _rounded(signals["torque"] + noise, TORQUE_STEP * peak)
    kept = {name: measured if name == content.measured
            else signals["command" if name == "u" else name] for name in ("q", *content.signals)}
    if condition.is_filtered:
        corner = 2.0 * math.pi * rng.uniform(*CORNERS)
        for name in [content.measured] if content.measured else kept:
            kept[name] = _low_pass(kept[name], corner * condition.period)
    if condition.is_coarse:
        for name in kept:
            if name in ("u", "tau"):
                kept[name] = _rounded(kept[name], COARSE * peak)
            elif not content.has_torque:
                kept[name] = _rounded(kept[name], np.full(len(peak), TENTH_OF_DEGREE))
    rows = _rows(len(signals["time"]), condition, rng)
    return {name: signal[rows] for name, signal in {"time": signals["time"], **kept}.items()}


def _rounded(signal: np.ndarray, step: np.ndarray | float) -> np.ndarray:
    rounded: np.ndarray = np.rint(signal / step) * step
    return rounded


def _low_pass(signal: np.ndarray, angle: float) -> np.ndarray:
    """First-order low-pass of the corner times the period, at rest at the first sample."""
    share, filtered, state = 1.0 - math.exp(-angle), np.empty_like(signal), signal[0]
    for k, value in enumerate(signal):
        state = state + share * (value - state)
        filtered[k] = state
    return filtered


def _rows(count: int, condition: Condition, rng: np.random.Generator) -> np.ndarray:
    """Samples of the controller that become rows."""
    if not condition.is_jittered:
        return np.arange(0, count, condition.every)
    taken = np.cumsum(condition.every * rng.choice(TICKS, count))
    taken = np.concatenate([[0], taken[taken < count]])
    kept = rng.random(len(taken)) >= DROPPED
    kept[0] = True
    return taken[kept]
