import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clie_blocks.controllers import linearizing_controller, pd_controller, pd_torque
from clie_blocks.joints import joint_acceleration
from clie_blocks.signals import DiagramError

numbers = st.floats(-100, 100)


@given(*[numbers] * 4, st.floats(0.1, 50), st.floats(0.1, 50))
def test_pd_torque_is_linear_in_all_signals(q_d, q, dq, pe, kp, kd):
    torque = pd_torque(q_d, q, dq, pe, kp, kd)
    assert torque == pytest.approx(kp * q_d - kp * q - kd * dq + pe, rel=1e-12, abs=1e-9)
    assert pd_torque(-q_d, -q, -dq, -pe, kp, kd) == -torque


def test_pd_block_equals_its_kernel_joint_by_joint():
    kp, kd = np.array([10.0, 8.0, 6.0]), np.array([5.0, 4.0, 3.0])
    u = np.random.default_rng(0).normal(size=(4, 3))
    expected = [pd_torque(*u[:, k], kp[k], kd[k]) for k in range(3)]
    np.testing.assert_allclose(pd_controller(kp, kd).output(0, [], u.reshape(-1)), expected)


@pytest.mark.parametrize("printed, residual", [(False, 0.0), (True, -2.0)])
def test_linearisation_cancels_d_with_plus_and_doubles_it_as_printed(printed, residual):
    """With exact parameters the joint follows the PD error law; as printed, -2 D is left over."""
    a, b, d = np.array([2.0, 1.5]), np.array([0.5, 0.4]), np.array([0.3, -0.2])
    kp, kd = np.array([10.0, 12.0]), np.array([5.0, 6.0])
    q_d, dq_d, ddq_d, q, dq = np.random.default_rng(1).normal(size=(5, 2))
    controller = linearizing_controller(a, b, d, kp, kd, printed_sign=printed)
    u = controller.output(0, [], np.concatenate((q_d, dq_d, ddq_d, q, dq)))
    ddq = joint_acceleration(dq, u, a, b, d)
    expected = ddq_d + kp * (q_d - q) + kd * (dq_d - dq) + residual * d
    np.testing.assert_allclose(ddq, expected, rtol=1e-12)


@pytest.mark.parametrize("kp, kd, message", [
    ([10.0, -1.0], [5.0, 5.0], "kp must be greater than 0"), ([10.0], [0.0], "kd must be"),
    ([10.0, 10.0], [5.0, 5.0, 5.0], "kp has 2 gains but kd has 3")])
def test_bad_gains_are_named(kp, kd, message):
    with pytest.raises(DiagramError, match=message):
        pd_controller(kp, kd, name="pd")
