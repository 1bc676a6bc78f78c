"""The section [controller] of a robot file: the control law that ran on the robot."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.records.fields import file_field
from clie_blocks.errors import RecordError
from clie_blocks.linear_filters import DISCRETISATIONS

if TYPE_CHECKING:
    from control import InputOutputSystem
from clie_blocks.analysis.records.section import Section

LAWS = ("pd", "pid", "cascade", "servo", "unknown")
PROGRAM = "program"  # a law that is given as a block
HOLDS = ("conditional", "back_calculation", "none")
COMPENSATIONS = ("gravity", "inverse_dynamics", "pd_plus", "computed_torque")
FEEDFORWARD = ("velocity", "acceleration", "coulomb", "width_rad_s")
REFERENCE_RATES = ("difference", "trajectory", "filtered")
SIGNAL_FILTER = ("lowpass_rad_s", "notch_rad_s", "notch_width")
MODEL_SHARES = ("mass", "rotor", "friction")
EXTENDED = ("pd", "pid", "cascade")  # laws that take the keys of `EXTENSIONS`
COMMANDED, MEASURED, COMPUTED = SOURCES = ("commanded", "measured", "computed")
_OTHER_WORDS = {"command": COMMANDED, "measured torque": MEASURED}  # for the same
FILTERS = ("two_corner", "two_tap", "difference", "exact")
EXTENSIONS = ("compensation", "feedforward", "error_filter", "command_filter", "dead_band",
              "punch", "command_rate", "position_every")
NO_EXTENSION: dict[str, None] = dict.fromkeys(EXTENSIONS)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Controller(Section):
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
