"""Laws that robots of the study run under: with random numbers, and as their owners state them.

Each kind is drawn for a robot whose plain PD law is well damped.  Wrong statements are those of
an owner who knows the gains and not the rest, or, of a plain law, old gains.
"""

import dataclasses
from collections.abc import Callable

import numpy as np

from clie_blocks.analysis.blind.laws import control_laws as laws
from clie_blocks.analysis.blind.laws.arm import Arm
from clie_blocks.analysis.blind.laws.control_laws import WIDTH, Gains, Law

Statement = dict[str, str]  # keys of [controller] and their values, as TOML
Numbers = dict[str, np.ndarray]


@dataclasses.dataclass(frozen=True, eq=False)
class Bench:
    """A robot that a law is drawn for.

    Parameters
    ----------
    arm : Arm
        Its numbers.
    kp, kd : ndarray, shape (n,)
        Gains of its PD law, motor side [N m/rad, N m s/rad].
    peak, fastest : ndarray, shape (n,)
        Largest command of that law, and its largest rate [N m, N m/s].

    """

    arm: Arm
    kp: np.ndarray
    kd: np.ndarray
    peak: np.ndarray
    fastest: np.ndarray

    def pd(self, **more: Gains) -> Law:
        """Its PD law, with feedforward."""
        return laws.pd(self.kp, self.kd, **more)


@dataclasses.dataclass(frozen=True, eq=False)
class DrawnLaw:
    """A law with its numbers.

    Parameters
    ----------
    start : callable
        Returns the law at the start of an experiment.
    right, wrong : dict
        Statements that are right, and wrong.
    words : tuple of str
        Ways in which an answer may say what the wrong statement lacks.
    numbers : dict of str to ndarray, shape (n,)
        Numbers of the law that an answer has to find, by the parameter of the block.

    """

    start: Callable[[], Law]
    right: Statement
    wrong: Statement
    words: tuple[str, ...]
    numbers: Numbers


def row(values: np.ndarray) -> str:
    """TOML list of numbers, with all digits."""
    return "[" + ", ".join(repr(float(value)) for value in np.atleast_1d(values)) + "]"


def pd_statement(kp: np.ndarray, kd: np.ndarray, **more: str) -> Statement:
    """Statement of a PD law."""
    return {"law": '"pd"', "Kp": row(kp), "Kd": row(kd), "velocity_filter": '"difference"', **more}


def _pid_statement(bench: Bench, ki: np.ndarray, **more: str) -> Statement:
    return pd_statement(bench.kp, bench.kd, law='"pid"', Ki=row(ki), **more)


def _fed(**numbers: np.ndarray) -> Statement:
    given = ", ".join(f"{key} = {row(value)}" for key, value in numbers.items())
    return {"feedforward": f"{{ {given} }}", "reference_rate": '"trajectory"'}


def _integral(rng: np.random.Generator, gain: np.ndarray) -> np.ndarray:
    return gain * rng.uniform(1.0, 3.0, len(gain))


def old_gains(rng: np.random.Generator, bench: Bench) -> DrawnLaw:
    """PD whose gains were changed since the file was written."""
    factor = np.exp(rng.choice((-1.0, 1.0)) * rng.uniform(0.1, 0.4))
    return DrawnLaw(bench.pd, pd_statement(bench.kp, bench.kd),
                    pd_statement(bench.kp * factor, bench.kd / factor),
                    ("gains that ran", "the law that ran is PD ("),
                    {"kp": bench.kp, "kd": bench.kd})


def velocity_of_error(rng: np.random.Generator, bench: Bench) -> DrawnLaw:
    """PD that damps the velocity of the error."""
    return DrawnLaw(lambda: laws.pd_of_error(bench.kp, bench.kd),
                    pd_statement(bench.kp, bench.kd, velocity_of='"error"'),
                    pd_statement(bench.kp, bench.kd),
                    ("velocity of the error", "feedforward of velocity", "control_law_form"), {})


def integral(rng: np.random.Generator, bench: Bench) -> DrawnLaw:
    """PID."""
    ki = _integral(rng, bench.kp)
    return DrawnLaw(lambda: laws.pid(bench.kp, ki, bench.kd), _pid_statement(bench, ki),
                    pd_statement(bench.kp, bench.kd), ("is PID (", "integral part"), {"ki": ki})


def _limit(rng: np.random.Generator, bench: Bench) -> np.ndarray:
    """A limit that the motion meets [N m]."""
    return np.round(bench.peak * rng.uniform(0.5, 0.75, bench.arm.n), 4)


