"""What is known of a robot and its controller, as an engineer would state it in `robot.toml`.

Each field carries its keys in the file and the kind of value it takes, so that the file, the
check and the attribute cannot drift apart.  What is not stated is None and counts as unknown.
Lists have one entry per joint.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, TypeVar, overload

import numpy as np

from clie_blocks.analysis.records.fields import (
    FixedDict,
    check_name,
    check_value,
    file_field,
    per_joint,
)
from clie_blocks.errors import RecordError
from clie_blocks.labels import DiagramError
from clie_blocks.linear_filters import DISCRETISATIONS
from clie_blocks.output import short_repr
from clie_blocks.rigid_body.motor_coupling import Matrix, coupling_of
from clie_blocks.rigid_body.tree import Tree

if TYPE_CHECKING:
    from control import InputOutputSystem

LAWS = ("pd", "pid", "cascade", "servo", "unknown")
PROGRAM = "program"  # a law that is given as a block
HOLDS = ("conditional", "back_calculation", "none")
COMPENSATIONS = ("gravity", "inverse_dynamics", "pd_plus", "computed_torque")
FEEDFORWARD = ("velocity", "acceleration", "coulomb", "width_rad_s")
REFERENCE_RATES = ("difference", "trajectory", "filtered")
SIGNAL_FILTER = ("lowpass_rad_s", "notch_rad_s", "notch_width")
MODEL_SHARES = ("mass", "rotor", "friction")
EXTENDED = ("pd", "pid", "cascade")  # laws that take the keys of `EXTENSIONS`
FILTERS = ("two_corner", "two_tap", "difference", "exact")
COMMANDED, MEASURED, COMPUTED = SOURCES = ("commanded", "measured", "computed")
_OTHER_WORDS = {"command": COMMANDED, "measured torque": MEASURED}  # for the same
Part = TypeVar("Part", bound="_Section")
EXTENSIONS = ("compensation", "feedforward", "error_filter", "command_filter", "dead_band",
              "punch", "command_rate", "position_every")
NO_EXTENSION: dict[str, None] = dict.fromkeys(EXTENSIONS)
OF_MODEL = ("base", "tip", "locked", "model_joints", "sign", "zero", "gravity", "payload")
EXCITATIONS = ("paper_pe", "multisine", "chirp", "triangle", "steps", "other")


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class _Section:
    """Checks and freezes every field when built."""

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if value is not None and field.metadata:
                where = f"{type(self).__name__}.{field.name}"
                object.__setattr__(self, field.name, check_value(value, field, where))

    def __repr__(self) -> str:
        return short_repr(self, [field.name for field in dataclasses.fields(self)])


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Motor(_Section):
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
class Links(_Section):
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
class Nominal(_Section):
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
class Controller(_Section):
    """The control law that ran on the robot.

    The laws, with v the velocity estimate of `velocity_filter`:
    ``pd``       u = Kp (qd - q) - Kd v + pe, eq. (11) with a moving reference;
    ``pid``      u = Kp (qd - q) + Ki sum(qd - q) T - Kd v + pe, see `sampled_pid`;
    ``cascade``  u = Kv w + Ki sum(w) T + pe, w = Kp (qd - q) - v, position loop around a velocity
                 loop, see `sampled_cascade`; Ki is 0 where it is not stated;
    ``servo``    u = clip(Kp (qd - q), +-saturation) is a duty cycle of the supply voltage;
    ``unknown``  nothing is known, u is the logged torque or current;
    ``my_law.py:controller``  the block of python-control that the file, beside the robot file,
                 defines under this name; it is run only where the user allows it;
    ``my_law.c:controller``  the function in C that the file defines, see `law_in_c`; likewise;
    ``program``  a block that is given in Python.

    Parameters
    ----------
    law : str
        One of these; by default ``pd`` where gains are given, else ``unknown``.
    kp : array_like, shape (n,)
        Gain on the position error [command per rad]; in ``cascade`` of the outer loop [1/s].
    ki : array_like, shape (n,)
        Gain on the integral [command per rad s]; in ``cascade`` of the inner loop [command per
        rad].
    kd : array_like, shape (n,)
        Gain on the velocity [command per rad/s].
    kv : array_like, shape (n,)
        Gain of the velocity loop of ``cascade`` [command per rad/s].
    velocity_of : str
        What Kd damps in ``pd`` and ``pid``: ``joint`` (by default), v, or ``error``, the velocity
        of q - qd through the same filter.
    compensation : str
        ``gravity``: the law also adds the weight of the stated links, see
        `with_weight_compensation`; ``inverse_dynamics``, ``pd_plus``, ``computed_torque``: their
        whole dynamics, see `with_inverse_dynamics`; by default nothing.
    model_shares : mapping of str to ndarray
        Of the stated ``mass`` (with inertia) of the links, inertia of the ``rotor`` and viscous
        ``friction``, what the controller's own model has; by default 1.
    feedforward : mapping of str to ndarray
        Gains on ``velocity`` and ``acceleration`` of the reference, and ``coulomb`` friction with
        the velocity ``width_rad_s`` over which it changes its sign, see `with_feedforward`.
    reference_rate : str
        How the velocity of the reference is formed: ``difference``, ``trajectory``, ``filtered``.
    error_filter : mapping of str to ndarray
        Filter of the error: ``lowpass_rad_s``, ``notch_rad_s`` and ``notch_width``, see
        `with_filter`.
    command_filter : mapping of str to ndarray
        The same, of the command.
    dead_band : array_like, shape (n,)
        Error up to which there is no command [rad], half the dead band, see `with_dead_band`.
    punch : array_like, shape (n,)
        Least command beyond the dead band [unit of u].
    command_rate : array_like, shape (n,)
        Fastest change of the command [unit of u per s].
    position_every : float
        Samples of the velocity loop per sample of the position loop, in ``cascade``.
    anti_windup : str
        What an integral does where the command is limited: ``conditional`` (by default),
        ``back_calculation`` or ``none``.
    tracking_time : float
        Time constant of ``back_calculation`` [s].
    velocity_filter : str
        ``two_corner`` is G1 (47); ``two_tap`` the backward difference of the mean of the last two
        samples, (q_k - q_{k-2}) / (2 T); ``difference`` the backward difference; ``exact`` the
        logged velocity dq, as the drive measured it.
    highpass : float
        High-pass corner of G1 (47) [rad/s].
    lowpass : float
        Low-pass corner of G1 (47) [rad/s].
    discretisation : str
        How G1 (47) is made discrete.
    sample_time : float
        Period of the controller [s].
    u_is : str
        What the column u holds: what was ``commanded`` (by default); a torque ``measured`` behind
        the drive, as a sensor or a current gives it, in which drives have had their effect; or
        ``computed`` from the other columns by whoever wrote the log, which is no measurement.
    hold : str
        ``zero-order``: the command acts from its own sample instant on.
    command_resolution : array_like, shape (n,)
        Rounding step of u [unit of u].
    saturation : array_like, shape (n,)
        Limit of u [unit of u].
    supply : float
        Nominal supply voltage [V] of a servo; where the logs have its course, as the channel
        ``supply``, torques follow that.
    parameters : mapping of str to ndarray
        Numbers that a law in C takes, by their names there.
    block : control.InputOutputSystem
        The law itself, where it is a program; in no file, see `with_law`.
    block_scale : ndarray, shape (n,)
        Torque per unit of the block's command, where that is no torque.

    """

    law: str = file_field("law", "law", choices=(*LAWS, PROGRAM))
    kp: np.ndarray | None = file_field("Kp", "joints")
    ki: np.ndarray | None = file_field("Ki", "joints", least=0)
    kd: np.ndarray | None = file_field("Kd", "joints")
    kv: np.ndarray | None = file_field("Kv", "joints")
    velocity_of: str | None = file_field("velocity_of", "choice", choices=("joint", "error"))
    compensation: str | None = file_field("compensation", "choice", choices=COMPENSATIONS)
    model_shares: Mapping[str, np.ndarray] | None = file_field(
        "model_shares", "table", choices=MODEL_SHARES)
    feedforward: Mapping[str, np.ndarray] | None = file_field(
        "feedforward", "table", choices=FEEDFORWARD)
    reference_rate: str | None = file_field("reference_rate", "choice", choices=REFERENCE_RATES)
    error_filter: Mapping[str, np.ndarray] | None = file_field(
        "error_filter", "table", choices=SIGNAL_FILTER)
    command_filter: Mapping[str, np.ndarray] | None = file_field(
        "command_filter", "table", choices=SIGNAL_FILTER)
    dead_band: np.ndarray | None = file_field(("dead_band_rad", "dead_band_m"), "joints", least=0)
    punch: np.ndarray | None = file_field(("punch_nm", "punch"), "joints", least=0)
    command_rate: np.ndarray | None = file_field(("command_rate_nm_s", "command_rate"), "joints",
                                                 above=0)
    position_every: float | None = file_field("position_every", "number", least=1)
    anti_windup: str | None = file_field("anti_windup", "choice", choices=HOLDS)
    tracking_time: float | None = file_field("tracking_time_s", "number", above=0)
    velocity_filter: str | None = file_field("velocity_filter", "choice", choices=FILTERS)
    highpass: float | None = file_field("velocity_filter_highpass_rad_s", "number", above=0)
    lowpass: float | None = file_field("velocity_filter_lowpass_rad_s", "number", above=0)
    discretisation: str | None = file_field("velocity_filter_discretisation", "choice",
                                            choices=DISCRETISATIONS)
    sample_time: float | None = file_field("sample_time_s", "number", above=0)
    u_is: str | None = file_field(("u_is", "u"), "choice", choices=(*SOURCES, *_OTHER_WORDS))
    hold: str | None = file_field("hold", "choice", choices=("zero-order",))
    command_resolution: np.ndarray | None = file_field(
        ("command_resolution_nm", "command_resolution"), "joints", least=0)
    saturation: np.ndarray | None = file_field(("saturation_nm", "saturation"), "joints", above=0)
    supply: float | None = file_field("supply_v", "number", above=0)
    parameters: Mapping[str, np.ndarray] | None = file_field("parameters", "numbers")
    block: InputOutputSystem | None = file_field((), "given")
    block_scale: np.ndarray | None = file_field((), "given")

    @property
    def is_program(self) -> bool:
        """Whether the law is a program of the user's own."""
        return self.law not in LAWS

    @property
    def is_block(self) -> bool:
        """Whether the law runs as a block: it has more states than the filter of PD (11)."""
        return (self.is_program or self.law == "pid" or self.velocity_of == "error"
                or self.extended_by is not None
                or (self.law == "cascade" and self.ki is not None and bool(np.any(self.ki))))

    @property
    def extended_by(self) -> str | None:
        """First key by which the law has more than the law of its name; None without."""
        return next((name for name in EXTENSIONS if getattr(self, name) is not None), None)

    @property
    def corners(self) -> tuple[float, float] | None:
        """Corners of G1 (47) [rad/s], where both are stated."""
        if self.highpass is None or self.lowpass is None:
            return None
        return self.highpass, self.lowpass

    def __post_init__(self) -> None:
        super().__post_init__()
        law = self.law or ("unknown" if self.kp is None else "pd")
        object.__setattr__(self, "law", law)
        object.__setattr__(self, "u_is", _OTHER_WORDS.get(self.u_is or "", self.u_is))
        needed = {"pd": ("kp", "kd"), "pid": ("kp", "ki", "kd"), "cascade": ("kp", "kv"),
                  "servo": ("kp",)}
        missing = [name for name in needed.get(law, ()) if getattr(self, name) is None]
        if missing:
            raise RecordError(f"the control law {law!r} needs {missing[0].capitalize()}, one gain "
                              "per joint; without it the loop cannot be simulated")
        extended = self.extended_by
        if extended is not None and law not in (*EXTENDED, "servo"):
            value = getattr(self, extended)
            said = f"{extended} = {value!r}" if isinstance(value, str) else extended
            raise RecordError(f"{said} belongs to the laws 'pd', "
                              f"'pid' and 'cascade', and the law is {law!r}; leave it out")
        if self.compensation is not None and law == "servo":
            raise RecordError(f"compensation = {self.compensation!r} belongs to the laws 'pd', "
                              f"'pid' and 'cascade', and the law is {law!r}; leave it out")
        if self.position_every is not None and law != "cascade":
            raise RecordError("position_every is the rate of the outer loop of a 'cascade', and "
                              f"the law is {law!r}; leave it out")
        if self.position_every is not None and self.position_every % 1:
            raise RecordError("position_every counts samples of the velocity loop; state a whole "
                              f"number, got {self.position_every:g}")
        if self.velocity_filter is None and self.highpass is not None:
            object.__setattr__(self, "velocity_filter", "two_corner")


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Encoder(_Section):
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
class Experiment(_Section):
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


