"""A compiled diagram is again a python-control system, with the same answers."""

import control as ct
import numpy as np
import pytest

from clie_blocks import paper
from clie_blocks.compiled import compile_diagram
from clie_blocks.diagrams.clie_composite import clie_composite
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.filters import difference_filter
from clie_blocks.signals import DiagramError

X_0 = np.linspace(-0.2, 0.3, 22)
U_0 = np.array([0.1, 0.2, 0.3, -0.1, 0.01, -0.01])


@pytest.fixture(scope="module")
def both():
    loop = clie_composite(paper.paper_arm(), paper.KP, paper.KD, 20.0, 1e-3)
    return loop, compile_diagram(loop).as_nlsys()


def test_labels_and_parameters_are_kept(both):
    loop, flat = both
    for kind in ("input_labels", "output_labels", "state_labels"):
        assert getattr(flat, kind) == getattr(loop, kind), kind
    assert flat.params.keys() == loop.params.keys() and flat.name == loop.name


def test_linearisation_is_the_same(both):
    one, two = (ct.linearize(system, X_0, U_0) for system in both)
    for kind in "ABCD":
        np.testing.assert_allclose(getattr(one, kind), getattr(two, kind), rtol=1e-9, atol=1e-9)


def test_responses_are_the_same(both):
    time = np.linspace(0, 0.05, 6)
    drive = np.tile(U_0[:, None], len(time))
    one, two = (ct.input_output_response(system, time, drive, X_0) for system in both)
    np.testing.assert_allclose(one.outputs, two.outputs, rtol=1e-9, atol=1e-12)


def test_operating_point_is_the_same():
    loop = joint_loop(paper.paper_arm(), paper.KP, paper.KD)
    flat = compile_diagram(loop).as_nlsys()
    points = [ct.find_operating_point(system, [0.8, 0.6, 0, 0], [1.0, 0.7, 0.0, 0.0])
              for system in (loop, flat)]
    np.testing.assert_allclose(points[0].states, points[1].states, rtol=1e-6, atol=1e-9)
    assert abs(points[0].states[0] - 1.0) > 1e-3  # gravity holds it off the set-point


def test_parameters_reach_the_program_and_mistyped_ones_are_refused(both):
    loop, flat = both
    changed = {"kp": np.array([3.0, 4.0])}
    np.testing.assert_allclose(flat.dynamics(0, X_0, U_0, changed),
                               loop.dynamics(0, X_0, U_0, changed), rtol=1e-11)
    with pytest.raises(DiagramError, match="did you mean 'kp'"):
        flat.dynamics(0, X_0, U_0, {"kpp": 1.0})


def test_discrete_time_stays_discrete():
    flat = compile_diagram(difference_filter(1, 0.5)).as_nlsys()
    assert flat.dt == 0.5
    np.testing.assert_allclose(flat.dynamics(0, [1.0, 2.0], [3.0]), [3.0, 1.0])
