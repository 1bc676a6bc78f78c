"""Presliding friction: a contact that bends before it slides, and truly sticks."""

import numpy as np

from clie_blocks.effects.blocks import Dynamic
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.effects.stribeck import VELOCITY
from clie_blocks.labels import PerJoint

_UNBOUNDED = 1e12  # 1/s: a contact that follows at any speed


def stribeck_ratio(dq: np.ndarray, static_ratio: PerJoint, velocity: PerJoint) -> np.ndarray:
    """Friction level at a speed over the Coulomb level: `static_ratio` at rest, 1 when fast."""
    return 1.0 + (static_ratio - 1.0) * np.exp(-np.abs(dq / velocity) ** 2)


def contact_speed(dq: np.ndarray, reach: PerJoint, fastest: PerJoint) -> np.ndarray:
    """Speed at which the contact follows [rad/s]: dq, up to ``reach fastest``.

    Without the bound the state would be as fast as ``dq / reach`` and need tiny steps.
    """
    return np.clip(dq, -reach * fastest, reach * fastest)


def returned_share(z: np.ndarray, dq: np.ndarray, reach: PerJoint,
                   fastest: PerJoint) -> np.ndarray:
    """Share of the torque of a contact that unbends [1]: it returns no more than it stored."""
    limit = reach * fastest
    return np.where(z * dq < 0, limit / np.maximum(np.abs(dq), limit), 1.0)


def bristle_rate(z: np.ndarray, dq: np.ndarray, static_ratio: PerJoint, velocity: PerJoint,
                 reach: PerJoint, elastic: PerJoint, fastest: PerJoint) -> np.ndarray:
    """Rate of the bending z [rad/s]: ``dq - |dq| z / z_slip`` once the contact yields.

    It yields from the share `elastic` of the slipping deflection z_slip on, while it is being
    loaded further.  With `elastic` zero it always yields, which is LuGre.
    """
    z_slip = reach * stribeck_ratio(dq, static_ratio, velocity)
    loading = np.where(z * dq > 0, np.abs(z), -1.0)
    yields = np.where(elastic > 0, np.where(loading >= elastic * z_slip, 1.0, 0.0), 1.0)
    speed = contact_speed(dq, reach, fastest)
    return speed - yields * np.abs(speed) * z / z_slip


def presliding_torque(z: np.ndarray, dq: np.ndarray, level: PerJoint, static_ratio: PerJoint,
                      velocity: PerJoint, reach: PerJoint, elastic: PerJoint,
                      bristle_damping: PerJoint, fastest: PerJoint) -> np.ndarray:
    """Friction torque ``(level / reach) z + bristle_damping exp(-(dq/velocity)^2) z'`` [N m]."""
    fading = bristle_damping * np.exp(-(dq / velocity) ** 2)
    rate = bristle_rate(z, dq, static_ratio, velocity, reach, elastic, fastest)
    return level / reach * z * returned_share(z, dq, reach, fastest) + fading * rate


def bristle_step(z: np.ndarray, dq: np.ndarray, static_ratio: PerJoint, velocity: PerJoint,
                 reach: PerJoint, elastic: PerJoint, period: float) -> np.ndarray:
    """Bending after a period at one velocity [rad]: exact, so that no bound on it is needed."""
    z_slip = reach * stribeck_ratio(dq, static_ratio, velocity)
    end = np.sign(dq) * z_slip
    slipped = end + (z - end) * np.exp(-np.abs(dq) * period / z_slip)
    bent = z + dq * period
    loading = np.where(z * dq > 0, np.abs(z), -1.0)
    sticks = np.where(elastic > 0, np.where(loading < elastic * z_slip, 1.0, 0.0), 0.0)
    return np.where(sticks > 0, np.clip(bent, -z_slip, z_slip), slipped)


def sampled_presliding_torque(z: np.ndarray, dq: np.ndarray, level: PerJoint,
                              static_ratio: PerJoint, velocity: PerJoint, reach: PerJoint,
                              elastic: PerJoint, bristle_damping: PerJoint) -> np.ndarray:
    """Friction torque of a contact whose bending takes exact steps [N m]."""
    fading = bristle_damping * np.exp(-(dq / velocity) ** 2)
    rate = bristle_rate(z, dq, static_ratio, velocity, reach, elastic, _UNBOUNDED)
    return level / reach * z + fading * rate


def dahl_rate(z: np.ndarray, dq: np.ndarray, reach: PerJoint, exponent: PerJoint,
              fastest: PerJoint) -> np.ndarray:
    """Rate of the bending z [rad/s]: ``dq (1 - sgn(dq) z / reach)^exponent``."""
    margin = 1.0 - np.sign(dq) * z / reach
    return contact_speed(dq, reach, fastest) * np.sign(margin) * np.abs(margin) ** exponent


def dahl_step(z: np.ndarray, dq: np.ndarray, reach: PerJoint, exponent: PerJoint,
              period: float) -> np.ndarray:
    """Bending after a period at one velocity [rad]: the margin ``1 - sgn(dq) z/reach``, exact."""
    margin = np.maximum(1.0 - np.sign(dq) * z / reach, 0.0)
    bent, power = np.abs(dq) * period / reach, exponent - 1.0
    curved = np.where(np.abs(power) > 1e-6, power, 1.0)
    base = np.maximum(margin, 1e-12) ** -curved + curved * bent
    left = np.where(np.abs(power) > 1e-6,
                    np.where(base > 0, np.maximum(base, 1e-300) ** (-1.0 / curved), 0.0),
                    margin * np.exp(-bent))
    return np.where(dq == 0.0, z, np.sign(dq) * reach * (1.0 - left))


