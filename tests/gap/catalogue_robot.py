"""A robot with effects of the catalogue in it, simulated by python-control blocks, with its file.

The plant moves in continuous time under a sampled PD law, both with effects inserted; the logs and
the robot file are written as a user has them.
"""

import dataclasses

import control as ct
import numpy as np

from clie_blocks.analysis.records import Record, write_record
from clie_blocks.compiled import sampled
from clie_blocks.controllers import pd_controller
from clie_blocks.effects import with_effects
from clie_blocks.effects.insertion import of_law
from clie_blocks.filters import difference_filter
from clie_blocks.joints import inertial_joints
from clie_blocks.labels import signals
from clie_blocks.measurement import quantized

PERIOD, STEP = 1e-3, 2e-4  # s
ROUNDING = 1e-4  # N m, of the logged command
ROWS = 12000
TONES = np.array([0.31, 0.77, 1.7, 3.1, 5.3])  # Hz
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
class CatalogueRobot:
    """Joints that are alike, with their law and their encoders, motor-side torques."""

    n: int = 1
    ratio: float = 50.0
    inertia: float = 0.1
    damping: float = 0.5
    kp: float = 100.0
    kd: float = 7.5
    noise: float = 1e-4
    resolution: float = 2e-5
    size: float = 1.0
    links: str = ""

    def plant(self, inertia=None, damping=None, load=0.0):
        """Joints without effects, as stated or as identified."""
        every = np.ones(self.n)
        return inertial_joints((self.inertia if inertia is None else inertia) * every,
                               (self.damping if damping is None else damping) * every,
                               load * every)

    def law(self):
        """Sampled law without effects."""
        law = pd_controller([self.kp] * self.n, [self.kd] * self.n, name="law")
        law.dt = PERIOD
        return law

    def motion(self, j):
        """Set-point and excitation of log j; no joint moves as another one."""
        t, k = PERIOD * np.arange(ROWS)[:, None], np.arange(self.n)
        q_d = (0.7 * np.sin(2 * np.pi * 0.23 * (1 + j / 4 + 0.3 * k) * t)
               + 0.2 * (np.sin((4.5 + 0.7 * k) * t + j) - np.sin(j)))
        tones = TONES[:, None] * (1.0, 1.17, 0.9)[j] * (1 + 0.07 * k)
        pe = 2.5 * np.sin(2 * np.pi * tones * t[:, :, None] + 3.0 * j + k).sum(axis=1)
        return self.size * q_d, self.size * pe

    def records(self, effects):
        """Logs of the robot with effects in plant, law and recorder."""
        plant = with_effects(self.plant(), [one for one in effects if one.effect.port != "log"
                                            and not of_law(one)])
        law = with_effects(self.law(), [one for one in effects if of_law(one)])
        return [self.record(j, plant, law, effects) for j in range(3)]

    def record(self, j, plant, law, effects=()):
        """Log j of a plant under a law; effects of the recorder change its commands."""
        q_d, pe = self.motion(j)
        q, u = self.run(j, plant, law)
        for one in effects:
            if one.effect.port == "log":
                u = _recorded(one, u)
        return Record(time=PERIOD * np.arange(ROWS), q=q, u=ROUNDING * np.round(u / ROUNDING),
                      qd=q_d, pe=pe, source=f"log-{j + 1}")

    def run(self, j, plant, law, noisy=True):
        """Measured positions and commands in motion j."""
        n, between = self.n, round(PERIOD / STEP)
        step = self.resolution if noisy else 1e-12
        counter = ct.nlsys(
            None, lambda t, x, u, params: quantized(u[:n] + u[n:], step), name="counter",
            dt=PERIOD, inputs=signals("q", "noise", n=n), outputs=signals("q", n=n))
        loop = sampled(
            plant, [counter, difference_filter(n, PERIOD, taps=1), law], wires=[
                ("counter.q", f"{plant.name}.q"), ("velocity_filter.q", "counter.q"),
                (f"{law.name}.q", "counter.q"), (f"{law.name}.dq", "velocity_filter.dq"),
                (f"{plant.name}.u", f"{law.name}.u")])
        q_d, pe = self.motion(j)
        noise = noisy * self.noise * np.random.default_rng(100 + j).standard_normal(q_d.shape)
        inputs = {name: np.repeat(rows, between, axis=0)
                  for name, rows in (("q_d", q_d), ("pe", pe), ("noise", noise))}
        run = loop.run(ROWS * PERIOD, step=STEP, inputs=inputs)
        rows = np.asarray(run.outputs)[:, ::between][:, :ROWS].T
        return tuple(rows[:, [run.output_labels.index(label) for label in signals(name, n=n)]]
                     for name in ("counter_q", "u"))

    def write(self, folder, records):
        """Write the robot's file and its logs into a folder."""
        every = {"ratio": self.ratio, "inertia": self.inertia / self.ratio,
                 "damping": self.damping / self.ratio, "kp": self.kp, "kd": self.kd,
                 "resolution": self.resolution, "rounding": ROUNDING}
        text = {key: [float(value)] * self.n for key, value in every.items()}
        (folder / "robot.toml").write_text(
            FILE.format(n=self.n, links=self.links, period=PERIOD, **text))
        for record in records:
            write_record(record, folder / f"{record.source}.csv")
        return folder


def _recorded(setting, u):
    """Commands as a recorder with an effect writes them."""
    block = setting.block(u.shape[1], PERIOD)
    state, written = np.zeros(block.nstates), []
    for k, row in enumerate(u):
        written.append(block.output(k * PERIOD, state, row))
        state = block.dynamics(k * PERIOD, state, row) if block.nstates else state
    return np.array(written)
