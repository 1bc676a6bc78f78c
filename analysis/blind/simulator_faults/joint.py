"""A random joint: its model file, its control law, and the motions in which it is logged."""

import dataclasses
import math

import numpy as np

PERIOD = 5e-3  # s, of the control law
SECONDS = 8.0  # of a log
LOGS = 3
GRAVITY = 9.81
_TWO_PI = 2.0 * math.pi


@dataclasses.dataclass(frozen=True)
class Joint:
    """Numbers of one joint with a link that hangs from it.

    Parameters
    ----------
    mass, com, inertia : float
        Of the link: mass [kg], distance from the axis [m], inertia about its own centre [kg m^2].
    armature, damping, friction : float
        Of the joint, behind the gear [kg m^2, N m s/rad, N m].
    gear : float
        Motor turns per joint turn.
    kp, kd : float
        Gains, motor side [N m/rad, N m s/rad].
    limit : float
        Largest torque of the motor [N m].
    delay : int
        Periods between a command and its torque.

    """

    mass: float
    com: float
    inertia: float
    armature: float
    damping: float
    friction: float
    gear: float
    kp: float
    kd: float
    limit: float
    delay: int = 0

    @property
    def whole_inertia(self) -> float:
        """Inertia about the axis [kg m^2]."""
        return self.inertia + self.mass * self.com**2 + self.armature


def draw_joint(rng: np.random.Generator) -> Joint:
    """Draw a joint whose loop is well damped."""
    mass, com = rng.uniform(0.5, 3.0), rng.uniform(0.1, 0.3)
    own = rng.uniform(0.1, 0.4) * mass * com**2
    armature = rng.uniform(0.3, 1.0) * mass * com**2
    whole = own + mass * com**2 + armature
    gear, speed = rng.uniform(3.0, 8.0), _TWO_PI * rng.uniform(1.5, 2.5)
    weight = mass * GRAVITY * com
    kp = whole * speed**2 / gear
    return Joint(mass, com, own, armature, damping=whole / rng.uniform(0.3, 0.8),
                 friction=rng.uniform(0.06, 0.15) * weight, gear=gear, kp=kp,
                 kd=rng.uniform(1.2, 1.6) * whole * speed / gear,
                 limit=rng.uniform(0.9, 1.1) * weight)


def experiments(rng: np.random.Generator, joint: Joint) -> list[tuple[np.ndarray, np.ndarray]]:
    """Set-points [rad] and excitations [N m] of the logs, one row per period."""
    time = PERIOD * np.arange(round(SECONDS / PERIOD))
    weight = joint.mass * GRAVITY * joint.com / joint.gear
    found = []
    for k in range(LOGS):
        moves = _moves(rng, time) if k % 2 else _sines(rng, time, 0.5, (0.15, 0.4))
        tones = np.sort(rng.uniform(0.5, 6.0, 4))
        found.append((moves, _sines(rng, time, 0.35 * weight * (k % 2 == 0), tones)))
    return found


def _sines(rng, time, size, tones):
    phases = rng.uniform(0.0, _TWO_PI, len(tones))
    waves = [np.sin(_TWO_PI * tone * time + phase) for tone, phase in zip(tones, phases)]
    return size * np.sum(waves, axis=0) / math.sqrt(len(tones))


def _moves(rng, time, move=0.5, rest=0.8):
    """Smooth moves between random poses, with rests."""
    reference, last = np.zeros(len(time)), 0.0
    for start in np.arange(0.0, time[-1], move + rest):
        goal = rng.uniform(-0.8, 0.8)
        s = np.clip((time - start - rest) / move, 0.0, 1.0)
        reference += (goal - last) * (10 * s**3 - 15 * s**4 + 6 * s**5)
        last = goal
    return reference
