"""Excitation against an independent study, and the counterexample to "(49) implies (28)"."""

import numpy as np
import pytest

from clie_blocks import paper
from clie_blocks.analysis.theory.excitation_level import (
    excitation,
    filtered_regressor_of,
    model_regressor,
    weighted_integral,
)
from clie_blocks.compiled import compile_diagram
from clie_blocks.diagrams.clie_composite import clie_composite
from clie_blocks.diagrams.clie_loop import clie_loop
from clie_blocks.errors import NotIdentifiableError
from clie_blocks.excitation import paper_excitation
from clie_blocks.joints import decoupled_joints
from clie_blocks.signals import signal

PROGRAM = compile_diagram(clie_loop(paper.paper_arm(), paper.KP, paper.KD, paper.GAMMA))


def run_case_1(pe):
    run = PROGRAM.run(55.0, step=1e-3, every=4, inputs={"q_d": paper.SET_POINT, "pe": pe})
    return run, model_regressor(run)


@pytest.fixture(scope="module")
def case_1():
    return run_case_1(paper_excitation)


@pytest.fixture(scope="module")
def without_excitation():
    return run_case_1(0.0)


def test_fig_3_and_the_full_condition(case_1):
    run, phi = case_1
    found = [excitation(phi, run.time, window) for window in paper.WINDOWS]
    np.testing.assert_allclose([one.weighted for one in found],
                               [5.2562, 4.2170, 4.2399, 4.2462, 4.2476, 4.2479], atol=3e-4)
    np.testing.assert_allclose([one.smallest for one in found],
                               [.18211, .03396, .03370, .03087, .02909, .02793], atol=2e-5)
    np.testing.assert_allclose([one.condition_number for one in found],
                               [145, 295, 297, 324, 344, 358], rtol=4e-3)
    assert found[-1].largest == pytest.approx(10.01, abs=0.01)


def test_integral_of_fig_3_ends_at_the_weighted_level(case_1):
    run, phi = case_1
    for (_, curve), window in zip(weighted_integral(phi, run.time), paper.WINDOWS):
        assert curve[0] == 0 and np.all(np.diff(curve) >= 0)
        assert curve[-1] == pytest.approx(excitation(phi, run.time, window).weighted, rel=1e-9)


def test_weakest_direction_in_words(case_1):
    run, phi = case_1
    found = excitation(phi, run.time, (45, 55))
    assert found.weakest_in_words == "damping over inertia of joint 1"


def test_49_does_not_imply_28(without_excitation):
    """Without any excitation (49) is as positive as with it, and four parameters are invisible."""
    run, phi = without_excitation
    found = [excitation(phi, run.time, window) for window in paper.WINDOWS]
    np.testing.assert_allclose([one.weighted for one in found[:3]], [4.498, 3.2864, 3.2863],
                               atol=2e-4)
    assert all(one.rank == 2 for one in found[2:])
    assert all(np.max(one.eigenvalues[:4]) < 1e-6 for one in found[2:])
    assert found[-1].condition_number == np.inf
    np.testing.assert_allclose(signal(run, "theta_hat")[:, -1],
                               [.77, .59, 1.24, 1.15, .027, -.009], atol=6e-3)


def test_settled_gramian_of_the_matched_loop():
    loop = clie_loop(decoupled_joints(*paper.THETA.reshape(3, 2)), paper.KP, paper.KD, 20.0)
    at_rest = np.concatenate((paper.SET_POINT, np.zeros(2)))
    run = compile_diagram(loop).run(
        30.0, step=1e-3, inputs={"q_d": paper.SET_POINT, "pe": paper_excitation},
        initial_state={"update": paper.THETA, "plant": at_rest, "model": at_rest})
    found = excitation(model_regressor(run), run.time, (20, 30))
    assert found.weighted == pytest.approx(4.2334, rel=1e-3)
    assert found.smallest == pytest.approx(0.02479, rel=1e-3)
    assert found.condition_number == pytest.approx(403.7, rel=1e-3)


def test_filtered_condition_42_is_close_to_28():
    """Below the corner frequencies the filtered robot moves as the robot does."""
    loop = clie_composite(paper.paper_arm(), paper.KP, paper.KD, 20.0, 1e-4)
    run = compile_diagram(loop).run(
        35.0, step=1e-3, every=4, log=["filtered_regressor.phi_f", "dq_model", "u_model"],
        inputs={"q_d": paper.SET_POINT, "pe": paper_excitation, "noise": 0.0})
    filtered = excitation(filtered_regressor_of(run), run.time, (25, 35))
    plain = excitation(model_regressor(run), run.time, (25, 35))
    assert filtered.rank == plain.rank == 6
    assert filtered.smallest == pytest.approx(plain.smallest, rel=0.2)
    assert filtered.largest == pytest.approx(plain.largest, rel=1e-2)


def test_a_window_outside_the_run_is_refused(case_1):
    run, phi = case_1
    with pytest.raises(NotIdentifiableError, match="covers 0 to 55 s"):
        excitation(phi, run.time, (60, 70))
