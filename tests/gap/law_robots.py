"""Small robots of MuJoCo under control laws of many kinds, with the logs and files of an owner.

The laws are those of the blind study, sample by sample, and use no block of the package.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from clie_blocks.analysis.blind.laws import control_laws
from clie_blocks.analysis.blind.laws.arm import Arm
from clie_blocks.analysis.blind.laws.control_laws import (
    Law,
    Signals,
    cascade,
    servo,
    with_low_pass,
)
from clie_blocks.analysis.blind.laws.run import Reference

PERIOD, SUBSTEPS = 2e-3, 4  # s, steps of the engine per period
NOISE, STEP = 2e-5, 1e-4  # rad, N m: of the encoder, and rounding of the command
NOISE_OF_SPEED, NOISE_OF_TORQUE = 2e-3, 1e-3  # rad/s, N m, of a drive that measures them
ARMATURE, DAMPING, MASS, LENGTH = 0.05, 0.08, 0.4, 0.3  # kg m^2, N m s/rad, kg, m
COM, G = LENGTH / 2, 9.81
SPIN = MASS * LENGTH**2 / 12
KP, KD = 30.0, 1.6
FRICTION, DELAY, BACKLASH = 0.25, 3, 0.012  # N m, periods, rad
ALONE = ARMATURE + SPIN + MASS * COM**2  # kg m^2, of a single joint


def model_text(n: int, effect: str, gravity: bool) -> str:
    """The robot for MuJoCo: joints in one vertical plane, at the horizontal at zero."""
    loose = effect == "backlash"
    text, closing = "", ""
    for k in range(n):
        friction = FRICTION if effect == "coulomb" and k == 0 else 0.0
        place = f"{LENGTH if k else 0} 0 0"
        text += f'<body pos="{place}">'
        if loose and k == 0:
            text += (f'<joint name="motor{k}" axis="0 -1 0" armature="{ARMATURE}" '
                     f'damping="{DAMPING}"/><inertial pos="0 0 0" mass="1e-5" '
                     'diaginertia="1e-6 1e-6 1e-6"/><body pos="0 0 0">'
                     f'<joint name="joint{k}" axis="0 -1 0" limited="true" range="{-BACKLASH / 2} '
                     f'{BACKLASH / 2}" solreflimit="-2e5 -40"/>')
            closing += "</body>"
        else:
            text += (f'<joint name="motor{k}" axis="0 -1 0" armature="{ARMATURE}" '
                     f'damping="{DAMPING}" frictionloss="{friction}"/>')
        text += (f'<inertial pos="{COM} 0 0" mass="{MASS}" diaginertia="{SPIN} {SPIN} {SPIN}"/>')
        closing += "</body>"
    motors = "".join(f'<motor joint="motor{k}"/>' for k in range(n))
    return (f'<mujoco><compiler angle="radian"/><option timestep="{PERIOD / SUBSTEPS}" '
            f'gravity="0 0 {-G if gravity else 0}" integrator="RK4"/><worldbody>'
            f"{text}{closing}</worldbody><actuator>{motors}</actuator></mujoco>")


def run(law: Law, n: int = 1, effect: str = "", seed: int = 0, seconds: float = 8.0,
        gravity: bool = False, fastest: float = 1.6,
        torque: Callable[[np.ndarray, np.ndarray], np.ndarray] = lambda u, dq: u,
        step: float = STEP, sensor_lag: float = 0.0, senses_torque: bool = False,
        ) -> dict[str, np.ndarray]:
    """Log of one experiment: time, q, u, qd; and dq, where a drive measures it behind a lag.

    A drive that senses its torque gives the law that of the sample before, and logs it as tau.
    """
    import mujoco

    model = mujoco.MjModel.from_xml_string(model_text(n, effect, gravity))
    data = mujoco.MjData(model)
    rng = np.random.default_rng(1000 + seed)
    reference = Reference(np.random.default_rng(seed), n, fastest)
    motors = [model.joint(f"motor{k}").qposadr[0] for k in range(n)]
    loose = [model.joint(f"joint{k}").qposadr[0] for k in range(n) if effect == "backlash"
             and k == 0]
    sent: list[np.ndarray] = [np.zeros(n)] * DELAY
    last, rows, speed, given = None, [], np.zeros(n), np.zeros(n)
    pole = np.exp(-PERIOD / SUBSTEPS / sensor_lag) if sensor_lag else 0.0
    for k in range(round(seconds / PERIOD)):
        q = data.qpos[motors].copy()
        if loose:
            q[0] += data.qpos[loose[0]]
        q = np.round(q + NOISE * rng.normal(size=n), 7)
        q_d, dq_d, ddq_d = reference(k * PERIOD)
        q_d = np.round(q_d, 9)
        rate = (q - (q if last is None else last)) / PERIOD
        if sensor_lag:
            rate = np.round(speed + NOISE_OF_SPEED * rng.normal(size=n), 5)
        now = Signals(q_d, dq_d, ddq_d, q, rate)
        tau = np.round(given + NOISE_OF_TORQUE * rng.normal(size=n), 6) if senses_torque else None
        u = np.rint((law(now) if tau is None else law(now, tau)) / step) * step
        last = q
        sent.append(u)
        acting = sent[-1 - DELAY] if effect == "delay" else u
        for _ in range(SUBSTEPS):
            data.ctrl[:] = given = torque(acting, data.qvel[motors])
            mujoco.mj_step(model, data)
            speed = pole * speed + (1.0 - pole) * data.qvel[motors]
        measured = [*([rate] if sensor_lag else []), *([tau] if senses_torque else [])]
        rows.append(np.concatenate([[k * PERIOD], q, u, q_d, *measured]))
    table = np.array(rows)
    names = ("q", "u", "qd", *(["dq"] if sensor_lag else []), *(["tau"] if senses_torque else []))
    return {"time": table[:, 0], **{name: table[:, 1 + n * i:1 + n * (i + 1)]
                                    for i, name in enumerate(names)}}


def pd(kp: float = KP, kd: float = KD, **fed: float) -> Law:
    """PD with feedforward of the reference."""
    return control_laws.pd(kp, kd, **fed)


def pid(ki: float, limit: float = np.inf, held: bool = True, velocity: float = 0.0,
        kp: float = KP, kd: float = KD) -> Law:
    """PID on the joint's velocity; the integral stands still at the limit, or winds up."""
    return control_laws.pid(kp, ki, kd, limit, held, velocity)


