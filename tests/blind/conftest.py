"""Short robots of the independent engine."""

import dataclasses

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.blind.engine.experiments import Motion  # noqa: E402
from clie_blocks.analysis.blind.engine.robot import draw_robot, draw_truth  # noqa: E402


@dataclasses.dataclass
class Bench:
    """A robot without noise, and what it takes to run it."""

    robot: object
    truth: dict

    def motion(self, seconds=1.0, torque=0.0, angle=0.0):
        """Torque and set-point held over a run that starts at the pose."""
        rows = np.ones((round(seconds / self.robot.period), self.robot.n))
        return Motion("other", self.robot.pose.copy(), self.robot.pose + angle * rows,
                      torque * rows)

    def run(self, motion, **numbers):
        """Angle and command under changed numbers."""
        from clie_blocks.analysis.blind.engine.control_loop import run

        lane = {**self.truth, **{key: np.full(self.robot.n, value)
                                 for key, value in numbers.items()}}
        (found,) = run(self.robot, [lane], [motion], [np.zeros(motion.q_d.shape)])
        return found


@pytest.fixture
def bench():
    def make(kind="pendulum", gravity=False, seed=3):
        rng = np.random.default_rng(seed)
        robot = draw_robot(rng, kind, gravity)
        truth = draw_truth(rng, robot)
        truth["offset"] = np.zeros(robot.n)
        fine = np.full(robot.n, 1e-12)
        robot = dataclasses.replace(robot, period=1e-3, resolution=fine, sigma=0 * fine,
                                    command_step=1e-12 * robot.kp)
        return Bench(robot, truth)
    return make
