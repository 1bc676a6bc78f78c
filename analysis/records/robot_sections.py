"""Sections of a robot file: drives, links, nominal model, encoder and experiments."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np

from clie_blocks.analysis.records.fields import file_field
from clie_blocks.analysis.records.section import Section
from clie_blocks.errors import RecordError

OF_MODEL = ("base", "tip", "locked", "model_joints", "sign", "zero", "gravity", "payload")
EXCITATIONS = ("paper_pe", "multisine", "chirp", "triangle", "steps", "other")


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Motor(Section):
    """Datasheet of the drives, motor side.

    Parameters
    ----------
    gear_ratio : array_like, shape (n,)
        Motor turns per joint turn, not zero; below zero where they turn against each other, which
        a `Robot` keeps as a sign in `coupling`.
    coupling : array_like, shape (n, n)
        Matrix C of motors that turn several joints: the joints stand at C times the positions of
        the motors over their gear ratios.
    inertia : array_like, shape (n,)
        Rotor inertia [kg m^2].
    viscous_friction : array_like, shape (n,)
        Rotor damping [N m s].
    torque_gain : array_like, shape (n,)
        Delivered torque per commanded torque; per volt for a voltage command (EMPS: N/V).
    peak_torque : array_like, shape (n,)
        Largest torque [N m].
    inertia_tolerance : float
        Relative tolerance of the rotor inertia.
    viscous_friction_tolerance : float
        Relative tolerance of the damping.
    torque_offset_tolerance : array_like, shape (n,)
        Largest constant offset of the drive [N m].
    torque_constant : array_like, shape (n,)
        Torque per current [N m/A], equal to the back-EMF constant [V s].
    torque_constant_tolerance : float
        Its relative tolerance.
    resistance : array_like, shape (n,)
        Winding resistance [ohm].

    """

    gear_ratio: np.ndarray | None = file_field("gear_ratio", "joints", nonzero=True)
    coupling: np.ndarray | None = file_field("motor_coupling", "matrix")
    inertia: np.ndarray | None = file_field("inertia_kgm2", "joints", least=0)
    viscous_friction: np.ndarray | None = file_field("viscous_friction_nms", "joints", least=0)
    torque_gain: np.ndarray | None = file_field("torque_gain", "joints", above=0)
    peak_torque: np.ndarray | None = file_field("peak_torque_nm", "joints", above=0)
    inertia_tolerance: float | None = file_field("inertia_tolerance", "number", least=0)
    viscous_friction_tolerance: float | None = file_field("viscous_friction_tolerance", "number",
                                                          least=0)
    torque_offset_tolerance: np.ndarray | None = file_field("torque_offset_tolerance_nm", "joints",
                                                            least=0)
    torque_constant: np.ndarray | None = file_field("torque_constant_nm_a", "joints", above=0)
    torque_constant_tolerance: float | None = file_field("torque_constant_tolerance", "number",
                                                         least=0)
    resistance: np.ndarray | None = file_field("resistance_ohm", "joints", above=0)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Links(Section):
    """CAD of the links, joint side.

    Parameters
    ----------
    length : array_like, shape (n,)
        Link length, from joint to joint [m].
    com : array_like, shape (n,)
        Distance of the centre of mass from the joint, along the link [m].
    mass : array_like, shape (n,)
        Mass [kg].
    inertia : array_like, shape (n,)
        Inertia about the centre of mass [kg m^2].
    joint_viscous_friction : array_like, shape (n,)
        Damping of the bearing [N m s].
    mass_tolerance : float
        Relative tolerance of the masses, and of the inertias with them; 0 where it is not stated.
    com_tolerance : float
        Tolerance of each coordinate of the centres of mass that is not zero [m]; 0 where it is
        not stated.
    model : str
        URDF or MJCF file in the place of the numbers above, seen from the robot file.
    base : str
        Link of it that stands still; by default its root.
    tip : str
        Link of it at which the arm ends, and where a load sits.
    locked : mapping of str to float
        Joints of it that are held, and where [rad or m].
    model_joints : tuple of str
        Its joints in the order of the logs; by default `joint_names`, if they are those of it.
    sign : array_like, shape (n,)
        -1 where the log counts against the model, else 1.
    zero : array_like, shape (n,)
        Position in the model where the log reads 0 [rad or m].
    gravity : array_like, shape (3,)
        In the frame of the base [m/s^2].
    payload : float
        Mass that the robot always carries at the tip [kg].

    """

    length: np.ndarray | None = file_field("length_m", "joints", least=0)
    mass: np.ndarray | None = file_field("mass_kg", "joints", least=0)
    com: np.ndarray | None = file_field("com_m", "joints")
    inertia: np.ndarray | None = file_field("inertia_kgm2", "joints", least=0)
    joint_viscous_friction: np.ndarray | None = file_field("joint_viscous_friction_nms", "joints",
                                                           least=0)
    mass_tolerance: float | None = file_field("mass_tolerance", "number", least=0)
    com_tolerance: float | None = file_field("com_tolerance_m", "number", least=0)
    model: str | None = file_field("model", "text")
    base: str | None = file_field("base", "text")
    tip: str | None = file_field("tip", "text")
    locked: Mapping[str, float] | None = file_field("locked", "positions")
    model_joints: tuple[str, ...] | None = file_field("model_joints", "names")
    sign: np.ndarray | None = file_field("sign", "joints")
    zero: np.ndarray | None = file_field(("zero_rad", "zero"), "joints")
    gravity: np.ndarray | None = file_field("gravity_m_s2", "vector")
    payload: float | None = file_field("payload_kg", "number", least=0)

    def __post_init__(self) -> None:
        super().__post_init__()
        numbers = [name for name in ("length", "mass", "com", "inertia")
                   if getattr(self, name) is not None]
        of_model = [name for name in OF_MODEL if getattr(self, name) is not None]
        if self.model is not None and numbers:
            raise RecordError(f"both a model and {numbers[0]} of the links are stated; the model "
                              f"holds the links: take {numbers[0]} out, or the model")
        if self.model is None and of_model:
            raise RecordError(f"{of_model[0]} belongs to a model, and none is stated; write "
                              'model = "arm.urdf" beside it')


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Nominal(Section):
    """What the nominal model holds besides A, B and D of each joint.

    Parameters
    ----------
    gravity : bool or None
        Whether it has the weight of `Links`; None where that is not stated.
    coupling : bool or None
        Whether it has the inertia coupling and Coriolis terms of `Links`; None where that is not
        stated: a model has them, numbers per link have not.
    g : float
        Acceleration of gravity [m/s^2].
    output_locked : bool
        Whether the output was blocked in all logs, so that only the gear twists.

    """

    gravity: bool | None = file_field("gravity", "flag")
    coupling: bool | None = file_field("coupling", "flag")
    g: float = file_field("g", "number", 9.81, least=0)
    output_locked: bool = file_field("output_locked", "flag", False)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Encoder(Section):
    """The position sensor.

    Parameters
    ----------
    mounting : str
        ``joint side`` or ``motor side``; of two encoders, that of the one on which the law acts.
    positions : str
        What q, qd and dq of the logs are where motors are coupled: positions of the ``joints`` (by
        default), or of the ``motors`` over their gear ratios.
    shaft_ratio : array_like, shape (n,)
        Turns of the encoder's shaft per joint turn.
    resolution : array_like, shape (n,)
        Step of the logged position [rad, or m].

    """

    positions: str | None = file_field("positions", "choice", choices=("joints", "motors"))
    mounting: str | None = file_field("mounting", "choice", choices=("joint side", "motor side"))
    shaft_ratio: np.ndarray | None = file_field("shaft_ratio", "joints", above=0)
    resolution: np.ndarray | None = file_field(("resolution_rad", "resolution_m"), "joints",
                                               least=0)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Limits(Section):
    """How far a recommended run may go; what is not stated is as far as the logs went.

    Parameters
    ----------
    lower : array_like, shape (n,)
        Lowest position [rad, or m].
    upper : array_like, shape (n,)
        Highest position [rad, or m].
    speed : array_like, shape (n,)
        Fastest motion [rad/s, or m/s].
    command : array_like, shape (n,)
        Largest command [unit of u]; by default the limit of the law.

    """

    lower: np.ndarray | None = file_field(("lower_rad", "lower_m"), "joints")
    upper: np.ndarray | None = file_field(("upper_rad", "upper_m"), "joints")
    speed: np.ndarray | None = file_field(("speed_rad_s", "speed_m_s"), "joints", above=0)
    command: np.ndarray | None = file_field(("command_nm", "command"), "joints", above=0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.lower is not None and self.upper is not None and np.any(self.lower >= self.upper):
            raise RecordError(f"[limits]: the lowest position {self.lower.tolist()} is not below "
                              f"the highest, {self.upper.tolist()}; exchange the two")


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Experiment(Section):
    """How one log was taken; what describes another kind of signal is left out.

    Parameters
    ----------
    excitation : str
        Kind of motion.
    signal : str
        Its description as text.
    start : array_like, shape (n,)
        Position at rest at time 0 [rad].
    set_point : array_like, shape (n,)
        Centre of the motion [rad].
    duration : float
        Length [s].
    amplitude : array_like, shape (n,)
        Amplitude of a reference [rad].
    periods : array_like, shape (n,)
        Period of a reference [s].
    hold : array_like, shape (n,)
        Time between the steps of a reference [s].
    scale : array_like, shape (n,)
        Factor on the paper's excitation (48).
    f_low : float
        First frequency of a chirp [Hz].
    f_high : array_like, shape (n,)
        Last frequency of a chirp [Hz].
    frequencies : tuple
        Frequencies of an injected torque, one list per joint [Hz].
    amplitudes : tuple
        Its amplitudes [N m].
    output_locked : bool
        Whether the output was blocked in this log.

    """

    excitation: str | None = file_field("excitation", "choice", choices=EXCITATIONS)
    signal: str | None = file_field("signal", "text")
    start: np.ndarray | None = file_field(("start_rad", "start_m"), "joints")
    set_point: np.ndarray | None = file_field(("set_point_rad", "set_point_m"), "joints")
    duration: float | None = file_field("duration_s", "number", above=0)
    amplitude: np.ndarray | None = file_field(("amplitude_rad", "amplitude_m"), "joints")
    periods: np.ndarray | None = file_field("periods_s", "joints", above=0)
    hold: np.ndarray | None = file_field("hold_s", "joints", above=0)
    scale: np.ndarray | None = file_field("scale", "joints")
    f_low: float | None = file_field("f_low_hz", "number", above=0)
    f_high: np.ndarray | None = file_field("f_high_hz", "joints", above=0)
    frequencies: tuple[np.ndarray, ...] | None = file_field("frequencies_hz", "lists")
    amplitudes: tuple[np.ndarray, ...] | None = file_field("amplitudes_nm", "lists")
    output_locked: bool = file_field("output_locked", "flag", False)