def computed_torque(n: int, off: float, kp: float = 250.0, kd: float = 22.0) -> Law:
    """Computed torque of an arm of one or two links, by a model that is off by a factor."""
    every = np.ones(n)
    arm = Arm(MASS * every, LENGTH * every, ARMATURE * every, DAMPING * every, every, True)
    return control_laws.computed_torque(arm, kp, kd, off)


CARRIED, WIDTH = 0.05, 0.05  # N m, rad/s: dry friction that a law carries, by its velocity


def pid_that_carries_friction(ki: float, kp: float = KP, kd: float = KD,
                              carried: float = CARRIED) -> Law:
    """PID on the joint's velocity, which also carries some dry friction by its direction."""
    plain = control_laws.pid(kp, ki, kd)
    return lambda now: plain(now) + carried * np.tanh(now.rate / WIDTH)


TORQUE_RATE = 30.0  # 1/s, of a loop around the torque


def pd_around_torque(kp: float = KP, kd: float = KD) -> Callable[..., np.ndarray]:
    """PD whose torque an integral brings about, by the torque that the drive senses."""
    total = np.zeros(1)

    def law(now: Signals, tau: np.ndarray) -> np.ndarray:
        nonlocal total
        wanted = kp * (now.q_d - now.q) - kd * now.rate
        u = wanted + total
        total = total + TORQUE_RATE * PERIOD * (wanted - tau)
        return u

    return law


TORQUE_PROGRAM = f'''import control as ct
import numpy as np


def wanted(x, u, params):
    q_d, q = u[:1], u[1:2]
    return params["kp"] * (q_d - q) - params["kd"] * (q - x[1:]) / {PERIOD}


def update(t, x, u, params):
    return np.concatenate(
        [x[:1] + params["rate"] * {PERIOD} * (wanted(x, u, params) - u[2:]), u[1:2]])


controller = ct.nlsys(
    update, lambda t, x, u, params: wanted(x, u, params) + x[:1], name="torque loop", dt={PERIOD},
    states=2, params={{"kp": {KP}, "kd": {KD}, "rate": {TORQUE_RATE}}},
    inputs=["q_d[0]", "q[0]", "tau[0]"], outputs=["u[0]"])
'''


