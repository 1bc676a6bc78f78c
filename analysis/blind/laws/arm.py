"""Planar arms of one or two joints: their numbers, their dynamics by hand, and their MJCF."""

import dataclasses
import math

import numpy as np

from clie_blocks.analysis.blind.engine.bodies import SOLID
from clie_blocks.analysis.blind.engine.parameters import G

PERIOD, SUBSTEPS = 2e-3, 4  # s, steps of the engine per period
HOLDS = 'solreffriction="0.002 1" solimpfriction="0.9999 0.9999 0.001"'
LOOSE, SOFT = "backlash", "joint_elasticity"
_MASSLESS = '<inertial pos="0 0 0" mass="1e-5" diaginertia="1e-6 1e-6 1e-6"/>'


@dataclasses.dataclass(frozen=True, eq=False)
class Arm:
    """Numbers of an arm in a vertical plane, horizontal at zero.

    Parameters
    ----------
    mass, length : ndarray, shape (n,)
        Of the links, uniform rods [kg, m].
    armature, damping : ndarray, shape (n,)
        Of rotors and joints, behind the gears [kg m^2, N m s/rad].
    gear : ndarray, shape (n,)
        Motor turns per joint turn.
    has_gravity : bool
        Whether the arm has a weight.

    """

    mass: np.ndarray
    length: np.ndarray
    armature: np.ndarray
    damping: np.ndarray
    gear: np.ndarray
    has_gravity: bool = False

    @property
    def n(self) -> int:
        """Joints."""
        return len(self.mass)

    @property
    def com(self) -> np.ndarray:
        """Distances of the centres of mass from their joints [m]."""
        return 0.5 * self.length

    @property
    def spin(self) -> np.ndarray:
        """Inertias of the links about their centres [kg m^2]."""
        return self.mass * self.length**2 / 12.0

    def terms(self, q: np.ndarray, dq: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mass matrix with rotors, and torques of velocity, damping and weight, joint side."""
        g = G if self.has_gravity else 0.0
        own = self.spin + self.mass * self.com**2
        last = self.mass[-1] * g * self.com[-1] * np.cos(q.sum())
        if self.n == 1:
            return np.diag(self.armature + own), self.damping * dq + last
        carried = self.mass[1] * self.length[0] * self.com[1]
        c2, s2 = carried * math.cos(q[1]), carried * math.sin(q[1])
        first = own.sum() + self.mass[1] * self.length[0]**2 + 2.0 * c2
        inertia = np.array([[first, own[1] + c2], [own[1] + c2, own[1]]]) + np.diag(self.armature)
        weight = (self.mass[0] * self.com[0] + self.mass[1] * self.length[0]) * g * np.cos(q[0])
        turning = np.array([-s2 * (2.0 * dq[0] * dq[1] + dq[1]**2), s2 * dq[0]**2])
        return inertia, turning + self.damping * dq + np.array([weight + last, last])

    @property
    def inertia(self) -> np.ndarray:
        """Inertia that each joint moves alone at zero, joint side [kg m^2]."""
        return np.diag(self.terms(np.zeros(self.n), np.zeros(self.n))[0])


def draw_arm(rng: np.random.Generator, n: int, has_gravity: bool) -> Arm:
    """Draw an arm whose rotors and links share the inertia about alike."""
    mass = rng.uniform(0.4, 1.2, n) * 0.7 ** np.arange(n)
    length = rng.uniform(0.2, 0.35, n)
    bare = Arm(mass, length, np.zeros(n), np.zeros(n), np.ones(n))
    armature = rng.uniform(0.6, 1.5, n) * bare.inertia
    gear = np.ones(n) if rng.random() < 0.5 else rng.uniform(5.0, 60.0, n)
    damping = (bare.inertia + armature) / rng.uniform(0.4, 1.0, n)
    return Arm(mass, length, armature, damping, gear, has_gravity)


def model_text(arm: Arm, effect: str = "", joint: int = 0, size: float = 0.0) -> str:
    """MJCF of an arm, with dry friction, a loose or a soft gear at a joint [N m, rad, N m/rad]."""
    text, closing = "", ""
    for k in range(arm.n):
        here = effect if k == joint else ""
        friction = f'frictionloss="{size}" {HOLDS}' if here == "coulomb" else ""
        place = f"{arm.length[k - 1] if k else 0.0} 0 0"
        text += (f'<body pos="{place}"><joint name="motor{k}" axis="0 -1 0" '
                 f'armature="{arm.armature[k]}" damping="{arm.damping[k]}" {friction}/>')
        closing += "</body>"
        if here in (LOOSE, SOFT):
            spring = f'stiffness="{size}" damping="{5e-4 * size}"'
            stops = f'limited="true" range="{-size / 2.0} {size / 2.0}" {SOLID}'
            joint_text = stops if here == LOOSE else spring
            text += (f'{_MASSLESS}<body pos="0 0 0"><joint name="twist" axis="0 -1 0" '
                     f'{joint_text}/>')
            closing += "</body>"
        text += (f'<inertial pos="{arm.com[k]} 0 0" mass="{arm.mass[k]}" diaginertia='
                 f'"1e-6 {arm.spin[k]} {arm.spin[k]}"/>')
    motors = "".join(f'<motor joint="motor{k}" gear="{arm.gear[k]}"/>' for k in range(arm.n))
    return (f'<mujoco><compiler angle="radian" balanceinertia="true"/><option '
            f'timestep="{PERIOD / SUBSTEPS}" gravity="0 0 {-G if arm.has_gravity else 0.0}" '
            f'integrator="RK4"/><worldbody>{text}{closing}</worldbody><actuator>{motors}'
            "</actuator></mujoco>")