@dataclasses.dataclass(frozen=True, eq=False)
class Robot:
    """All that is known of one robot.

    Parameters
    ----------
    n : int
        Number of joints; key ``joints``.
    name : str
        What it is.
    joints : sequence of str
        Joint names; key ``joint_names``; by default ``joint1, joint2, ...``.
    motor, links, nominal, controller, encoder : Motor, Links, Nominal, Controller, Encoder
        The sections of the file; a missing one holds only unknowns.
    experiments : mapping of str to Experiment
        By the stem of the log's file name.
    units : mapping of str to str
        Unit of a signal of `Record` where it is not rad and N m.
    columns : mapping of str to str
        Column patterns of the logs, such as ``{"q": "actual_pos_{joint}"}``.
    source : str
        The file.
    tree : Tree or None
        Links of the model that the file names, or that is given here.

    Raises
    ------
    RecordError
        If a value is not of its kind, out of bounds, or not one per joint.

    """

    n: int
    name: str = ""
    joints: tuple[str, ...] = ()
    motor: Motor = Motor()
    links: Links = Links()
    nominal: Nominal = Nominal()
    controller: Controller = Controller()
    encoder: Encoder = Encoder()
    experiments: Mapping[str, Experiment] = dataclasses.field(default_factory=FixedDict)
    units: Mapping[str, str] = dataclasses.field(default_factory=FixedDict)
    columns: Mapping[str, str] = dataclasses.field(default_factory=FixedDict)
    source: str = ""
    tree: Tree | None = None

    def __post_init__(self) -> None:
        if self.tree is not None and self.tree.n != self.n:
            raise RecordError(f"{self.source or 'robot'}: the model of the links has "
                              f"{self.tree.n} joints that move, {', '.join(self.tree.names)}, the "
                              f"robot {self.n}; lock those that the logs do not hold, or name the "
                              "tip of the arm")
        names = tuple(self.joints) or tuple(f"joint{k + 1}" for k in range(self.n))
        if len(set(names)) != self.n:
            raise RecordError(f"{self.source or 'robot'}: {self.n} joints need {self.n} different "
                              f"names, got {', '.join(map(str, names))}")
        where = self.source or "robot"
        check_name(self.name, f"{where}: the name")
        for name in names:
            check_name(name, f"{where}: the joint name")
        object.__setattr__(self, "joints", names)
        for name in ("experiments", "units", "columns"):
            object.__setattr__(self, name, FixedDict(dict(getattr(self, name))))
        for name in ("motor", "links", "controller", "encoder"):
            object.__setattr__(self, name, self._fitted(getattr(self, name)))
        object.__setattr__(self, "motor", self._coupled(self.motor))

    @property
    def motor_coupling(self) -> Matrix | None:
        """Matrix C of motors that turn several joints, or against theirs; None of others."""
        return None if self.motor.coupling is None else coupling_of(self.motor.coupling, self.n)

    def __repr__(self) -> str:
        links = "unknown" if self.tree is None and self.links.mass is None else "known"
        return (f"Robot({self.name!r}: joints {', '.join(self.joints)}; law "
                f"{self.controller.law}; links {links})")

    def _fitted(self, section: Part) -> Part:
        changes: dict[str, object] = {field.name: per_joint(getattr(section, field.name), self.n,
                                         f"{type(section).__name__}.{field.name}")
                   for field in dataclasses.fields(section) if field.metadata["kind"] == "joints"}
        changes |= {field.name: self._fitted_table(getattr(section, field.name), field.name)
                    for field in dataclasses.fields(section) if field.metadata["kind"] == "table"}
        return dataclasses.replace(section, **changes)

    def _fitted_table(self, table: Mapping[str, np.ndarray] | None,
                      where: str) -> Mapping[str, np.ndarray | None] | None:
        return None if table is None else {
            name: per_joint(value, self.n, f"{where}.{name}") for name, value in table.items()}

    def _coupled(self, motor: Motor) -> Motor:
        """Drives with positive gear ratios, whose signs are in the matrix of the coupling."""
        where = f"{self.source or 'robot'}: [motor]"
        ratio = motor.gear_ratio
        turned = ratio is not None and bool((ratio < 0).any())
        if motor.coupling is None and not turned:
            return motor
        try:
            coupling = coupling_of(np.eye(self.n) if motor.coupling is None else motor.coupling,
                                   self.n, f"{where} motor_coupling")
        except DiagramError as error:
            raise RecordError(str(error)) from None
        matrix = np.eye(self.n) if coupling is None else np.array(coupling)
        if ratio is not None and turned:
            matrix, ratio = matrix * np.sign(ratio), np.abs(ratio)
        if self.links.mass is not None and (coupling is not None or turned):
            raise RecordError(f"{where} motor_coupling and gear ratios below zero go with links "
                              'of a model: model = "arm.urdf" in [links], and no numbers per link')
        return dataclasses.replace(
            motor, gear_ratio=ratio,
            coupling=None if coupling is None and not turned else matrix)


