"""Robots to calibrate on: simulated by plain time stepping that shares no code with the diagnosis.

Every joint of every log of every robot is one lane of the same arrays.  Dry friction is Karnopp's:
inside a narrow band of speed a joint is held unless the torque on it exceeds the friction.  Single
joints may carry a pendulum; robots with more joints have no link terms.
"""

import dataclasses

import numpy as np

PERIOD = 1e-3  # s
SUBSTEPS = 4
HELD = 2e-4  # rad/s: speed below which friction holds
DELAY_ROOM = 64
EXCITATIONS = ("triangle", "multisine", "steps", "chirp", "paper_pe")
KINDS = ("single",) * 9 + ("none", "parametric") + ("pair",) * 3 + ("triple",) + ("unknown",) * 4
UNKNOWN = ("random_torque", "modulated_damping", "varying_stiffness", "lost_commands",
           "wavy_friction", "soft_stop", "heating", "sag", "hidden_integral", "scaled_gain")
SEVERAL = {"single": 1, "pair": 2, "triple": 3}


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

    robot: object
    records: list
    causes: dict


def cases(count, seed, causes, kinds=KINDS, duration=20.0, size=1.0):
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
    q, u = run(lanes, rng)
    made, at = [], 0
    for case in drawn:
        records = []
        for j, log in enumerate(case["logs"]):
            part = slice(at, at + len(log))
            at += len(log)
            records.append(_record(j, log, q[:, part], u[:, part]))
        made.append(Case(_robot(case), records, case["truth"]))
    return made


def _draw(rng, causes, kinds, duration, size):
    n = int(rng.choice([1, 1, 2, 3]))
    joints = [{**_joint(rng, pendulum=n == 1), "size": size} for _ in range(n)]
    kind = rng.choice(kinds)
    truth = {}
    if kind == "unknown":
        joints[rng.integers(n)][str(rng.choice(UNKNOWN))] = size * float(rng.uniform(0.5, 2.0))
        truth["unknown"] = None
    elif kind == "parametric":
        joints[rng.integers(n)]["damping"] *= 1 + rng.choice([-1, 1]) * rng.uniform(0.2, 0.4)
        truth["parametric"] = None
    elif kind in SEVERAL:
        for name in rng.choice(causes, min(SEVERAL[kind], len(causes)), replace=False):
            k = int(rng.integers(n))
            EFFECTS[name](rng, joints[k])
            truth[str(name)] = k + 1
    logs = []
    for excitation in rng.choice(EXCITATIONS, 3, replace=False):
        logs.append([{**joint, **_motion(rng, joint, excitation, duration)} for joint in joints])
    return {"joints": joints, "logs": logs, "truth": truth}


def _joint(rng, pendulum):
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


def _motion(rng, joint, excitation, duration):
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


def _size(rng):
    return float(np.exp(rng.uniform(np.log(0.002), np.log(0.05))))


def _harmonic(rng, ratio):
    """A harmonic of the motor's turn, high enough to show within the travel."""
    return ratio * float(np.ceil(rng.uniform(15.0, 40.0) / ratio))


def _set(**values):
    """Effect whose numbers are a share of the joint's own scale, of drawn size."""
    def put(rng, joint):
        scale = {"torque": 0.3 * joint["kp"], "inertia": joint["inertia"], "one": 1.0}
        for name, (unit, factor) in values.items():
            joint[name] = scale[unit] * factor * joint["size"] * _size(rng)
    return put


