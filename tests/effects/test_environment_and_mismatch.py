"""Outside torques against the linear loop; mismatch against a plant with other numbers."""

import control as ct
import numpy as np
import pytest
from effect_runs import one_joint, run_loop

from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.effects import LIBRARY, with_effects
from clie_blocks.effects.gravity import gravity_torque
from clie_blocks.joints import decoupled_joints, inertial_joints


def test_a_disturbance_shows_as_one_line_of_the_size_of_the_linear_loop():
    amplitude, frequency = 0.3, 2.0
    plant = one_joint(LIBRARY["periodic_disturbance"](sine=amplitude, frequency=frequency))
    q = run_loop(plant, 0.0, 20.0).outputs[0].ravel()[-10000:]
    lines = 2 * np.abs(np.fft.rfft(q[:10000])) / 10000  # 20 periods
    loop = ct.linearize(joint_loop(decoupled_joints([2.0], [0.5], [0.0]), [10], [5]),
                        np.zeros(2), np.zeros(2))
    expected = amplitude * abs(loop(2j * np.pi * frequency)[0, 1])  # pe enters where it does
    assert lines[20] == pytest.approx(expected, rel=1e-3)
    assert np.sum(np.delete(lines[1:], 19) ** 2) < 1e-6 * expected**2


def test_a_fault_moves_the_rest_by_its_torque_over_kp():
    plant = one_joint(LIBRARY["step_fault"](offset=0.4, time=3.0))
    loop = run_loop(plant, 0.0, 20.0)
    q = loop.outputs[0].ravel()
    assert np.all(q[loop.time < 3.0] == 0.0)
    assert q[-1] == pytest.approx(-0.4 / 10.0, rel=1e-6)


def test_a_weight_put_on_is_gravity_from_then_on():
    q, w, r = np.array([0.4, -1.0]), np.array([0.9, 0.4]), np.array([50.0, 80.0])
    fault = LIBRARY["step_fault"](weight=w, gear_ratio=r, time=3.0).block(2)
    for t, expected in ((2.999, np.zeros(2)), (3.0, gravity_torque(q, w, r))):
        found = fault.output(t, [], np.concatenate((q, np.ones(2), np.ones(2))))
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize(("name", "value", "changed"), [
    ("inertia", {"extra": [0.3, -0.2]}, ([2.3, 1.3], [4.0, 3.0], [0.2, 0.1], 1.0)),
    ("viscous", {"extra": [0.7, -0.5]}, ([2.0, 1.5], [4.7, 2.5], [0.2, 0.1], 1.0)),
    ("offset", {"torque": [0.4, -0.3]}, ([2.0, 1.5], [4.0, 3.0], [0.6, -0.2], 1.0)),
    ("torque_gain", {"error": 0.25}, ([2.0, 1.5], [4.0, 3.0], [0.2, 0.1], 1.25)),
])
def test_mismatch_is_a_plant_with_other_numbers(name, value, changed):
    plant = with_effects(inertial_joints([2.0, 1.5], [4.0, 3.0], [0.2, 0.1]),
                         [LIBRARY[name](**value)])
    *numbers, gain = changed
    other = inertial_joints(*numbers)
    rng = np.random.default_rng(0)
    for _ in range(10):
        x, u = rng.normal(size=4), rng.normal(size=2)
        np.testing.assert_allclose(plant.dynamics(0, x, u), other.dynamics(0, x, gain * u),
                                   rtol=1e-12)