def limit(rng: np.random.Generator, bench: Bench) -> DrawnLaw:
    """PD within a limit that nobody stated."""
    most = _limit(rng, bench)
    return DrawnLaw(lambda: laws.pid(bench.kp, 0.0, bench.kd, most),
                    pd_statement(bench.kp, bench.kd, saturation_nm=row(most)),
                    pd_statement(bench.kp, bench.kd), ("with a limit of",), {})


def integral_at_its_limit(rng: np.random.Generator, bench: Bench) -> DrawnLaw:
    """PID whose integral stands still at its limit, stated as PD without one."""
    most, ki = _limit(rng, bench), _integral(rng, bench.kp)
    return DrawnLaw(lambda: laws.pid(bench.kp, ki, bench.kd, most),
                    _pid_statement(bench, ki, saturation_nm=row(most)),
                    pd_statement(bench.kp, bench.kd), ("PID with a limit",), {"ki": ki})


def integral_that_winds_up(rng: np.random.Generator, bench: Bench) -> DrawnLaw:
    """PID whose integral winds up at its limit, stated as one that stands still there."""
    most, ki = _limit(rng, bench), _integral(rng, bench.kp)
    return DrawnLaw(lambda: laws.pid(bench.kp, ki, bench.kd, most, holds=False),
                    _pid_statement(bench, ki, saturation_nm=row(most), anti_windup='"none"'),
                    _pid_statement(bench, ki, saturation_nm=row(most)), ("winds up",),
                    {"ki": ki})


def _cascade(rng: np.random.Generator, bench: Bench) -> tuple[np.ndarray, np.ndarray, Statement]:
    """Gains of a cascade that is as stiff as PD, and its statement."""
    kp, ki = bench.kp / bench.kd, _integral(rng, bench.kd)
    return kp, ki, {"law": '"cascade"', "Kp": row(kp), "Kv": row(bench.kd), "Ki": row(ki),
                    "velocity_filter": '"difference"'}


def cascade(rng: np.random.Generator, bench: Bench) -> DrawnLaw:
    """Position P around velocity PI, stated without its integral."""
    kp, ki, right = _cascade(rng, bench)
    wrong = {key: value for key, value in right.items() if key != "Ki"}
    return DrawnLaw(lambda: laws.cascade(kp, bench.kd, ki), right, wrong, ("a cascade",),
                    {"ki": ki})


def slower_position_loop(rng: np.random.Generator, bench: Bench) -> DrawnLaw:
    """A cascade whose position loop runs every few samples, stated as if at each."""
    kp, ki, wrong = _cascade(rng, bench)
    every = int(rng.integers(2, 6))
    return DrawnLaw(lambda: laws.cascade(kp, bench.kd, ki, every),
                    wrong | {"position_every": str(every)}, wrong,
                    (f"each {every} samples",), {})


def feedforward(rng: np.random.Generator, bench: Bench) -> DrawnLaw:
    """Feedforward of the reference's velocity."""
    velocity = bench.kd * rng.uniform(0.5, 1.1, bench.arm.n)
    return DrawnLaw(lambda: bench.pd(velocity=velocity),
                    pd_statement(bench.kp, bench.kd, **_fed(velocity=velocity)),
                    pd_statement(bench.kp, bench.kd),
                    ("feedforward of velocity (",), {"feedforward_velocity": velocity})


def feedforward_of_acceleration(rng: np.random.Generator, bench: Bench) -> DrawnLaw:
    """Feedforward of velocity and acceleration."""
    velocity = bench.kd + bench.arm.damping / bench.arm.gear
    acceleration = bench.arm.inertia / bench.arm.gear * rng.uniform(0.7, 1.0, bench.arm.n)
    fed = {"velocity": velocity, "acceleration": acceleration}
    return DrawnLaw(lambda: bench.pd(**fed), pd_statement(bench.kp, bench.kd, **_fed(**fed)),
                    pd_statement(bench.kp, bench.kd), ("acceleration", "dynamics"),
                    {"feedforward_acceleration": acceleration})


