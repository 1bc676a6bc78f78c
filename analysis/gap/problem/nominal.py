"""The nominal joint model (8) as the robot file states it, with what its datasheet allows."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.problem.inverse_dynamics import inverse_dynamics_model
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.records import Robot
from clie_blocks.robot_loop.links import Links

UNKNOWN_TOLERANCE = 10.0  # relative, of a parameter that is not stated: it may be anything
# Of the RMS command of the joint that works hardest: a joint at rest has an offset, too.
_LEAST_TORQUE = 1e-3


@dataclasses.dataclass(frozen=True, eq=False)
class Nominal:
    """Joint model of eq. (8) as stated, per joint, with what the datasheet allows.

    Parameters
    ----------
    inertia, damping, load : ndarray, shape (n,)
        Coefficients of eq. (8) [kg m^2, N m s/rad, N m].
    inertia_tolerance, damping_tolerance, load_tolerance : ndarray, shape (n,)
        Largest deviations [same units].
    mass_tolerance : float
        Largest relative deviation of the mass of a link; 0 where none is stated.
    com_tolerance : float
        Largest deviation of each coordinate of a centre of mass [m]; 0 where none is stated.
    torque_tolerance : float
        Largest relative deviation of the torque per command; 0 where that is known, or where only
        masses could tell it, which then move as far.

    """

    inertia: np.ndarray
    damping: np.ndarray
    load: np.ndarray
    inertia_tolerance: np.ndarray
    damping_tolerance: np.ndarray
    load_tolerance: np.ndarray
    mass_tolerance: float = 0.0
    com_tolerance: float = 0.0
    torque_tolerance: float = 0.0


def stated_or(value: np.ndarray | None, n: int, default: float) -> np.ndarray:
    """Return what the robot file states, or a default for each joint, shape (n,)."""
    return np.full(n, float(default)) if value is None else np.array(value, float)


def nominal_model(robot: Robot, links: Links, ratio: np.ndarray, logs: Sequence[Log],
                  period: float) -> Nominal:
    """Return the stated joint model; without a datasheet, the one that fits the logs."""
    motor, n = robot.motor, robot.n
    of_torque = motor.torque_constant_tolerance or 0.0
    has_scale = links.has_coupling or links.has_gravity
    torque_tolerance, of_masses = (of_torque, 0.0) if has_scale else (0.0, of_torque)
    of_links = {"mass_tolerance": float(np.hypot(robot.links.mass_tolerance or 0.0, of_masses)),
                "com_tolerance": robot.links.com_tolerance or 0.0,
                "torque_tolerance": torque_tolerance}
    if motor.inertia is None:
        inertia, damping, load = inverse_dynamics_model(logs, period, links, ratio)
        return Nominal(inertia, damping, load, UNKNOWN_TOLERANCE * inertia,
                       UNKNOWN_TOLERANCE * (damping + inertia),
                       UNKNOWN_TOLERANCE * (np.abs(load) + inertia), **of_links)
    rotor = ratio * stated_or(motor.inertia, n, 0.0)
    inertia = rotor + links.diagonal / ratio
    drag = ratio * stated_or(motor.viscous_friction, n, 0.0)
    damping = drag + links.bearing_damping / ratio
    tolerance = _stated_tolerance(motor.inertia_tolerance)
    drag_tolerance = _stated_tolerance(motor.viscous_friction_tolerance)
    return Nominal(
        inertia=inertia, damping=damping, load=np.zeros(n),
        inertia_tolerance=np.hypot(np.maximum(tolerance * rotor, 0.002 * inertia),
                                   of_masses * inertia),
        damping_tolerance=np.hypot(drag_tolerance * drag, np.hypot(0.02, of_masses) * damping),
        load_tolerance=_load_tolerance(motor.torque_offset_tolerance, logs), **of_links)


def _load_tolerance(stated: np.ndarray | None, logs: Sequence[Log]) -> np.ndarray:
    """Largest offset of each drive; one that is not stated is measured by the commands [N m].

    No torque is large or small in itself: motor side it is the gear ratio times smaller.
    """
    if stated is not None:
        return np.array(stated, float)
    typical = np.sqrt(np.mean(np.concatenate([log.u for log in logs]) ** 2, axis=0))
    return UNKNOWN_TOLERANCE * np.maximum(typical, _LEAST_TORQUE * typical.max() + 1e-12)


def _stated_tolerance(tolerance: np.ndarray | float | None) -> np.ndarray | float:
    return UNKNOWN_TOLERANCE if tolerance is None else tolerance
