"""A robot with effects of the catalogue in it, simulated by python-control blocks, with its file.

The plant moves in continuous time under a sampled PD law, both with effects inserted; the logs and
the robot file are written as a user has them.
"""

import dataclasses
import functools

import control as ct
import numpy as np

from clie_blocks.analysis.records import Record, write_record
from clie_blocks.compiled import sampled
from clie_blocks.controllers import pd_controller
from clie_blocks.effects import LIBRARY, with_effects
from clie_blocks.filters import difference_filter
from clie_blocks.joints import inertial_joints
from clie_blocks.labels import signals
from clie_blocks.measurement import quantized

PERIOD, STEP = 1e-3, 2e-4  # s
INERTIA, DAMPING, KP, KD = 0.1, 0.5, 100.0, 7.5  # of each joint, and of its law
RESOLUTION, NOISE, ROUNDING = 2e-5, 1e-4, 1e-4  # rad, rad, N m
ROWS = 12000
IN_PLANT = ("drive", "load", "body", "environment", "transmission", "sensor")
FILE = """joints = {n}
[motor]
gear_ratio = {ratio}
inertia_kgm2 = {inertia}
viscous_friction_nms = {damping}
inertia_tolerance = 0.02
viscous_friction_tolerance = 0.15
torque_offset_tolerance_nm = 0.05
{links}
[controller]
Kp = {kp}
Kd = {kd}
velocity_filter = "difference"
sample_time_s = {period}
command_resolution_nm = {rounding}
[encoder]
resolution_rad = {resolution}
"""


@dataclasses.dataclass(frozen=True)
class Motion:
    """What a log is recorded with, rows by joints."""

    q_d: np.ndarray
    pe: np.ndarray


@functools.cache
def motion(j: int, n: int = 1, size: float = 1.0) -> Motion:
    """Set-point and excitation of log j; no joint moves as another one."""
    t = PERIOD * np.arange(ROWS)[:, None]
    k = np.arange(n)
    q_d = (0.7 * np.sin(2 * np.pi * 0.23 * (1 + j / 4 + 0.3 * k) * t)
           + 0.2 * (np.sin((4.5 + 0.7 * k) * t + j) - np.sin(j)))
    tones = np.array([0.31, 0.77, 1.7, 3.1, 5.3])[:, None] * (1.0, 1.17, 0.9)[j] * (1 + 0.07 * k)
    pe = 2.5 * np.sin(2 * np.pi * tones * t[:, :, None]
                      + 3.0 * j + k).sum(axis=1)
    return Motion(size * q_d, size * pe)


def joints(n: int = 1, inertia=INERTIA, damping=DAMPING, load=0.0):
    """Joints without effects, as a plant."""
    every = np.ones(n)
    return inertial_joints(inertia * every, damping * every, load * every)


def simulate(plant, effects, motions, noise=NOISE, kp=KP, kd=KD):
    """Measured positions and logged commands of a plant under the law, in each of some motions."""
    n = plant.ninputs
    plant = with_effects(plant, [one for one in effects if one.effect.port in IN_PLANT])
    law = pd_controller([kp] * n, [kd] * n, name="law")
    law.dt = PERIOD
    law = with_effects(law, [one for one in effects if one.effect.port == "controller"])
    rounds = RESOLUTION if noise else 1e-12
    sensor = ct.nlsys(
        None, lambda t, x, u, params: quantized(u[:n] + u[n:], rounds), name="counter",
        dt=PERIOD, inputs=signals("q", "noise", n=n), outputs=signals("q", n=n))
    loop = sampled(
        plant, [sensor, difference_filter(n, PERIOD, taps=1), law], wires=[
            ("counter.q", f"{plant.name}.q"), ("velocity_filter.q", "counter.q"),
            (f"{law.name}.q", "counter.q"), (f"{law.name}.dq", "velocity_filter.dq"),
            (f"{plant.name}.u", f"{law.name}.u")])
    runs = []
    for j, each in enumerate(motions):
        errors = noise * np.random.default_rng(100 + j).standard_normal(each.q_d.shape)
        held = {name: np.repeat(rows, round(PERIOD / STEP), axis=0)
                for name, rows in (("q_d", each.q_d), ("pe", each.pe), ("noise", errors))}
        run = loop.run(len(each.q_d) * PERIOD, step=STEP, inputs=held)
        rows = np.asarray(run.outputs)[:, ::round(PERIOD / STEP)][:, :len(each.q_d)].T
        at = {name: [run.output_labels.index(label) for label in signals(name, n=n)]
              for name in ("counter_q", "u")} if "counter_q[0]" in run.output_labels else None
        if at is None:
            raise AssertionError(run.output_labels)
        q, u = rows[:, at["counter_q"]], rows[:, at["u"]]
        for one in effects:
            if one.effect.port == "log":
                u = _recorded(one, u)
        runs.append((q, u))
    return runs


def _recorded(setting, u):
    """Commands as a recorder with an effect writes them."""
    block = setting.block(u.shape[1], PERIOD)
    state, written = np.zeros(block.nstates), []
    for k, row in enumerate(u):
        written.append(block.output(k * PERIOD, state, row))
        state = block.dynamics(k * PERIOD, state, row) if block.nstates else state
    return np.array(written)


def records(plant, effects, count=3, size=1.0, **law):
    """Logs of a plant with effects under the law."""
    n = plant.ninputs
    motions = [motion(j, n, size) for j in range(count)]
    return [Record(time=PERIOD * np.arange(ROWS), q=q, u=ROUNDING * np.round(u / ROUNDING),
                   qd=each.q_d, pe=each.pe, source=f"log-{j + 1}")
            for j, (each, (q, u)) in enumerate(
                zip(motions, simulate(plant, effects, motions, **law)))]


def write(folder, records, links="", ratio=1.0, inertia=INERTIA, damping=DAMPING, kp=KP, kd=KD):
    """Write the robot's file and its logs into a folder."""
    n = records[0].q.shape[1]
    every = {"ratio": ratio, "inertia": inertia / ratio, "damping": damping / ratio, "kp": kp, "kd": kd,
             "resolution": RESOLUTION, "rounding": ROUNDING}
    text = {key: [float(value)] * n for key, value in every.items()}
    (folder / "robot.toml").write_text(FILE.format(n=n, links=links, period=PERIOD, **text))
    for record in records:
        write_record(record, folder / f"{record.source}.csv")
    return folder
