"""A clean log of a simulated robot of three joints, into which the tests put one fault each."""

import numpy as np
import pytest

from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.robot_sections import Encoder, Motor

STEP = 1e-3
SAMPLES = 12_000
RATIO = np.array([25.0, 50.0, 30.0])
INERTIA = np.array([0.5, 0.8, 0.3])
FRICTION = np.array([1.0, 2.0, 0.7])
KP, KD = np.array([20.0, 30.0, 15.0]), np.array([4.0, 6.0, 3.0])
NOISE, COUNT, ROUNDING = 2e-4, 1e-4, 1e-3


@pytest.fixture(scope="session")
def robot():
    """All that is known of the robot, and true."""
    return Robot(
        3, joints=("base", "arm", "wrist"),
        motor=Motor(gear_ratio=RATIO, inertia=INERTIA / RATIO, viscous_friction=FRICTION / RATIO),
        controller=Controller(kp=KP, kd=KD, highpass=200.0, lowpass=300.0, sample_time=STEP,
                              discretisation="tustin", command_resolution=np.full(3, ROUNDING)),
        encoder=Encoder(resolution=np.full(3, COUNT)))


@pytest.fixture(scope="session")
def clean(robot):
    """Log of the robot under its law: q, u, qd, pe, and a true velocity and torque."""
    time = STEP * np.arange(SAMPLES)
    phase = np.arange(3)
    qd = 0.3 * np.sin(2 * np.pi * time[:, None] * [0.23, 0.31, 0.41] + phase)
    pe = 2.0 * np.sin(2 * np.pi * time[:, None] * [1.1, 0.9, 1.3] + 2 * phase)
    noise = np.random.default_rng(5).normal(0, NOISE, (SAMPLES, 3))
    q, dq, u = _simulated(qd, pe, noise)
    return Record(time, q, u=u, qd=qd, pe=pe, dq=dq, tau=u + 0.5 * noise / NOISE * 1e-2,
                  joints=robot.joints, robot=robot, source="clean.csv")


def _simulated(qd, pe, noise):
    """Sampled PD law with G1 by Tustin's rule around joints solved exactly over each sample."""
    c = 2 / STEP
    p1, p2 = (c - 200) / (c + 200), (c - 300) / (c + 300)
    gain = 200 * 300 * c / ((c + 200) * (c + 300))
    forget = np.exp(-FRICTION / INERTIA * STEP)
    position, speed = qd[0].copy(), np.zeros(3)
    q, dq, u = np.empty_like(qd), np.empty_like(qd), np.empty_like(qd)
    older = old = None
    rate, rate_before = np.zeros(3), np.zeros(3)
    for i in range(len(qd)):
        q[i] = np.round((position + noise[i]) / COUNT) * COUNT
        old = q[i] if old is None else old
        older = old if older is None else older
        rate, rate_before = ((p1 + p2) * rate - p1 * p2 * rate_before
                             + gain * (q[i] - older)), rate
        older, old = old, q[i]
        u[i] = np.round((KP * (qd[i] - q[i]) - KD * rate + pe[i]) / ROUNDING) * ROUNDING
        dq[i] = speed
        top = u[i] / FRICTION
        position = position + top * STEP + (speed - top) * (1 - forget) * INERTIA / FRICTION
        speed = top + (speed - top) * forget
    return q, dq, u
