"""Robots to calibrate on, drawn at random; `plant.simulate` moves them.

Single joints may carry a pendulum; robots with more joints have no link terms.
"""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.calibration.plant import PERIOD, simulate
from clie_blocks.analysis.records import Record
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.robot_sections import Encoder, Experiment, Links, Motor, Nominal

EXCITATIONS = ("triangle", "multisine", "steps", "chirp", "paper_pe")
KINDS = ("single",) * 9 + ("none", "parametric") + ("pair",) * 3 + ("triple",) + ("unknown",) * 4
UNKNOWN = ("random_torque", "modulated_damping", "varying_stiffness", "lost_commands",
           "wavy_friction", "soft_stop", "heating", "sag", "hidden_integral", "scaled_gain")
_COUNT = {"single": 1, "pair": 2, "triple": 3}


@dataclasses.dataclass(frozen=True, eq=False)
class Case:
    """One simulated robot with the truth about it.

    Parameters
    ----------
    robot : Robot
        What an engineer would know.
    records : list of Record
        Three logs.
    causes : dict
        Effect -> joint, counted from 1; empty for a healthy robot; ``unknown`` for an effect that
        the library does not hold, ``parametric`` for joints outside their datasheet.

    """

    robot: Robot
    records: list[Record]
    causes: dict[str, int | None]


Joint = dict[str, Any]
"""Parameters of a joint, as `plant.simulate` reads them."""
Setter = Callable[[np.random.Generator, Joint], None]
"""What puts an effect of drawn size into a joint."""


def draw_cases(count: int, seed: int | Sequence[int], causes: Sequence[str],
               kinds: Sequence[str] = KINDS, duration: float = 20.0, size: float = 1.0,
               ) -> list[Case]:
    """Return robots with drawn effects.

    Parameters
    ----------
    count : int
        Number of robots.
    seed : int
        Of all random numbers.
    causes : sequence of str
        Effects to draw from, see `EFFECTS`.
    kinds : sequence of str
        Drawn from evenly: ``single``, ``pair``, ``triple``, ``none``, ``parametric``,
        ``unknown``.
    duration : float
        Of each of the three logs [s].
    size : float
        Factor on all effects.

    """
    rng = np.random.default_rng(seed)
    drawn = [_draw(rng, causes, kinds, duration, size) for _ in range(count)]
    lanes = [lane for case in drawn for log in case["logs"] for lane in log]
    q, u = simulate(lanes, rng)
    cases, first = [], 0
    for case in drawn:
        records = []
        for j, log in enumerate(case["logs"]):
            part = slice(first, first + len(log))
            first += len(log)
            records.append(as_record(j, log, q[:, part], u[:, part]))
        cases.append(Case(as_robot(case["joints"]), records, case["truth"]))
    return cases


def _draw(rng: np.random.Generator, causes: Sequence[str], kinds: Sequence[str], duration: float,
          size: float) -> dict[str, Any]:
    """Joints, logs and truth of one robot."""
    n = int(rng.choice([1, 1, 2, 3]))
    joints = [{**_joint(rng, pendulum=n == 1), "size": size} for _ in range(n)]
    kind = rng.choice(kinds)
    truth: dict[str, int | None] = {}
    if kind == "unknown":
        joints[rng.integers(n)][str(rng.choice(UNKNOWN))] = size * float(rng.uniform(0.5, 2.0))
        truth["unknown"] = None
    elif kind == "parametric":
        joints[rng.integers(n)]["damping"] *= 1 + rng.choice([-1, 1]) * rng.uniform(0.2, 0.4)
        truth["parametric"] = None
    elif kind in _COUNT:
        for name in rng.choice(causes, min(_COUNT[kind], len(causes)), replace=False):
            k = int(rng.integers(n))
            EFFECTS[name](rng, joints[k])
            truth[str(name)] = k + 1
    logs = []
    for excitation in rng.choice(EXCITATIONS, 3, replace=False):
        logs.append([{**joint, **_motion(rng, joint, excitation, duration)} for joint in joints])
    return {"joints": joints, "logs": logs, "truth": truth}


