"""A robot with its uncertainty, gains, excitation and set-point: what a report analyses."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks import paper
from clie_blocks.analysis.records.control_law import gains
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.stability_report.worst_case import ParameterBox
from clie_blocks.analysis.theory.averaging import balanced_shape
from clie_blocks.analysis.theory.bounds import ControlledJoints
from clie_blocks.analysis.theory.convergence import PeriodicLoop
from clie_blocks.effects import LIBRARY, with_effects
from clie_blocks.errors import RecordError
from clie_blocks.excitation import paper_excitation
from clie_blocks.joints import decoupled_joints, motor_side, normalised
from clie_blocks.manipulator import gravity, mass_matrix, two_link_arm
from clie_blocks.signals import DiagramError, vector

BALANCED = ("Gamma is diagonal and scaled to this robot's signals, so that all estimates converge "
            "alike: by averaging at a rate of gain/400 per second, as the paper's robot does.")
FROM_SIMULATION = ("The bounds on the modelling error are those of the simulation, after the "
                   "first 5 s.")
PAPER_KP = 10.0  # N m/rad, for which the amplitude of (48) was chosen


@dataclass(frozen=True)
class Study:
    """A robot under PD control, ready to be analysed.

    Parameters
    ----------
    name : str
        What the robot is.
    plant : control.NonlinearIOSystem
        The plant that is simulated.
    joints : ControlledJoints
        The decoupled joints (9) that stand for it at the set-point, and the gains.
    box : ParameterBox
        Where the parameters lie over all poses and tolerances.
    q_d : ndarray, shape (n,)
        Set-point [rad].
    scale : ndarray, shape (n,)
        Factor on the excitation (48).
    gamma, alpha : float
        Gains of the update law (40).
    shape : ndarray, shape (3n,)
        Diagonal of Gamma for a gain of one.
    eta_norm : float, optional
        Stated bound on ||B PE - D|| [rad/s^2]; by default it is computed.
    eps_bar : tuple of float, optional
        Bounds on the modelling error for Theorems 2 and 4 [rad/s^2]; by default what the
        simulation shows.
    time : float
        Wanted time [s] in which the estimates come within 1 %.
    remarks : tuple of str
        Assumptions.
    is_paper : bool
        Whether this is the paper's robot, so that printed values can be compared.

    """

    name: str
    plant: ct.NonlinearIOSystem
    joints: ControlledJoints
    box: ParameterBox
    q_d: np.ndarray
    scale: np.ndarray
    gamma: float = paper.GAMMA
    alpha: float = paper.ALPHA[2]
    shape: np.ndarray | float = 1.0
    eta_norm: float | None = None
    eps_bar: tuple[float, float] | None = None
    time: float = 100.0
    remarks: tuple[str, ...] = ()
    is_paper: bool = False

    @property
    def pe(self) -> Callable[[float], np.ndarray]:
        """Excitation [N m] as a function of time, period 2 s."""
        scale = self.scale
        return lambda t: scale * paper_excitation(t)

    @property
    def gamma_diagonal(self) -> np.ndarray:
        """Diagonal of Gamma, shape (3n,)."""
        return self.gamma * self.shape * np.ones(3 * self.joints.n)

    @property
    def loop(self) -> PeriodicLoop:
        """The periodic identification loop around the true parameters."""
        return PeriodicLoop(self.joints, self.pe, q_d=self.q_d, shape=self.shape)

    def with_gains(self, kp: ArrayLike | None = None, kd: ArrayLike | None = None) -> Self:
        """Return the study with other PD gains, one number or one per joint."""
        n, old = self.joints.n, self.joints
        kp = old.kp if kp is None else vector(kp, "--kp", n=n, unit="N m/rad", above=0)
        kd = old.kd if kd is None else vector(kd, "--kd", n=n, unit="N m s/rad", above=0)
        return replace(self, joints=ControlledJoints(old.a, old.b, old.d, kp, kd))

    def balanced(self) -> Self:
        """Return the study with a diagonal Gamma that lets all estimates converge alike."""
        return replace(self, shape=balanced_shape(self.loop), remarks=(*self.remarks, BALANCED))

    def with_theta(self, theta: ArrayLike) -> Self:
        """Return the study with other parameters ``[a, b, d]``, such as estimates."""
        old = self.joints
        if np.size(theta) == 1:
            raise DiagramError(f"--theta needs {3 * old.n} numbers: a, b and d of {old.n} joints")
        theta = vector(theta, "--theta", n=3 * old.n)
        box = ParameterBox(np.minimum(self.box.lower, theta), np.maximum(self.box.upper, theta))
        return replace(self, joints=ControlledJoints.from_theta(theta, old.kp, old.kd), box=box)


def paper_study() -> Study:
    """Return the paper's robot: Table 2 for A, B, D, its gains, the coupled arm to simulate."""
    arm = _Arm(paper.MASS, paper.LENGTH, paper.LENGTH, np.zeros(2), np.zeros(2), 9.81)
    drives = _Drives(paper.GEAR_RATIO, paper.J_MOTOR, paper.B_MOTOR, np.ones(2))
    box = _box(arm, drives)
    box = ParameterBox(np.minimum(box.lower, paper.THETA), np.maximum(box.upper, paper.THETA))
    return Study(
        "the paper's two-link arm", paper.paper_arm(),
        ControlledJoints.from_theta(paper.THETA, paper.KP, paper.KD), box,
        np.array(paper.SET_POINT), np.ones(2), eta_norm=paper.ETA_NORM,
        eps_bar=(paper.EPS_NORM[1], paper.EPS_NORM[2]),
        remarks=("A, B, D are the approximate real values of Table 2; the simulated plant is the "
                 "coupled arm, and the box covers all its poses.",
                 "The bounds on eta and on the modelling error are the paper's; what follows from "
                 "Table 2 and from the simulation is reported, too."),
        is_paper=True)


