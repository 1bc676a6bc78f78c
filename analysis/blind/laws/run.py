"""An arm under a law in MuJoCo: the log of an experiment."""

import dataclasses
from collections import deque
from collections.abc import Callable

import numpy as np

from clie_blocks.analysis.blind.laws.arm import PERIOD, SUBSTEPS, Arm, model_text
from clie_blocks.analysis.blind.laws.control_laws import Law, Signals
from clie_blocks.errors import MissingExtraError

NOISE = 2e-5  # rad, of the encoders
SPEED_LIMIT = 1e3  # rad/s, beyond which a loop is unstable
DRAG, DELAY = "quadratic_drag", "time_delay"


@dataclasses.dataclass(frozen=True)
class Effect:
    """What an arm has beyond its model.

    Parameters
    ----------
    name : str
        Empty for none.
    joint : int
        Where it is, from 0.
    size : float
        Level [N m], lost motion [rad], stiffness [N m/rad], drag [N m s^2/rad^2], joint side, or
        a delay in periods.

    """

    name: str = ""
    joint: int = 0
    size: float = 0.0


SOUND = Effect()
Motion = Callable[[float], tuple[np.ndarray, np.ndarray, np.ndarray]]  # of a time, as `Reference`


class Reference:
    """A few tones per joint from rest, with their derivatives.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of chance.
    n : int
        Joints.
    fastest : float
        Highest frequency [Hz].

    """

    def __init__(self, rng: np.random.Generator, n: int, fastest: float) -> None:
        self.w = 2.0 * np.pi * rng.uniform(0.15, fastest, (n, 5))
        self.a = 0.9 / (1.0 + self.w)
        self.a[:, -1] = -(self.a * self.w)[:, :-1].sum(axis=1) / self.w[:, -1]  # from rest

    def __call__(self, t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Position, velocity and acceleration at a time [s], each of shape (n,)."""
        sine, cosine = np.sin(self.w * t), np.cos(self.w * t)
        each = self.a * sine, self.a * self.w * cosine, -self.a * self.w**2 * sine
        q_d, dq_d, ddq_d = (tones.sum(axis=1) for tones in each)
        return q_d, dq_d, ddq_d


class Machine:
    """An arm with an effect in MuJoCo, at rest at zero.

    Parameters
    ----------
    arm : Arm
        The robot.
    effect : Effect
        What it has beyond its model.
    period : float
        Of the commands [s].

    """

    def __init__(self, arm: Arm, effect: Effect, period: float = PERIOD) -> None:
        try:
            import mujoco
        except ImportError:
            raise MissingExtraError("a robot of the study", "mujoco", "mujoco") from None
        self._advance = mujoco.mj_step
        self._model = mujoco.MjModel.from_xml_string(
            model_text(arm, effect.name, effect.joint, effect.size))
        self._model.opt.timestep = period / SUBSTEPS
        self._data, self._effect = mujoco.MjData(self._model), effect
        names = [self._model.joint(j).name for j in range(self._model.njnt)]
        self._motors = np.array([names.index(f"motor{k}") for k in range(arm.n)])
        self._twist = names.index("twist") if "twist" in names else None
        late = round(effect.size) if effect.name == DELAY else 0
        self._sent = deque([np.zeros(arm.n)] * (late + 1), late + 1)

    @property
    def q_motor(self) -> np.ndarray:
        """Positions of the motors over their gear ratios, shape (n,) [rad]."""
        q: np.ndarray = self._data.qpos[self._motors]
        return q

    @property
    def q(self) -> np.ndarray:
        """Positions of the links, shape (n,) [rad]."""
        q = self.q_motor
        if self._twist is not None:
            q[self._effect.joint] += self._data.qpos[self._twist]
        return q

    @property
    def is_stable(self) -> bool:
        """Whether all joints are slower than those of an unstable loop."""
        return bool(np.abs(self._data.qvel).max() < SPEED_LIMIT)

    def step(self, u: np.ndarray) -> np.ndarray:
        """Send commands for a period; return the torques of the motors, shape (n,) [N m]."""
        self._sent.append(u)
        delivered = np.where(np.arange(len(u)) == self._effect.joint, self._sent[0], u)
        self._data.ctrl[:] = delivered
        for _ in range(SUBSTEPS):
            if self._effect.name == DRAG:
                joint = self._motors[self._effect.joint]
                speed = self._data.qvel[joint]
                self._data.qfrc_applied[joint] = -self._effect.size * speed * abs(speed)
            self._advance(self._model, self._data)
        return delivered


def run(arm: Arm, law: Law, reference: Reference, rng: np.random.Generator, seconds: float,
        step: float, effect: Effect = SOUND) -> np.ndarray:
    """Log of an experiment: time, q, u, qd, one row per period; shorter where it is unstable.

    Parameters
    ----------
    arm : Arm
        The robot.
    law : callable
        At its start.
    reference : Reference
        The motion.
    rng : numpy.random.Generator
        Of the encoders.
    seconds : float
        Length.
    step : float
        To which commands are rounded [N m].
    effect : Effect
        What it has beyond its model.

    """
    machine = Machine(arm, effect)
    last, rows = np.zeros(arm.n), []
    for k in range(round(seconds / PERIOD)):
        q = np.round(machine.q + NOISE * rng.normal(size=arm.n), 7)
        q_d, dq_d, ddq_d = reference(k * PERIOD)
        q_d = np.round(q_d, 9)
        now = Signals(q_d, dq_d, ddq_d, q, (q - (last if k else q)) / PERIOD)
        u = np.rint(law(now) / step) * step
        last = q
        rows.append(np.concatenate([[k * PERIOD], q, u, q_d]))
        machine.step(u)
        if not machine.is_stable:
            break
    return np.array(rows)
