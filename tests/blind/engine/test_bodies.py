"""Bodies of the engine weigh what the robot file states."""

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
from clie_blocks.analysis.blind.engine.world import build_model  # noqa: E402


def test_the_motor_in_front_of_a_soft_gear_has_the_inertia_of_its_rotor(quiet_robot):
    """A speck of mass there was half a per cent of a light wrist."""
    joint = quiet_robot()
    rotor = 6.5e-5  # kg m^2 behind the gear, as of the wrist of a small arm
    truth = {**joint.truth, "rotor": np.array([rotor]) / joint.robot.ratio**2,
             "twist_stiffness": np.array([2.6])}
    model = build_model(joint.robot, [truth])
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    for column, unit in zip(mass, np.eye(model.nv)):
        mujoco.mj_mulM(model, data, column, unit)
    motor, link = (model.joint(f"{side}0_0").dofadr[0] for side in "ab")
    assert mass[motor, motor] - mass[link, link] == pytest.approx(rotor, rel=1e-4)
