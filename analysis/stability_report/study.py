"""What a stability report is about: a robot with its uncertainty, gains, excitation, set-point."""

from dataclasses import dataclass, replace

import numpy as np

from clie_blocks import paper
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
        What was assumed.
    is_paper : bool
        Whether this is the paper's robot, so that its printed values stand beside.

    """

    name: str
    plant: object
    joints: ControlledJoints
    box: ParameterBox
    q_d: np.ndarray
    scale: np.ndarray
    gamma: float = paper.GAMMA
    alpha: float = paper.ALPHA[2]
    shape: object = 1.0
    eta_norm: float | None = None
    eps_bar: tuple | None = None
    time: float = 100.0
    remarks: tuple = ()
    is_paper: bool = False

    @property
    def pe(self):
        """Excitation [N m] as a function of time, period 2 s."""
        scale = self.scale
        return lambda t: scale * paper_excitation(t)

    @property
    def gamma_diagonal(self):
        """Diagonal of Gamma, shape (3n,)."""
        return self.gamma * self.shape * np.ones(3 * self.joints.n)

    @property
    def loop(self):
        """The periodic identification loop around the true parameters."""
        return PeriodicLoop(self.joints, self.pe, q_d=self.q_d, shape=self.shape)

    def with_gains(self, kp=None, kd=None):
        """Return the study with other PD gains, one number or one per joint."""
        n, old = self.joints.n, self.joints
        kp = old.kp if kp is None else vector(kp, "--kp", n=n, unit="N m/rad", above=0)
        kd = old.kd if kd is None else vector(kd, "--kd", n=n, unit="N m s/rad", above=0)
        return replace(self, joints=ControlledJoints(old.a, old.b, old.d, kp, kd))

    def balanced(self):
        """Return the study with a diagonal Gamma that lets all estimates converge alike."""
        return replace(self, shape=balanced_shape(self.loop), remarks=(*self.remarks, BALANCED))

    def with_theta(self, theta):
        """Return the study with other parameters ``[a, b, d]``, such as estimates."""
        old = self.joints
        if np.size(theta) == 1:
            raise DiagramError(f"--theta needs {3 * old.n} numbers: a, b and d of {old.n} joints")
        theta = vector(theta, "--theta", n=3 * old.n)
        box = ParameterBox(np.minimum(self.box.lower, theta), np.maximum(self.box.upper, theta))
        return replace(self, joints=ControlledJoints.from_theta(theta, old.kp, old.kd), box=box)


def paper_study():
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
                 "Table 2 and from the simulation stands beside."),
        is_paper=True)


def robot_study(robot, kp=None, kd=None):
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
    n, remarks = robot.n, []
    drives, arm = _drives(robot), _arm(robot, remarks)
    kp, kd = _gains(robot, kp, kd)
    q_d, scale = _experiment(robot, n, kp, remarks)
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

    def diagonal(self, q):
        """Diagonal of the mass matrix [kg m^2] at a pose."""
        if self.mass.size == 2:
            return np.diag(mass_matrix(q, self.mass, self.length, self.com, self.inertia))
        return self.mass * self.com**2 + self.inertia

    def weight(self, q):
        """Gravity torque of the links [N m] at a pose."""
        if self.mass.size == 2:
            return gravity(q, self.mass, self.length, self.com, self.g)
        return self.mass * self.com * self.g * np.cos(q)


def _drives(robot):
    motor = robot.motor
    for key, value in (("gear_ratio", motor.gear_ratio), ("inertia_kgm2", motor.inertia),
                       ("viscous_friction_nms", motor.viscous_friction)):
        if value is None:
            raise RecordError(f"{robot.source}: [motor] {key} is missing; without it A and B of "
                              "eq. (9) are unknown and no bound can be given")
    gain = np.ones(robot.n) if motor.torque_gain is None else motor.torque_gain
    return _Drives(motor.gear_ratio, motor.inertia, motor.viscous_friction, gain)


def _arm(robot, remarks):
    links, zero = robot.links, np.zeros(robot.n)
    needed = (links.mass, links.length, links.com)
    complete = robot.n <= 2 and all(value is not None for value in needed)
    given = {key: zero if value is None or not complete else np.asarray(value, float)
             for key, value in (("mass", links.mass), ("length", links.length),
                                ("com", links.com), ("inertia", links.inertia),
                                ("h", links.joint_viscous_friction))}
    if not complete:
        remarks.append("Links are left out: the file does not state mass, length and centre of "
                       "mass of one or two links.")
    return _Arm(**given, g=robot.nominal.g)


def _gains(robot, kp, kd):
    law = robot.controller
    stated = {"pd": (law.kp, law.kd)}
    if law.law == "cascade":
        stated["cascade"] = (law.kp * law.kv, law.kv)
    own_kp, own_kd = stated.get(law.law, (None, None))
    kp, kd = (own if given is None else given for own, given in ((own_kp, kp), (own_kd, kd)))
    if kp is None or kd is None:
        raise RecordError(f"{robot.source}: [controller] states no PD gains (law {law.law!r}); "
                          "give --kp and --kd in N m/rad and N m s/rad, motor side")
    return (vector(value, name, n=robot.n, above=0) for value, name in ((kp, "kp"), (kd, "kd")))


def _experiment(robot, n, kp, remarks):
    stated = list(robot.experiments.values())
    points = [one.set_point for one in stated if one.set_point is not None]
    scales = [one.scale for one in stated if one.scale is not None]
    if not scales:
        remarks.append("No experiment uses the excitation (48): it is scaled with Kp, as the "
                       "paper's is for Kp = 10.")
    scale = vector(scales[0] if scales else kp / PAPER_KP, "scale", n=n)
    return vector(points[0] if points else np.zeros(n), "set_point", n=n), scale


def _theta(arm, drives, q):
    inertia, damping, load = motor_side(arm.diagonal(q), arm.h, drives.gear_ratio, drives.inertia,
                                        drives.friction)
    a, b, d = normalised(inertia, damping, load + arm.weight(q) / drives.gear_ratio)
    return np.concatenate((a, drives.torque_gain * b, d))


def _box(arm, drives, inertia_tolerance=0.0, friction_tolerance=0.0, offset=0.0):
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


def _plant(arm, drives, theta):
    """The arm or pendulum where it is known; their blocks know no torque gain but one."""
    n, gear_ratio = drives.gear_ratio.size, drives.gear_ratio
    if not (np.any(arm.mass > 0) and np.all(drives.torque_gain == 1)):
        return decoupled_joints(*theta.reshape(3, -1))
    if n == 2:
        return two_link_arm(arm.mass, arm.length, gear_ratio, drives.inertia, drives.friction,
                            com=arm.com, j_link=arm.inertia, h=arm.h, g=arm.g)
    weight = LIBRARY["gravity"](weight=arm.mass * arm.com * arm.g, gear_ratio=gear_ratio)
    return with_effects(decoupled_joints(*theta[:2], 0.0), [weight])
