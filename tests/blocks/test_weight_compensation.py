"""A law that carries the links: by its parts, at its limit, and holding an arm at rest."""

import control as ct
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clie_blocks.compiled import compile_diagram
from clie_blocks.controllers import sampled_pid, with_weight_compensation
from clie_blocks.labels import DiagramError
from clie_blocks.robot_loop import robot_loop
from clie_blocks.robot_loop.links import gravity_torque, planar_links

T = 0.001
LINKS = planar_links([0.4, 0.3], [1.0, 0.5], [0.2, 0.15], [0.02, 0.004], has_gravity=True)
KP, KD = np.array([30.0, 15.0]), np.array([3.0, 1.0])
angles = st.floats(-3.0, 3.0)


def pd(limit=1e9):
    return sampled_pid(KP, [0.0, 0.0], KD, T, limit=np.full(2, limit))


def weight(q):
    return gravity_torque(LINKS, q)


@given(angles, angles, st.floats(0.0, 1.5))
def test_the_weight_at_the_measured_position_is_added(q1, q2, share):
    law, q = pd(), np.array([q1, q2])
    carrying = with_weight_compensation(law, weight, share)
    u = np.concatenate([np.zeros(2), q, [0.1, 0.2]])
    x = np.zeros(law.nstates)
    added = carrying.output(0.0, x, u) - law.output(0.0, x, u)
    level = 9.81 * np.array([0.2 * np.cos(q1) + 0.5 * (0.4 * np.cos(q1) + 0.15 * np.cos(q1 + q2)),
                             0.5 * 0.15 * np.cos(q1 + q2)])
    np.testing.assert_allclose(added, share * level, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(carrying.dynamics(0.0, x, u)[2:], law.dynamics(0.0, x, u)[2:])


def test_the_limit_holds_for_all_of_the_command():
    carrying = with_weight_compensation(pd(limit=2.0), weight)
    u = carrying.output(0.0, np.zeros(6), np.zeros(6))
    assert weight(np.zeros(2))[0] > 2.0 and u[0] == 2.0
    assert u[1] == pytest.approx(weight(np.zeros(2))[1])


def test_an_arm_that_is_carried_rests_where_it_is_told():
    """Without the weight in the law it sags by the weight over Kp."""
    target = np.array([0.3, -0.4])
    rests = {}
    for share in (0.0, 1.0):
        law = with_weight_compensation(pd(), weight, share)
        loop = robot_loop([0.05, 0.02], [0.1, 0.1], KP, KD, T, law=law, links=LINKS)
        rests[share] = compile_diagram(loop).run(8.0, inputs={
            "q_d": target, "pe": np.zeros(2), "noise": np.zeros(2)}).outputs[:2, -1]
    np.testing.assert_allclose(rests[1.0], target, atol=1e-6)
    np.testing.assert_allclose(target - rests[0.0], weight(rests[0.0]) / KP, rtol=1e-3)


def test_a_law_with_other_ports_is_refused():
    other = ct.nlsys(None, lambda t, x, u, params: u[:1], inputs=["e"], outputs=["u[0]"], dt=T)
    with pytest.raises(DiagramError, match=r"q_d\[0\], q\[0\], pe\[0\]"):
        with_weight_compensation(other, weight)
