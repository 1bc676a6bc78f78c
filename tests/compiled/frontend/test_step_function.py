"""A diagram as one function: what python-control computes, and what tells functions apart."""

import control as ct
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clie_blocks.compiled.frontend.step_function import step_function
from clie_blocks.controllers import pd_controller
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.joints import decoupled_joints

numbers = st.floats(-3.0, 3.0)


def lag(gain=2.0, name="lag"):
    return ct.nlsys(lambda t, x, u, params: params["k"] * (u - x), lambda t, x, u, params: x,
                    name=name, states=1, inputs=["u[0]"], outputs=["y[0]"], params={"k": gain},
                    dt=1.0)


@given(st.lists(numbers, min_size=8, max_size=8))
def test_the_function_is_the_diagram(values):
    loop = joint_loop(decoupled_joints([1, 2], [1, 2], [0, 0.1]), [10, 8], [5, 4])
    rng = np.random.default_rng(abs(hash(tuple(values))) % 2**32)
    x, u = rng.normal(size=loop.nstates), rng.normal(size=loop.ninputs)
    x[:min(len(x), 8)] = values[:len(x)]
    rates, outputs = step_function(loop)(0.3, x, u)
    np.testing.assert_allclose(rates, loop.dynamics(0.3, x, u), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(outputs, loop.output(0.3, x, u), rtol=1e-12, atol=1e-12)


def test_parameters_can_be_given_to_each_call():
    function = step_function(lag())
    assert function(0.0, np.array([1.0]), np.array([3.0]))[0] == pytest.approx([4.0])
    assert function(0.0, np.array([1.0]), np.array([3.0]), np.array([0.5]))[0] == pytest.approx(
        [1.0])


def test_equal_equations_have_one_digest_whatever_their_parameters():
    assert step_function(lag(2.0)).digest == step_function(lag(3.0, "other")).digest
    law = pd_controller([1.0], [1.0])
    assert step_function(law).digest != step_function(lag()).digest
