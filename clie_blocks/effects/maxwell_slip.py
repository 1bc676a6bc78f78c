"""Maxwell-slip friction: springs in parallel that slip one after the other."""

import numpy as np

from clie_blocks.effects.blocks import Dynamic
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint

ELEMENTS = 5


def slip_limits(reach: np.ndarray) -> np.ndarray:
    """Bending at which each element slips [rad], shape (ELEMENTS, n), evenly up to `reach`."""
    return np.arange(1, ELEMENTS + 1)[:, None] / ELEMENTS * reach


def slip_rate(z: np.ndarray, dq: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Rate of each element's bending [rad/s]: dq while it sticks, 0 while it slips."""
    pushed = np.where(z * dq > 0, np.abs(z), 0.0)
    return np.where(pushed >= slip_limits(reach), 0.0, dq)


def slip_step(z: np.ndarray, dq: np.ndarray, reach: np.ndarray, period: float) -> np.ndarray:
    """Bending of the elements after a period at one velocity [rad], exact."""
    limits = slip_limits(reach)
    return np.clip(z + dq * period, -limits, limits)


def maxwell_slip_torque(z: np.ndarray, dq: np.ndarray, level: PerJoint,
                        reach: np.ndarray) -> np.ndarray:
    """Friction torque [N m]: each element holds up to its share of `level`."""
    share = np.clip(z / slip_limits(reach), -1.0, 1.0)
    return level * (np.ones(ELEMENTS) @ share / ELEMENTS)


MAXWELL_SLIP = Effect(
    name="maxwell_slip", family="friction", port="load",
    build=Dynamic(slip_rate, maxwell_slip_torque, inputs=("dq",), size=ELEMENTS),
    parameters=(
        Parameter("level", "N m", 0.0, 100.0, 0.05, 0.0, "friction torque of a sliding joint"),
        Parameter("reach", "rad", 1e-6, 0.5, 5e-3, None, "motion after which all elements slip"),
    ),
    equation="z_i' = 0 if |z_i| >= reach i/5 and z_i dq > 0 else dq, "
             "tau = level/5 sum_i clip(5 z_i/(reach i), -1, 1)",
    reference="F. Al-Bender, V. Lampaert, J. Swevers, The Generalized Maxwell-Slip Model, IEEE "
              "Trans. Automatic Control 50(11), 2005 (without its lag in slip)",
    signature="As presliding; small loops of torque over position inside large ones close.",
    confused_with={
        "presliding": "nested partial reversals: only here the inner loops close",
        "torsional_hysteresis": "encoder on the link: friction does not twist the gear",
        "backlash": "amplitude ladder: a gap has a dead band, this a soft spring",
    },
    simulators={"mujoco": "none", "isaac": "none", "gazebo": "none",
                "simscape": "none"},
    wrong="Slip level is the same at all speeds (no Stribeck effect), five elements stand for a "
          "smooth curve, and a stuck joint has no damping of its own.",
    passive=True, symmetry="odd", stiff=True, curve=("q", 5e-3),
    sampled=Dynamic(slip_step, maxwell_slip_torque, inputs=("dq",), size=ELEMENTS),
)
