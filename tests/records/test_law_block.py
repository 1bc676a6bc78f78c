"""Laws of a robot file that run as blocks: which do, and what they compute."""

import numpy as np
import pytest

from clie_blocks.analysis.records.control_law import control_law
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.law_block import law_block
from clie_blocks.analysis.records.robot import Robot, as_checks_see
from clie_blocks.errors import RecordError
from clie_blocks.linear_filters import DISCRETISATIONS

T = 1e-3
LIMIT = [0.15, 0.15]
GAINS = {"kp": [4.0, 2.0], "kd": [0.1, 0.05]}


@pytest.mark.parametrize(("stated", "runs_as_block"), [
    ({"law": "pd", **GAINS}, False), ({"law": "pd", **GAINS, "velocity_of": "joint"}, False),
    ({"law": "pd", **GAINS, "velocity_of": "error"}, True),
    ({"law": "pd", **GAINS, "compensation": "gravity"}, True),
    ({"law": "pid", **GAINS, "ki": [1.0, 0.0]}, True),
    ({"law": "cascade", "kp": [8.0, 8.0], "kv": [0.1, 0.1]}, False),
    ({"law": "cascade", "kp": [8.0, 8.0], "kv": [0.1, 0.1], "ki": [0.0, 0.0]}, False),
    ({"law": "cascade", "kp": [8.0, 8.0], "kv": [0.1, 0.1], "ki": [1.0, 0.0]}, True)])
def test_a_law_with_more_states_than_pd_runs_as_a_block(stated, runs_as_block):
    robot = Robot(n=2, controller=Controller(**stated))
    assert robot.controller.is_block == runs_as_block and not robot.controller.is_program
    assert (as_checks_see(robot).controller.law == "unknown") == runs_as_block


@pytest.mark.parametrize("rate", [
    {"velocity_filter": "difference"}, {"velocity_filter": "two_tap"},
    *({"velocity_filter": "two_corner", "highpass": 200.0, "lowpass": 300.0,
       "discretisation": kind} for kind in DISCRETISATIONS)])
@pytest.mark.parametrize("law", ["pid", "cascade"])
def test_without_an_integral_a_block_computes_what_the_stated_law_does(law, rate):
    gains = {"pid": {**GAINS, "ki": [0.0, 0.0]}, "cascade": {
        "kp": [40.0, 40.0], "kv": [0.1, 0.05]}}[law]
    controller = Controller(law=law, **gains, **rate, saturation=LIMIT)
    block = law_block(controller, T, 2)
    plain = Controller(law="pd" if law == "pid" else law, **{
        key: value for key, value in gains.items() if key != "ki"}, **rate, saturation=LIMIT)
    q = np.cumsum(np.random.default_rng(1).normal(size=(50, 2)), axis=0) * 1e-3
    q -= q[0]
    q_d = q + 0.05 * np.sin(np.arange(50))[:, None]
    wanted = control_law(plain, T).replay(q, q_d, 0.0)
    x, commands = np.zeros(block.nstates), []
    for u in np.hstack([q_d, q, 0 * q]):
        commands.append(block.output(0.0, x, u))
        x = block.dynamics(0.0, x, u)
    np.testing.assert_allclose(commands, wanted, rtol=1e-9, atol=1e-12)
    assert np.abs(wanted).max() == LIMIT[0]


def test_pid_needs_its_integral_gain():
    with pytest.raises(RecordError, match="'pid' needs Ki"):
        Controller(law="pid", **GAINS)


def test_a_program_is_no_law_of_gains():
    assert law_block(Controller(law="my_law.py:controller"), T, 2) is None


def test_an_anti_windup_that_is_not_known_gets_the_nearest():
    with pytest.raises(RecordError, match="'conditonal' is not known.*conditional"):
        Controller(law="pid", **GAINS, ki=[1.0, 1.0], anti_windup="conditonal")


@pytest.mark.parametrize("law", ["unknown", "my_law.py:controller"])
def test_a_compensation_belongs_to_a_law_with_gains(law):
    with pytest.raises(RecordError, match="compensation = 'gravity' belongs to the laws"):
        Controller(law=law, compensation="gravity")