EFFECTS = {
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
_NEUTRAL = dict(forward=0.0, asymmetry=0.0, excess=0.0, stribeck=1.0, quadratic=0.0, spring=0.0,
                lag=0.0, delay=0.0, dead=0.0, limit=1e9, gain=1.0, ripple=0.0, order=1.0,
                eccentric=0.0, tone=0.0, tone_hz=1.0, step=0.0, step_at=1e9, drift=0.0,
                drift_time=1.0, random_torque=0.0, modulated_damping=0.0, varying_stiffness=0.0,
                lost_commands=0.0, wavy_friction=0.0, soft_stop=0.0, heating=0.0, sag=0.0,
                hidden_integral=0.0, scaled_gain=0.0)


def run(lanes, rng):
    """Simulate all lanes; returns measured positions and commands, shape (N, lanes)."""
    p = {key: np.array([lane.get(key, neutral) for lane in lanes])
         for key, neutral in _NEUTRAL.items()}
    p.update({key: np.array([lane[key] for lane in lanes])
              for key in ("inertia", "damping", "offset", "kp", "kd", "weight", "start", "lsb",
                          "sigma")})
    q_d = np.stack([lane["q_d"] for lane in lanes], axis=1)
    pe = np.stack([lane["pe"] for lane in lanes], axis=1)
    steps, count = q_d.shape
    q, dq = p["start"].copy(), np.zeros(count)
    queue, lagged = np.zeros((DELAY_ROOM, count)), np.zeros(count)
    past, filtered, last = np.zeros(count), np.zeros(count), None
    hit, slow, kept = np.zeros(count), np.zeros(count), np.zeros(count)
    heat, integral = np.zeros(count), np.zeros(count)
    high, low = 200.0 * PERIOD, 300.0 * PERIOD
    measured, commands = np.empty((steps, count)), np.empty((steps, count))
    for i in range(steps):
        seen = q + p["eccentric"] * np.sin(q) + p["sigma"] * rng.standard_normal(count)
        seen = p["lsb"] * np.round(seen / p["lsb"])
        last = seen if last is None else last
        fast = ((2 - high) * past + 2 * 200.0 * (seen - last)) / (2 + high)
        filtered = ((2 - low) * filtered + low * (fast + past)) / (2 + low)
        past, last = fast, seen
        u = p["kp"] * (q_d[i] - seen) - p["kd"] * filtered + pe[i]
        u = np.round(u / (2e-4 * p["kp"])) * 2e-4 * p["kp"]
        measured[i], commands[i] = seen, u
        lost = (rng.random(count) < 0.02 * p["lost_commands"]) | (hit > 0)
        hit = np.where(lost, np.where(hit > 0, hit - 1, 30), 0)
        kept = np.where(lost & (p["lost_commands"] > 0), kept, u)
        load = np.abs(kept) / (0.3 * p["kp"])
        heat, integral = heat + PERIOD * load**2, integral + PERIOD * (q_d[i] - seen)
        queue = np.roll(queue, 1, axis=0)
        queue[0] = (kept * (1 - p["sag"] * 0.1 * load - p["heating"] * 0.1 * heat / (heat + 1))
                    + p["kp"] * (0.05 * p["scaled_gain"] * (q_d[i] - seen)
                                 + 0.2 * p["hidden_integral"] * integral))
        late = np.minimum((p["delay"] / PERIOD).astype(int), DELAY_ROOM - 2)
        part, lane = p["delay"] / PERIOD - late, np.arange(count)
        drive = (1 - part) * queue[late, lane] + part * queue[late + 1, lane]
        slow += PERIOD * (-2 * np.pi * slow + 3.0 * rng.standard_normal(count) / np.sqrt(PERIOD))
        q, dq, lagged = _moved(i * PERIOD, q, dq, lagged, drive, slow, p)
    return measured, commands


def _moved(t, q, dq, lagged, drive, slow, p):
    h = PERIOD / SUBSTEPS
    for k in range(SUBSTEPS):
        now = t + k * h
        rate = np.where(p["lag"] > 0, 1 - np.exp(-h / np.maximum(p["lag"], 1e-9)), 1.0)
        lagged = lagged + rate * (drive - lagged)
        torque = p["gain"] * np.clip(lagged - np.clip(lagged, -p["dead"], p["dead"]),
                                     -p["limit"], p["limit"])
        smooth = torque - _opposing(now, q, dq, slow, p)
        level = p["forward"] * (1 + p["excess"] * np.exp(-(dq / p["stribeck"]) ** 2))
        level = level + 6e-3 * p["kp"] * p["wavy_friction"] * np.maximum(np.sin(9 * q), 0.0)
        level = level * np.where(np.where(dq == 0, smooth, dq) < 0, 1 - p["asymmetry"], 1.0)
        still = np.abs(dq) < HELD
        held = still & (np.abs(smooth) <= level)
        friction = np.where(still, np.sign(smooth), np.sign(dq)) * level
        after = dq + h * (smooth - friction) / p["inertia"]
        turned = ~still & (after * dq < 0) & (np.abs(smooth) <= level)
        new = np.where((held | turned) & (level > 0), 0.0, after)
        q, dq = q + h * (dq + new) / 2, new
    return q, dq, lagged


def _opposing(t, q, dq, slow, p):
    drift = p["drift"] * (1 - np.exp(-t / p["drift_time"]))
    damping = p["damping"] * (1 + 0.8 * p["modulated_damping"] * np.sin(5 * q)) + drift
    spring = p["spring"] + 0.1 * p["kp"] * p["varying_stiffness"] * np.sin(2.3 * t + np.sin(t))
    return (damping * dq + p["offset"] + p["quadratic"] * dq * np.abs(dq)
            + spring * (q - p["start"]) + p["weight"] * np.cos(q)
            + p["ripple"] * np.sin(p["order"] * q + 1.0)
            + p["tone"] * np.sin(2 * np.pi * p["tone_hz"] * t + 0.5)
            + 0.5 * p["kp"] * p["soft_stop"] * np.maximum(q - p["start"] - 0.1, 0.0)
            + p["step"] * (t > p["step_at"]) + 0.02 * p["kp"] * p["random_torque"] * slow)


def _record(j, log, q, u):
    from clie_blocks.analysis.records import Record

    return Record(time=PERIOD * np.arange(len(q)), q=q, u=u, source=f"log-{j + 1}",
                  qd=np.stack([lane["q_d"] for lane in log], axis=1),
                  pe=np.stack([lane["pe"] for lane in log], axis=1))


def _robot(case):
    from clie_blocks.analysis.records.robot import (
        Controller,
        Encoder,
        Experiment,
        Links,
        Motor,
        Nominal,
        Robot,
    )

    joints, n = case["joints"], len(case["joints"])

    def column(key):
        return np.array([joint[key] for joint in joints])

    ratio, inertia, link = column("ratio"), column("nominal_inertia"), column("link")
    links = Links()
    if n == 1:  # a point mass on a rod that weighs and resists as the lane says
        length = 9.81 * link / column("weight")
        links = Links(length=length, com=length, mass=link * ratio / length**2, inertia=[0.0],
                      joint_viscous_friction=[0.0])
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
        encoder=Encoder(shaft_ratio=[10.0], resolution=column("lsb")),
        experiments={f"log-{j + 1}": Experiment(start=column("start")) for j in range(3)})
