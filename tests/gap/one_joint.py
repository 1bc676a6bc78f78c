"""One geared joint under the sampled PD law, by a small simulator of its own.

The same motion can be written with motor torques and the gear ratio, or with joint torques and a
gear ratio of one, as ROS, MuJoCo and most arms log it.
"""

import dataclasses
import math

import numpy as np

from clie_blocks.analysis.records import Record
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.robot_sections import Encoder, Motor

RATIO = 50.0
PERIOD = 1e-3  # s
INERTIA, DAMPING = 0.1, 0.5  # joint side [kg m^2, N m s/rad]
KP, KD = 100.0, 7.5  # joint side
RESOLUTION, NOISE = 2e-5, 1e-4  # rad
TIME = PERIOD * np.arange(12000)


@dataclasses.dataclass(frozen=True)
class Physics:
    """What acts on the joint beside its inertia and damping, joint side."""

    dry: float = 0.0
    weight: float = 0.0
    ripple: float = 0.0
    order: float = 100.0
    step: float = 0.0
    onset: float = 5.0
    cubic: float = 0.0
    limit: float = math.inf

    def torque(self, t, q):
        """What opposes, but for friction."""
        return (self.weight * math.cos(q) + self.ripple * math.sin(self.order * q)
                + self.step * (t >= self.onset))


def _fine(q, dq, t, drive, physics):
    """Ten midpoint steps per sample, with dry friction that holds."""
    h = PERIOD / 10
    for _ in range(10):
        drag = DAMPING * dq + physics.cubic * dq**3
        free = dq + h * (drive - drag - physics.torque(t, q)) / INERTIA
        held = h * physics.dry / INERTIA
        after = 0.0 if abs(free) <= held else free - math.copysign(held, free)
        q, dq = q + h * (dq + after) / 2, after
    return q, dq


def _coarse(q, dq, t, drive, physics):
    """One semi-implicit step per sample, as game engines do it."""
    dq += PERIOD * (drive - DAMPING * dq - physics.torque(t, q)) / INERTIA
    return q + PERIOD * dq, dq


def _log(j, physics, move, noise):
    q_d = 0.7 * np.sin(2 * np.pi * 0.23 * (1 + j / 4) * TIME) + 0.2 * np.sin(4.5 * TIME + j)
    tones = np.array([0.31, 0.77, 1.7, 3.1, 5.3]) * (1.0, 1.17, 0.9)[j]
    pe = 2.5 * np.sin(2 * np.pi * np.outer(TIME, tones) + 3.0 * j).sum(axis=1)
    errors = noise * np.random.default_rng(100 + j).standard_normal(len(TIME))
    step, q, dq, rows = RESOLUTION if noise else 1e-12, 0.0, 0.0, []
    previous = round(errors[0] / step) * step
    for t, set_point, excitation, error in zip(TIME, q_d.tolist(), pe.tolist(), errors.tolist()):
        measured = round((q + error) / step) * step
        u = KP * (set_point - measured) - KD * (measured - previous) / PERIOD + excitation
        rows.append((measured, u))
        previous = measured
        q, dq = move(q, dq, t, min(max(u, -physics.limit), physics.limit), physics)
    return np.array(rows), q_d, pe


def logs(physics, ratio=1.0, simulated=False, count=3):
    """Logs of the joint, or of a coarse simulator without noise; torques behind a gear ratio."""
    records = []
    for j in range(count):
        rows, q_d, pe = _log(j, physics, *((_coarse, 0.0) if simulated else (_fine, NOISE)))
        records.append(Record(time=TIME, q=rows[:, :1], u=rows[:, 1:] / ratio, qd=q_d[:, None],
                              pe=pe[:, None] / ratio, source=f"log-{j + 1}"))
    return records


def robot(ratio=1.0):
    """What is stated of the joint, with its torques behind a gear ratio; no ratio for None."""
    r = ratio or 1.0
    return Robot(
        n=1, name="axis",
        motor=Motor(gear_ratio=None if ratio is None else [r], inertia=[INERTIA / r**2],
                    viscous_friction=[DAMPING / r**2], inertia_tolerance=0.02,
                    viscous_friction_tolerance=0.15),
        controller=Controller(kp=[KP / r], kd=[KD / r], velocity_filter="difference",
                              sample_time=PERIOD),
        encoder=Encoder(resolution=[RESOLUTION]))