def _joint(rng: np.random.Generator, pendulum: bool) -> Joint:
    ratio = float(rng.choice([1.0, 10.0, 30.0, 60.0, 100.0, 160.0]))
    inertia = float(np.exp(rng.uniform(np.log(2e-3), np.log(2.0))))
    joint = {"ratio": ratio, "rate": float(rng.uniform(0.5, 4.0)), "nominal_inertia": inertia}
    speed = rng.uniform(2.0, 6.0)  # rad/s of the closed loop
    joint["kp"] = inertia * speed**2
    joint["kd"] = inertia * speed * rng.uniform(1.0, 2.0)
    joint["weight"] = joint["kp"] * rng.uniform(0.05, 0.4) if pendulum else 0.0
    joint["link"] = inertia * rng.uniform(0.05, 0.4) if pendulum else inertia / 3
    joint["inertia"] = inertia * (1 + rng.uniform(-0.01, 0.01))
    joint["damping"] = inertia * joint["rate"] * (1 + rng.uniform(-0.15, 0.15))
    joint["offset"] = joint["kp"] * rng.uniform(-0.01, 0.01)
    joint["lsb"] = float(rng.choice([2e-5, 5e-5, 1e-4]))
    joint["sigma"] = joint["lsb"] * rng.uniform(0.5, 2.0)
    joint["start"] = float(rng.uniform(-1.5, 0.5))
    return joint


def _motion(rng: np.random.Generator, joint: Joint, excitation: str, duration: float,
            ) -> dict[str, Any]:
    t = PERIOD * np.arange(round(duration / PERIOD))
    torque, angle = 0.3 * joint["kp"], rng.uniform(0.2, 0.5)
    q_d, pe = np.full(len(t), joint["start"]), np.zeros(len(t))
    if excitation == "triangle":
        q_d = q_d + angle * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * t / rng.uniform(5.0, 12.0)))
    elif excitation == "steps":
        levels = rng.uniform(-angle, angle, 40)
        levels[0] = 0.0
        q_d = q_d + levels[(t / rng.uniform(2.0, 4.0)).astype(int)]
    elif excitation == "chirp":
        rise = np.log(6.0 / 0.1)
        pe = torque * np.sin(2 * np.pi * 0.1 * duration / rise
                             * (np.exp(t / duration * rise) - 1.0))
    elif excitation == "multisine":
        tones = np.geomspace(0.06, 4.0, 9) * rng.uniform(0.9, 1.1, 9)
        phase = rng.uniform(0.0, 2 * np.pi, 9)
        fade = np.minimum(t / 0.5, 1.0)
        pe = 0.35 * torque * fade * np.sin(2 * np.pi * np.outer(t, tones) + phase).sum(axis=1)
    else:
        pe = torque * (0.7 * np.sin(2 * np.pi * t) + 0.5 * np.sin(np.pi * t)
                       - 0.25 * np.cos(np.pi * t))
    return {"q_d": np.round(q_d, 4), "pe": np.round(pe, 8), "excitation": excitation}


def _size(rng: np.random.Generator) -> float:
    return float(np.exp(rng.uniform(np.log(0.002), np.log(0.05))))


def _harmonic(rng: np.random.Generator, ratio: float) -> float:
    """A harmonic of the motor's turn, high enough to show within the travel."""
    return ratio * float(np.ceil(rng.uniform(15.0, 40.0) / ratio))


def _set(**values: tuple[str, float]) -> Setter:
    """Effect whose parameters are a share of the joint's own scale, of drawn size."""
    def put(rng: np.random.Generator, joint: Joint) -> None:
        scale = {"torque": 0.3 * joint["kp"], "inertia": joint["inertia"], "one": 1.0}
        for name, (unit, factor) in values.items():
            joint[name] = scale[unit] * factor * joint["size"] * _size(rng)
    return put