def sampled_dahl_torque(z: np.ndarray, dq: np.ndarray, level: PerJoint,
                        reach: PerJoint) -> np.ndarray:
    """Friction torque of a contact whose bending takes exact steps [N m]."""
    return level / reach * z


def dahl_torque(z: np.ndarray, dq: np.ndarray, level: PerJoint, reach: PerJoint,
                fastest: PerJoint) -> np.ndarray:
    """Friction torque of a bent contact [N m]: a spring of stiffness level / reach."""
    return level / reach * z * returned_share(z, dq, reach, fastest)


_LEVEL = Parameter("level", "N m", 0.0, 100.0, 0.05, 0.0, "friction torque of a sliding joint")
_REACH = Parameter("reach", "rad", 1e-6, 0.5, 2e-3, None,
                   "bending of the contact that slides; level/reach is its stiffness")
_FASTEST = Parameter("fastest", "1/s", 1.0, 1e6, 1000.0, None,
                     "bound on the rate of the contact, for the step: below 2/step", of="run")
_CONFUSED = {
    "coulomb": "amplitude ladder below the reach: presliding is elastic there",
    "backlash": "amplitude ladder: backlash has a dead band, presliding a soft spring",
    "joint_elasticity": "amplitude ladder: the stiffness of friction falls with amplitude",
    "torsional_hysteresis": "encoder on the link: friction does not twist the gear",
    "stribeck": "small reversals: presliding rounds the step, Stribeck does not",
}

PRESLIDING = Effect(
    name="presliding", family="friction", port="load",
    build=Dynamic(bristle_rate, presliding_torque, inputs=("dq",)),
    parameters=(
        _LEVEL, _REACH,
        Parameter("static_ratio", "1", 1.0, 5.0, 1.5, None, "break-away over Coulomb torque"),
        VELOCITY,
        Parameter("elastic", "1", 0.0, 0.99, 0.0, None,
                  "share of the break-away bending that is purely elastic; 0 is LuGre"),
        Parameter("bristle_damping", "N m s/rad", 0.0, 1e4, 0.25, 0.0,
                  "damping of the contact while it bends"),
        _FASTEST,
    ),
    equation="z' = dq - y |dq| z/z_slip, tau = (level/reach) z + bristle_damping "
             "exp(-(dq/velocity)^2) z', z_slip = reach (1 + (static_ratio - 1) "
             "exp(-(dq/velocity)^2)), y = 1 where the contact yields",
    reference="C. Canudas de Wit, H. Olsson, K. J. Astrom, P. Lischinsky, IEEE Trans. Automatic "
              "Control 40(3), 1995; P. Dupont, V. Hayward, B. Armstrong, F. Altpeter, IEEE "
              "Trans. Automatic Control 47(5), 2002",
    signature="After each reversal a soft spring of a few mrad instead of a step; small motions "
              "make narrow loops of torque over position.",
    confused_with=_CONFUSED,
    simulators={
        "mujoco": "actuator dcmotor lugre (sigma0, sigma1, Coulomb, static, Stribeck velocity)",
        "isaac": "none",
        "gazebo": "none",
        "simscape": "none",
    },
    wrong="With elastic = 0 (LuGre) a stuck joint drifts under a vibrating load below break-away; "
          "elastic > 0 stops that. Above the speed reach fastest it bends as if it were slower. "
          "Small loops inside large ones do not close: maxwell_slip.",
    passive=True, symmetry="odd", stiff=True, curve=("q", 5e-3),
    sampled=Dynamic(bristle_step, sampled_presliding_torque, inputs=("dq",)),
)

DAHL = Effect(
    name="dahl", family="friction", port="load",
    build=Dynamic(dahl_rate, dahl_torque, inputs=("dq",)),
    parameters=(
        _LEVEL, _REACH,
        Parameter("exponent", "1", 0.5, 4.0, 1.0, None, "how sharply the contact yields"),
        _FASTEST,
    ),
    equation="z' = dq |1 - sgn(dq) z/reach|^exponent, tau = (level/reach) z",
    reference="P. R. Dahl, A Solid Friction Model, Aerospace Corporation TOR-0158(3107-18)-1, "
              "1968",
    signature="As presliding, without a break-away peak and without damping at rest.",
    confused_with={"presliding": "slow ramp from rest: Dahl has no break-away peak", **_CONFUSED},
    simulators={
        "mujoco": "actuator dcmotor lugre with static = Coulomb and sigma1 = 0",
        "isaac": "none",
        "gazebo": "none",
        "simscape": "none",
    },
    wrong="No break-away peak; a stuck joint rings on its contact, undamped but for the plant, "
          "and drifts under a vibrating load.",
    passive=True, symmetry="odd", stiff=True, curve=("q", 5e-3),
    sampled=Dynamic(dahl_step, sampled_dahl_torque, inputs=("dq",)),
)
