"""The ports of a user's loop: required ones are named with the remedy, a cut motor is closed."""

import control as ct
import numpy as np
import pytest

from clie_blocks.analysis.gap.problem.user_loop.ports import as_closed_loop, loop_ports
from clie_blocks.errors import ClieError


def loop(inputs=("q_d", "pe", "torque"), outputs=("q", "u", "dq")):
    """A joint under PD control, with labels of choice."""
    def command(x, u):
        return 8.0 * (u[0] - x[0]) - 0.6 * x[1] + u[1]

    return ct.nlsys(lambda t, x, u, params: np.array([x[1], command(x, u) + u[2] - x[1]]),
                    lambda t, x, u, params: np.array([x[0], command(x, u), x[1]]),
                    states=["angle", "speed"], name="mine", inputs=list(inputs),
                    outputs=list(outputs))


def test_the_ports_of_a_loop_are_found():
    ports = loop_ports(loop())
    assert (ports.n, ports.torque, ports.has_pe, ports.has_sensor) == (1, "torque", True, False)
    assert loop_ports(loop(inputs=("q_d", "pe", "wind"))).torque == "pe"
    assert loop_ports(loop(inputs=("q_d", "pe", "wind"))).other == ("wind",)


@pytest.mark.parametrize("names, missing", [
    ({"outputs": ["angle", "u", "dq"]}, "'q'"), ({"outputs": ["q", "torque", "dq"]}, "'u'"),
    ({"inputs": ["qd", "pe", "torque"]}, "did you mean 'q_d'|'q_d'"),
    ({"inputs": ["q_d", "excitation", "tau"]}, "summing")])
def test_a_missing_port_is_named_with_the_remedy(names, missing):
    with pytest.raises(ClieError, match=missing):
        loop_ports(loop(**names))


def test_an_object_that_is_no_system_is_refused():
    with pytest.raises(ClieError, match="python-control"):
        as_closed_loop(lambda t: t)


def test_ports_that_do_not_fit_are_refused():
    with pytest.raises(ClieError, match="input torque"):
        as_closed_loop(loop(inputs=["q_d", "u_in", "torque"]))
    with pytest.raises(ClieError, match="no output 'u'"):
        as_closed_loop(loop(inputs=["q_d", "pe", "u_in"], outputs=["q", "command", "dq"]))


def test_a_loop_that_is_cut_at_the_motor_is_closed_with_a_port_for_torque():
    plant = ct.nlsys(lambda t, x, u, params: np.array([x[1], u[2] - x[1]]),
                     lambda t, x, u, params: np.array([x[0], 8.0 * (u[0] - x[0]) + u[1]]),
                     states=["angle", "speed"], name="cut", inputs=["q_d", "pe", "u_in"],
                     outputs=["q", "u"])
    closed = as_closed_loop(plant)
    assert loop_ports(closed).torque == "torque"
    at = dict(zip(closed.input_labels, range(closed.ninputs)))
    inputs = np.zeros(closed.ninputs)
    inputs[at["q_d[0]" if "q_d[0]" in at else "q_d"]] = 0.5
    inputs[at["torque[0]" if "torque[0]" in at else "torque"]] = 0.25
    rates = closed.dynamics(0.0, np.array([0.1, 0.0]), inputs)
    assert rates[1] == pytest.approx(8.0 * (0.5 - 0.1) + 0.25)
