"""The catalogue against an independent engine, each as close as its methods allow."""

import numpy as np
import pytest
from effect_runs import block_response

mujoco = pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.catalogue.against_mujoco import ROBOTS, compare  # noqa: E402
from clie_blocks.effects import LIBRARY  # noqa: E402
from clie_blocks.signals import DiagramError  # noqa: E402

# Largest difference of q [rad] over 3 s; measured figures are in docs/effects_mujoco.md.
AGREEMENT = {
    "viscous": 1e-11, "inertia": 1e-11, "joint_elasticity": 1e-11, "actuator_saturation": 1e-11,
    "torque_gain_error": 1e-11, "actuator_lag": 1e-11, "coupling": 1e-9, "gravity": 1e-7,
    "payload": 1e-7, "time_delay": 2e-6, "backlash": 5e-6, "coulomb": 2e-4}


@pytest.mark.parametrize("name", ROBOTS)
def test_both_engines_agree(name):
    found = compare(name)
    assert found.difference < AGREEMENT[name]
    assert found.size > 1e3 * min(found.difference, 2e-6) and found.size > 2e-3


def test_an_effect_without_a_robot_is_told():
    with pytest.raises(DiagramError, match="no robot to compare 'back_lash'.*'backlash'"):
        compare("back_lash")


def test_a_winding_warms_up_as_that_of_the_engine():
    torque, heating, fade, time_constant = 0.08, 15_400.0, 4e-3, 5.0
    ohm = 1e-9  # its motor constant too: a volt gives one newton metre, and speed does not brake
    model = mujoco.MjModel.from_xml_string(f"""
        <mujoco><option timestep="0.001" gravity="0 0 0"/><worldbody><body>
          <joint name="a" armature="1000"/><geom size="0.1" mass="1"/></body></worldbody>
        <actuator><dcmotor joint="a" motorconst="{ohm} {ohm}" resistance="{ohm}"
          thermal="{heating * ohm} 0 {time_constant} {fade} 20 20"/></actuator></mujoco>""")
    data = mujoco.MjData(model)
    data.ctrl[0] = torque
    of_engine = []
    for _ in range(8_000):
        mujoco.mj_step(model, data)
        of_engine.append(data.actuator_force[0])
    setting = LIBRARY["motor_heating"](heating=heating, time_constant=time_constant, fade=fade)
    _, y = block_response(setting, {"u": torque}, 8.0, 1e-3)
    np.testing.assert_allclose(y[0, :8_000], of_engine, atol=2e-5)
    assert of_engine[-1] < 0.82 * torque