def with_law(robot: Robot, block: InputOutputSystem) -> Robot:
    """Robot whose law is a block of python-control, in samples of its own or of the controller.

    What the robot file says of limits and rounding of the command stays.
    """
    law = robot.controller
    is_timed = block.dt not in (None, True, 0)
    return dataclasses.replace(robot, controller=dataclasses.replace(
        law, law=law.law if law.is_program else PROGRAM, block=block, kp=None, ki=None, kd=None,
        kv=None, velocity_of=None, velocity_filter=None, highpass=None, lowpass=None,
        discretisation=None, **NO_EXTENSION,
        sample_time=float(block.dt) if is_timed else law.sample_time))


@overload
def as_checks_see(robot: Robot) -> Robot: ...
@overload
def as_checks_see(robot: Robot | None) -> Robot | None: ...
def as_checks_see(robot: Robot | None) -> Robot | None:
    """Robot whose law is unknown where it runs as a block, which checks do not."""
    if robot is None or not robot.controller.is_block:
        return robot
    return dataclasses.replace(robot, controller=dataclasses.replace(
        robot.controller, law="unknown", block=None, velocity_of=None, **NO_EXTENSION))


def speaks_of_torque(robot: Robot) -> bool:
    """Whether a robot file states gains of its law, or anything in kg m^2, kg or N m."""
    motor = dataclasses.asdict(robot.motor)
    del motor["gear_ratio"], motor["coupling"]
    return (robot.controller.law != "unknown" or robot.links.mass is not None
            or robot.tree is not None or any(value is not None for value in motor.values()))