def feedforward_of_friction(rng: np.random.Generator, bench: Bench) -> DrawnLaw:
    """Feedforward of velocity and of a dry friction."""
    coulomb = 0.2 * bench.peak * rng.uniform(0.5, 1.0, bench.arm.n)
    fed = {"velocity": bench.kd, "coulomb": coulomb}
    stated = _fed(**fed, width_rad_s=np.full(bench.arm.n, WIDTH))
    return DrawnLaw(lambda: bench.pd(**fed), pd_statement(bench.kp, bench.kd, **stated),
                    pd_statement(bench.kp, bench.kd), ("friction",),
                    {"feedforward_coulomb": coulomb})


def weight(rng: np.random.Generator, bench: Bench) -> DrawnLaw:
    """PD that holds the weight of the links."""
    return DrawnLaw(lambda: laws.with_weight(bench.pd(), bench.arm),
                    pd_statement(bench.kp, bench.kd, compensation='"gravity"'),
                    pd_statement(bench.kp, bench.kd), ("weight",), {})


def _with_model(form: str, share: float, n: int) -> Statement:
    each = row(np.full(n, share))
    shares = ", ".join(f"{key} = {each}" for key in ("mass", "rotor", "friction"))
    return {"compensation": f'"{form}"', "model_shares": f"{{ {shares} }}",
            "reference_rate": '"trajectory"'}


def inverse_dynamics(rng: np.random.Generator, bench: Bench) -> DrawnLaw:
    """PD beside the torque that the reference needs, by a model that is off."""
    share = float(rng.uniform(0.8, 1.1))
    start = {"velocity": bench.kd}
    return DrawnLaw(
        lambda: laws.with_inverse_dynamics(bench.pd(**start), bench.arm, share),
        pd_statement(bench.kp, bench.kd, **_fed(**start)
                     | _with_model("inverse_dynamics", share, bench.arm.n)),
        pd_statement(bench.kp, bench.kd), ("dynamics", "acceleration"), {})


def computed_torque(rng: np.random.Generator, bench: Bench) -> DrawnLaw:
    """Computed torque with a model that is off, stated as PD."""
    share = float(rng.uniform(0.8, 1.1))
    kp, kd = (gain * bench.arm.gear / bench.arm.inertia for gain in (bench.kp, bench.kd))
    right = pd_statement(kp, kd, **_fed(velocity=kd)
                         | _with_model("computed_torque", share, bench.arm.n))
    return DrawnLaw(lambda: laws.computed_torque(bench.arm, kp, kd, share), right,
                    pd_statement(bench.kp, bench.kd), ("computed torque", "PD+"), {})


def command_low_pass(rng: np.random.Generator, bench: Bench) -> DrawnLaw:
    """A low-pass behind the law."""
    corner = rng.uniform(120.0, 300.0, bench.arm.n)
    return DrawnLaw(lambda: laws.with_low_pass(bench.pd(), corner), pd_statement(
        bench.kp, bench.kd, command_filter=f"{{ lowpass_rad_s = {row(corner)} }}"),
        pd_statement(bench.kp, bench.kd), ("low-pass of the command",),
        {"command_lowpass": corner})


def error_low_pass(rng: np.random.Generator, bench: Bench) -> DrawnLaw:
    """A low-pass of the error."""
    corner = rng.uniform(80.0, 200.0, bench.arm.n)
    return DrawnLaw(lambda: laws.with_error_low_pass(bench.pd(), corner), pd_statement(
        bench.kp, bench.kd, error_filter=f"{{ lowpass_rad_s = {row(corner)} }}"),
        pd_statement(bench.kp, bench.kd), ("low-pass of the error",), {"error_lowpass": corner})


def rate_limit(rng: np.random.Generator, bench: Bench) -> DrawnLaw:
    """A limit of the command's rate."""
    largest = np.round(bench.fastest * rng.uniform(0.4, 0.7, bench.arm.n), 3)
    return DrawnLaw(lambda: laws.with_rate_limit(bench.pd(), largest),
                    pd_statement(bench.kp, bench.kd, command_rate_nm_s=row(largest)),
                    pd_statement(bench.kp, bench.kd), ("limit of its rate",), {})


Draw = Callable[[np.random.Generator, Bench], DrawnLaw]
KINDS: dict[str, Draw] = {draw.__name__: draw for draw in (
    old_gains, velocity_of_error, integral, limit, integral_at_its_limit, integral_that_winds_up,
    cascade, slower_position_loop, feedforward, feedforward_of_acceleration,
    feedforward_of_friction, weight, inverse_dynamics, computed_torque, command_low_pass,
    error_low_pass, rate_limit)}
WITH_GRAVITY = ("weight", "inverse_dynamics", "computed_torque")