def robot_study(robot: Robot, kp: ArrayLike | None = None, kd: ArrayLike | None = None) -> Study:
    """Study of a robot as its file states it.

    Parameters
    ----------
    robot : Robot
        See `clie_blocks.analysis.records`.
    kp, kd : array_like, optional
        Gains instead of those in the file.

    Returns
    -------
    Study
        With the datasheet's tolerances and all poses in its box.

    Raises
    ------
    RecordError
        If the motor data or gains that the analysis needs are missing.

    """
    remarks: list[str] = []
    drives, arm = _drives(robot), _arm(robot, remarks)
    kp, kd = _gains(robot, kp, kd)
    q_d, scale = _experiment(robot, robot.n, kp, remarks)
    theta, motor = _theta(arm, drives, q_d), robot.motor
    offset = motor.torque_offset_tolerance
    box = _box(arm, drives, motor.inertia_tolerance or 0.0,
               motor.viscous_friction_tolerance or 0.0, 0.0 if offset is None else offset)
    return Study(robot.name or robot.source, _plant(arm, drives, theta),
                 ControlledJoints.from_theta(theta, kp, kd), box, q_d, scale,
                 remarks=(*remarks, FROM_SIMULATION)).balanced()


@dataclass(frozen=True)
class _Drives:
    gear_ratio: np.ndarray
    inertia: np.ndarray
    friction: np.ndarray
    torque_gain: np.ndarray


@dataclass(frozen=True)
class _Arm:
    mass: np.ndarray
    length: np.ndarray
    com: np.ndarray
    inertia: np.ndarray
    h: np.ndarray
    g: float

    def diagonal(self, q: np.ndarray) -> np.ndarray:
        """Diagonal of the mass matrix [kg m^2] at a pose."""
        if self.mass.size == 2:
            return np.diag(mass_matrix(q, self.mass, self.length, self.com, self.inertia))
        return self.mass * self.com**2 + self.inertia

    def weight(self, q: np.ndarray) -> np.ndarray:
        """Gravity torque of the links [N m] at a pose."""
        if self.mass.size == 2:
            return gravity(q, self.mass, self.length, self.com, self.g)
        return self.mass * self.com * self.g * np.cos(q)


def _drives(robot: Robot) -> _Drives:
    motor = robot.motor

    def stated(key: str, value: np.ndarray | None) -> np.ndarray:
        if value is None:
            raise RecordError(f"{robot.source}: [motor] {key} is missing; without it A and B of "
                              "eq. (9) are unknown and no bound can be given")
        return value

    return _Drives(stated("gear_ratio", motor.gear_ratio), stated("inertia_kgm2", motor.inertia),
                   stated("viscous_friction_nms", motor.viscous_friction),
                   np.ones(robot.n) if motor.torque_gain is None else motor.torque_gain)