def program_text(**gains: float) -> str:
    """The same law as a user writes it, on the velocity that the drive measures."""
    stated = {"kp": KP, "ki": 60.0, "kd": KD, "carried": CARRIED, **gains}
    return f'''import control as ct
import numpy as np


def total(t, x, u, params):
    return x + {PERIOD} * (u[:1] - u[1:2])


def command(t, x, u, params):
    q_d, q, dq = u[:1], u[1:2], u[2:]
    return (params["kp"] * (q_d - q) + params["ki"] * total(t, x, u, params)
            - params["kd"] * dq + params["carried"] * np.tanh(dq / {WIDTH}))


controller = ct.nlsys(total, command, name="carrying", dt={PERIOD}, states=1, params={stated},
                      inputs=["q_d[0]", "q[0]", "dq[0]"], outputs=["u[0]"])
'''


def robot_text(n: int, controller: str, gravity: bool = False, motor: str = "") -> str:
    """The robot file; datasheet numbers are the true ones."""
    def row(value: float) -> str:
        return "[" + ", ".join([f"{value:g}"] * n) + "]"
    links = (f"[links]\nmass_kg = {row(MASS)}\nlength_m = {row(LENGTH)}\ncom_m = {row(COM)}\n"
             f"inertia_kgm2 = {row(SPIN)}\n[nominal]\ngravity = {str(gravity).lower()}\n"
             f"coupling = {str(n > 1).lower()}\n")
    return (f'name = "robot"\njoints = {n}\n[motor]\ngear_ratio = {row(1.0)}\ninertia_kgm2 = '
            f"{row(ARMATURE)}\ninertia_tolerance = 0.05\nviscous_friction_nms = {row(DAMPING)}\n"
            f"viscous_friction_tolerance = 0.1\n{motor}{links}[controller]\n"
            f"sample_time_s = {PERIOD}\n{controller}\n")


PD_TEXT = f'law = "pd"\nKp = {KP}\nKd = {KD}\nvelocity_filter = "difference"\n'
RESOLUTION = f"command_resolution_nm = {STEP}\n"
PID_TEXT = PD_TEXT.replace('"pd"', '"pid"') + "Ki = 60.0\n"
CASCADE_TEXT = ('law = "cascade"\nKp = 18.0\nKv = 1.7\nKi = 8.0\nvelocity_filter = "difference"\n')
SERVO_MOTOR = "torque_constant_nm_a = 0.6\nresistance_ohm = 2.0\n"
SUPPLY, K_T, OHM = 12.0, 0.6, 2.0
SERVO_TEXT = (f'law = "servo"\nKp = 6.0\nsupply_v = {SUPPLY}\nsaturation = 1.0\n'
              "command_resolution = 1e-4\n")


@dataclasses.dataclass(frozen=True)
class Robot:
    """A robot to log: its law anew for each experiment, what its file says, and the engine."""

    law: Callable[[], Law]
    controller: str
    n: int = 1
    gravity: bool = False
    motor: str = ""
    program: str = ""  # a law of the owner's, beside the robot file
    options: dict = dataclasses.field(default_factory=dict)

    def write(self, folder, effect: str = "", logs: int = 2, seconds: float = 8.0) -> None:
        """Write logs and robot file of an owner."""
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "robot.toml").write_text(
            robot_text(self.n, self.controller, self.gravity, self.motor))
        if self.program:
            name = "my_law.c" if ".c:" in self.controller else "my_law.py"
            (folder / name).write_text(self.program)
        unit = "[duty]" if "servo" in self.controller else ""
        for seed in range(logs):
            log = run(self.law(), self.n, effect, seed + 1, seconds, self.gravity, **self.options)
            names = [f"{name}{k + 1}{unit if name == 'u' else ''}" for name in log
                     if name != "time" for k in range(self.n)]
            table = np.column_stack(list(log.values()))
            np.savetxt(folder / f"log-{seed + 1}.csv", table, "%.10g", ",",
                       header=",".join(["time", *names]), comments="")


def _of_servo(u: np.ndarray, dq: np.ndarray) -> np.ndarray:
    return K_T * (SUPPLY * u - K_T * dq) / OHM


