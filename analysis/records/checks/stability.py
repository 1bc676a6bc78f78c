"""Checks of the stated gains before anything is simulated: stable, and within the theorems."""

import numpy as np

from clie_blocks.analysis.records.checks.finding import Finding
from clie_blocks.analysis.records.control_law import gains
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.rigid_body.dynamics import mass_matrix


def check_gains(record: Record, robot: Robot | None) -> list[Finding]:
    """Findings on gains with which the nominal loop is unstable or K-bar is not positive."""
    nominal = nominal_joints(robot)
    if robot is None or nominal is None or robot.controller.law not in ("pd", "cascade"):
        return []
    kp, kd = gains(robot.controller)
    return [finding for k in range(robot.n)
            for finding in _joint(robot, k, *(x[k] for x in (*nominal, kp, kd)))]


def nominal_joints(robot: Robot | None) -> tuple[np.ndarray, np.ndarray] | None:
    """Nominal A [1/s] and B [1/(kg m^2)] of eq. (9) with the links stretched out, or None.

    The load is ``J r + M_kk / r`` on the motor side, as in (8); without motor data None.
    """
    if robot is None:
        return None
    motor, links = robot.motor, robot.links
    ratio = motor.gear_ratio
    if motor.inertia is None or ratio is None:
        return None
    inertia = motor.inertia * ratio + _stretched(robot) / ratio
    damping = np.zeros(robot.n) if motor.viscous_friction is None else motor.viscous_friction
    joint = links.joint_viscous_friction
    damping = damping * ratio + (0.0 if joint is None else joint / ratio)
    gain = 1.0 if motor.torque_gain is None else motor.torque_gain
    if not (inertia > 0).all():
        return None
    return damping / inertia, gain / inertia


def smallest_kd(a: float, b: float, kp: float) -> float:
    """Smallest Kd with ``K-bar = Kd/Kp (A + B Kd) - 1 > 0``, which Theorems 1 to 4 need."""
    return (np.sqrt(a**2 + 4 * b * kp) - a) / (2 * b)


def slowest_growth(a: float, b: float, kp: float, kd: float, controller: Controller) -> float:
    """Largest real part [1/s] of the poles of the loop of (9), (11) with the filter G1 (47)."""
    if controller.highpass is None or controller.lowpass is None:
        return float(np.roots([1, a + b * kd, b * kp]).real.max())
    lag = np.poly([-controller.highpass, -controller.lowpass])
    loop = np.polyadd(np.polymul([1, a, 0], lag), b * kp * lag)
    return float(np.roots(np.polyadd(loop, [b * kd * lag[-1], 0])).real.max())


def _joint(robot: Robot, k: int, a: float, b: float, kp: float, kd: float) -> list[Finding]:
    name, controller = robot.joints[k], robot.controller
    if slowest_growth(a, b, kp, kd, controller) > 0:
        return [Finding("error", "gains.unstable", f"With Kp = {kp:.4g} and Kd = {kd:.4g} the "
                        "nominal loop is unstable.", "A simulation would diverge; the robot did "
                        "not, so gains or datasheet are wrong.",
                        _stable_kd(a, b, kp, kd, controller), joint=name)]
    if kp > 0 and kd / kp * (a + b * kd) <= 1:
        return [Finding("warning", "gains.k_bar", f"K-bar = Kd/Kp (A + B Kd) - 1 is "
                        f"{kd / kp * (a + b * kd) - 1:.3g}, not positive.",
                        "The proof of the update law (27) does not cover these gains.",
                        f"From Kd = {smallest_kd(a, b, kp):.4g} on it does; the least-squares "
                        "estimates do not need it.", joint=name)]
    return []


def _stable_kd(a: float, b: float, kp: float, kd: float, controller: Controller) -> str:
    trial = np.geomspace(1e-3, 1e3, 601) * max(abs(kd), 1e-9)
    good = [d for d in trial if slowest_growth(a, b, kp, d, controller) < 0]
    if not good:
        return "No Kd makes it stable with this filter; lower Kp."
    return f"It is stable from Kd = {min(good):.4g} to Kd = {max(good):.4g}."


def _stretched(robot: Robot) -> np.ndarray:
    """Inertia of all links beyond each joint, the arm stretched out [kg m^2].

    Of a model, it is that at its zero.
    """
    links, n = robot.links, robot.n
    if robot.tree is not None:
        coupling = np.eye(n) if robot.motor.coupling is None else robot.motor.coupling
        return (coupling.T @ mass_matrix(robot.tree, np.zeros(n)) @ coupling).diagonal()
    if links.mass is None or links.com is None:
        return np.zeros(n)
    length = np.zeros(n) if links.length is None else links.length
    own = np.zeros(n) if links.inertia is None else links.inertia
    total = np.zeros(n)
    for k in range(n):
        reach = np.concatenate(([0.0], np.cumsum(length[k:-1])))
        total[k] = np.sum(own[k:] + links.mass[k:] * (reach + links.com[k:]) ** 2)
    return total