def _arm(robot: Robot, remarks: list[str]) -> _Arm:
    links, zero = robot.links, np.zeros(robot.n)
    needed = (links.mass, links.length, links.com)
    complete = robot.n <= 2 and all(value is not None for value in needed)
    stated = {key: zero if value is None or not complete else np.asarray(value, float)
              for key, value in (("mass", links.mass), ("length", links.length),
                                 ("com", links.com), ("inertia", links.inertia),
                                 ("h", links.joint_viscous_friction))}
    if not complete:
        remarks.append("Links are left out: the bounds take them for arms of one or two links "
                       "whose mass, length and centre of mass the file states.")
    return _Arm(**stated, g=robot.nominal.g)


def _gains(robot: Robot, kp: ArrayLike | None, kd: ArrayLike | None,
           ) -> tuple[np.ndarray, np.ndarray]:
    law = robot.controller
    if law.law == "cascade" or law.law == "pd" and law.kd is not None:
        own_kp, own_kd = gains(law)
        kp = own_kp if kp is None else kp
        kd = own_kd if kd is None else kd
    if kp is None or kd is None:
        raise RecordError(f"{robot.source}: [controller] states no PD gains (law {law.law!r}); "
                          "give --kp and --kd in N m/rad and N m s/rad, motor side")
    return vector(kp, "kp", n=robot.n, above=0), vector(kd, "kd", n=robot.n, above=0)


def _experiment(robot: Robot, n: int, kp: np.ndarray, remarks: list[str],
                ) -> tuple[np.ndarray, np.ndarray]:
    stated = list(robot.experiments.values())
    points = [one.set_point for one in stated if one.set_point is not None]
    scales = [one.scale for one in stated if one.scale is not None]
    if not scales:
        remarks.append("No experiment uses the excitation (48): it is scaled with Kp, as the "
                       "paper's is for Kp = 10.")
    scale = vector(scales[0] if scales else kp / PAPER_KP, "scale", n=n)
    return vector(points[0] if points else np.zeros(n), "set_point", n=n), scale


def _theta(arm: _Arm, drives: _Drives, q: np.ndarray) -> np.ndarray:
    inertia, damping, load = motor_side(arm.diagonal(q), arm.h, drives.gear_ratio, drives.inertia,
                                        drives.friction)
    a, b, d = normalised(inertia, damping, load + arm.weight(q) / drives.gear_ratio)
    return np.concatenate((a, drives.torque_gain * b, d))


def _box(arm: _Arm, drives: _Drives, inertia_tolerance: float = 0.0,
         friction_tolerance: float = 0.0, offset: np.ndarray | float = 0.0) -> ParameterBox:
    """All poses and tolerances: inertia between folded and stretched, load up to the weight."""
    n = drives.gear_ratio.size
    folded, stretched = np.zeros(n), np.zeros(n)
    folded[-1] = np.pi
    ends = []
    for pose, sign in ((folded, -1), (stretched, 1)):
        ends.append(motor_side(
            arm.diagonal(pose), arm.h, drives.gear_ratio,
            drives.inertia * (1 + sign * inertia_tolerance),
            drives.friction * (1 + sign * friction_tolerance))[:2])
    (light, slick), (heavy, rough) = ends
    load = np.abs(arm.weight(stretched)) / drives.gear_ratio + offset
    gain = drives.torque_gain
    return ParameterBox(np.concatenate((slick / heavy, gain / heavy, -load / light)),
                        np.concatenate((rough / light, gain / light, load / light)))


def _plant(arm: _Arm, drives: _Drives, theta: np.ndarray) -> ct.NonlinearIOSystem:
    """The arm or pendulum where it is stated; their blocks have a torque gain of one."""
    n, gear_ratio = drives.gear_ratio.size, drives.gear_ratio
    if not (np.any(arm.mass > 0) and np.all(drives.torque_gain == 1)):
        a, b, d = theta.reshape(3, -1)
        return decoupled_joints(a, b, d)
    if n == 2:
        return two_link_arm(arm.mass, arm.length, gear_ratio, drives.inertia, drives.friction,
                            com=arm.com, j_link=arm.inertia, h=arm.h, g=arm.g)
    weight = LIBRARY["gravity"](weight=arm.mass * arm.com * arm.g, gear_ratio=gear_ratio)
    return with_effects(decoupled_joints(theta[:1], theta[1:2], 0.0), [weight])