PROGRAM = 'law = "my_law.py:controller"\n' + RESOLUTION
UNKNOWN = 'law = "unknown"\n' + RESOLUTION
STATED_PD = PD_TEXT + RESOLUTION


def stated(text: str, *lines: str) -> str:
    """A statement with further lines."""
    return "\n".join((text.rstrip("\n"), *lines)) + "\n" + RESOLUTION


TRAJECTORY = 'reference_rate = "trajectory"'
LIMIT = "saturation_nm = 1.6"
# Law that ran -> the robot, and what a right file says of its law.
RIGHT: dict[str, str] = {
    "pd": STATED_PD, "pid": stated(PID_TEXT),
    "computed torque 15 % off": stated(
        PD_TEXT.replace("30.0", "250.0").replace("1.6", "22.0"), TRAJECTORY,
        'compensation = "computed_torque"', "feedforward = { velocity = 22.0 }",
        "model_shares = { mass = 0.85, rotor = 0.85, friction = 0.85 }"),
    "velocity feedforward": stated(PD_TEXT, f"feedforward = {{ velocity = {KD} }}", TRAJECTORY),
    "velocity feedforward of another gain": stated(
        PD_TEXT, f"feedforward = {{ velocity = {0.6 * KD} }}", TRAJECTORY),
    "acceleration feedforward": stated(
        PD_TEXT, f"feedforward = {{ velocity = {KD + DAMPING}, acceleration = {0.9 * ALONE} }}",
        TRAJECTORY),
    "friction feedforward": stated(
        PD_TEXT, f"feedforward = {{ velocity = {KD}, coulomb = 0.2, width_rad_s = 0.02 }}",
        TRAJECTORY),
    "PID at its limit": stated(PID_TEXT, LIMIT),
    "PID that winds up": stated(PID_TEXT, LIMIT, 'anti_windup = "none"'),
    "PD within a limit": stated(PD_TEXT, LIMIT),
    "cascade with a slower outer loop": stated(CASCADE_TEXT, "position_every = 4"),
    "command low-pass": stated(PD_TEXT, f"feedforward = {{ velocity = {KD} }}", TRAJECTORY,
                               "command_filter = { lowpass_rad_s = 180.0 }"),
    "hobby servo with dead band and punch": SERVO_TEXT + "dead_band_rad = 0.01\npunch = 0.04\n",
}
ROBOTS: dict[str, Robot] = {
    "pd": Robot(pd, STATED_PD),
    "pid": Robot(lambda: pid(60.0), stated(PID_TEXT)),
    "computed torque 15 % off": Robot(lambda: computed_torque(2, 0.85), STATED_PD, 2, True),
    "velocity feedforward": Robot(lambda: pd(velocity=KD), STATED_PD),
    "velocity feedforward of another gain": Robot(lambda: pd(velocity=0.6 * KD), STATED_PD),
    "acceleration feedforward": Robot(
        lambda: pd(velocity=KD + DAMPING, acceleration=0.9 * ALONE), STATED_PD),
    "friction feedforward": Robot(lambda: pd(velocity=KD, coulomb=0.2), STATED_PD),
    "PID at its limit": Robot(
        lambda: pid(60.0, limit=1.6), STATED_PD, options={"fastest": 2.0}),
    "PID that winds up": Robot(
        lambda: pid(60.0, limit=1.6, held=False), stated(PID_TEXT), options={"fastest": 2.0}),
    "PD within a limit": Robot(
        lambda: pid(0.0, limit=1.6), STATED_PD, options={"fastest": 2.0}),
    "cascade with a slower outer loop": Robot(
        lambda: cascade(18.0, 1.7, 8.0, every=4), stated(CASCADE_TEXT)),
    "command low-pass": Robot(lambda: with_low_pass(pd(velocity=KD), 180.0), STATED_PD),
    "hobby servo with dead band and punch": Robot(
        lambda: servo(6.0, 0.01, 0.04), SERVO_TEXT, motor=SERVO_MOTOR,
        options={"torque": _of_servo}),
    "PID, law unknown": Robot(lambda: pid(60.0, velocity=KD), UNKNOWN),
    "PD, law unknown": Robot(pd, UNKNOWN),
}


def rightly(name: str) -> Robot:
    """A robot whose file states its law as it is."""
    return dataclasses.replace(ROBOTS[name], controller=RIGHT[name])