EFFECTS: dict[str, Setter] = {
    "coulomb": _set(forward=("torque", 1.0)),
    "quadratic_drag": _set(quadratic=("inertia", 20.0)),
    "spring": _set(spring=("torque", 1.0)),
    "actuator_lag": _set(lag=("one", 0.2)),
    "time_delay": _set(delay=("one", 0.2)),
    "dead_zone": _set(dead=("torque", 1.0)),
    "actuator_saturation": lambda rng, j: j.update(limit=0.3 * j["kp"] * rng.uniform(0.5, 1.2)),
    "torque_gain_error": lambda rng, j: j.update(gain=1 + rng.choice([-1, 1]) * j["size"]
                                               * rng.uniform(0.05, 0.25)),
    "torque_ripple": lambda rng, j: j.update(ripple=0.3 * j["kp"] * j["size"] * _size(rng),
                                             order=_harmonic(rng, j["ratio"])),
    "encoder_eccentricity": lambda rng, j: j.update(eccentric=j["size"] * float(
        rng.uniform(5e-4, 4e-3))),
    "periodic_disturbance": lambda rng, j: j.update(tone=0.3 * j["kp"] * j["size"] * _size(rng),
                                                    tone_hz=float(rng.uniform(0.3, 5.0))),
    "step_fault": lambda rng, j: j.update(step=0.3 * j["kp"] * j["size"] * _size(rng),
                                          step_at=float(rng.uniform(5.0, 15.0))),
    "friction_drift": lambda rng, j: j.update(drift=j["damping"] * j["size"]
                                              * rng.uniform(0.2, 0.8), drift_time=float(
                                                  rng.uniform(4.0, 30.0))),
    "stribeck": lambda rng, j: j.update(forward=0.3 * j["kp"] * j["size"] * _size(rng),
                                        excess=float(rng.uniform(0.4, 1.0)),
                                        stribeck=float(rng.uniform(0.01, 0.06))),
    "asymmetric_coulomb": lambda rng, j: j.update(forward=0.3 * j["kp"] * j["size"] * _size(rng),
                                                  asymmetry=float(rng.uniform(0.3, 0.8))),
}


def as_record(j: int, log: Sequence[Joint], q: np.ndarray, u: np.ndarray) -> Record:
    """Record of log j, from the lanes of its joints, positions [rad] and commands [N m] (N, n)."""
    return Record(time=PERIOD * np.arange(len(q)), q=q, u=u, source=f"log-{j + 1}",
                  qd=np.stack([lane["q_d"] for lane in log], axis=1),
                  pe=np.stack([lane["pe"] for lane in log], axis=1))


def as_robot(joints: Sequence[Joint]) -> Robot:
    """What an engineer would know of a robot to calibrate on, from its drawn joints."""
    n = len(joints)

    def column(key: str) -> np.ndarray:
        return np.array([joint[key] for joint in joints])

    ratio, inertia, link = column("ratio"), column("nominal_inertia"), column("link")
    links = Links()
    if n == 1:  # a point mass on a rod that weighs and resists as the lane says
        length = 9.81 * link / column("weight")
        links = Links(length=length, com=length, mass=link * ratio / length**2,
                      inertia=np.zeros(1), joint_viscous_friction=np.zeros(1))
    else:
        link = 0.0 * link
    return Robot(
        n=n, name="simulated", links=links, nominal=Nominal(gravity=n == 1, coupling=False),
        motor=Motor(gear_ratio=ratio, inertia=(inertia - link) / ratio,
                    viscous_friction=inertia * column("rate") / ratio, inertia_tolerance=0.01,
                    viscous_friction_tolerance=0.15,
                    torque_offset_tolerance=0.01 * column("kp")),
        controller=Controller(law="pd", kp=column("kp"), kd=column("kd"), highpass=200.0,
                              lowpass=300.0, discretisation="tustin", sample_time=PERIOD,
                              command_resolution=2e-4 * column("kp")),
        encoder=Encoder(shaft_ratio=np.array([10.0]), resolution=column("lsb")),
        experiments={f"log-{j + 1}": Experiment(start=column("start")) for j in range(3)})
