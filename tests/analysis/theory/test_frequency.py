"""Linear analysis of the diagrams against formulas written by hand and python-control's own."""

import control as ct
import numpy as np
import pytest

from clie_blocks import paper
from clie_blocks.analysis.theory.frequency import (
    PAPER_TONES,
    closed_loop_poles,
    filter_response,
    gain_sweep,
    margins,
    noise_gain,
)
from clie_blocks.analysis.theory.opening import cut_open, on_path, transfer
from clie_blocks.compiled import compile_diagram, held_normal
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.errors import NotIdentifiableError
from clie_blocks.filters import lowpass, velocity_filter
from clie_blocks.joints import decoupled_joints
from clie_blocks.signals import DiagramError, interconnect, signal

A, B, D = paper.THETA.reshape(3, 2)
PLANT = decoupled_joints(A, B, D)
TONES = 2 * np.pi * np.array(PAPER_TONES)
S = ct.tf("s")
G1 = 200 * S / (S + 200) * 300 / (S + 300)


def test_filters_are_the_formulas():
    omega = np.logspace(-1, 4, 50)
    found = filter_response(velocity_filter(2), omega, derivative=True)
    np.testing.assert_allclose(found.response, G1(1j * omega), rtol=1e-9)
    np.testing.assert_allclose(filter_response(lowpass(1), omega).response,
                               (300 / (S + 300))(1j * omega), rtol=1e-9)


def test_errors_at_the_excitations_own_frequencies():
    g_1 = filter_response(velocity_filter(1), TONES, derivative=True)
    np.testing.assert_allclose(1e3 * g_1.delay, 1e3 * (1 / 200 + 1 / 300), atol=3e-3)
    expected = 1 / np.sqrt((1 + (TONES / 200) ** 2) * (1 + (TONES / 300) ** 2)) - 1
    np.testing.assert_allclose(g_1.amplitude_error, expected, rtol=1e-6)
    assert np.all(np.abs(g_1.amplitude_error) < 1e-3)


def test_noise_gain_of_short_samples_is_the_h2_norm():
    """White noise of density variance x period: ||6e4 s / (s^2 + 500 s + 6e4)||_2^2 = 3.6e6."""
    assert noise_gain(velocity_filter(1), 1e-5) == pytest.approx(np.sqrt(3.6e6 * 1e-5), rel=2e-3)


@pytest.mark.parametrize("period", [1e-3, 1e-2])
def test_noise_gain_is_what_a_run_shows(period):
    block = velocity_filter(1)
    diagram = interconnect([block], [], inputs={"q": f"{block.name}.q"},
                           outputs={"dq": f"{block.name}.dq"}, name="alone")
    run = compile_diagram(diagram).run(100.0, step=1e-4, every=3,
                                       inputs={"q": held_normal(1.0, 3, period=period)})
    assert np.std(signal(run, "dq")) == pytest.approx(noise_gain(block, period), rel=0.03)


def test_poles_without_filter_are_the_roots_by_hand():
    found = closed_loop_poles(PLANT, paper.KP, paper.KD)
    by_hand = np.concatenate([np.roots([1, a + b * 5, b * 10]) for a, b in zip(A, B)])
    np.testing.assert_allclose(np.sort(found.values), np.sort(by_hand), atol=1e-6)
    np.testing.assert_allclose(found.damping, 1)
    assert found.stable


def test_poles_with_filter_are_the_roots_by_hand():
    found = closed_loop_poles(PLANT, paper.KP, paper.KD, filtered=True)
    by_hand = np.concatenate([
        np.roots(np.polyadd(np.polymul([1, a, 0], np.polymul([1, 200], [1, 300])),
                            b * np.polyadd(10 * np.polymul([1, 200], [1, 300]), [5 * 6e4, 0])))
        for a, b in zip(A, B)])
    np.testing.assert_allclose(np.sort_complex(found.values), np.sort_complex(by_hand), atol=1e-4)


@pytest.mark.parametrize("filtered", [False, True])
def test_margins_are_those_of_the_loop_by_hand(filtered):
    found = margins(PLANT, paper.KP, paper.KD, 1, filtered=filtered)
    by_hand = B[1] * (10 + 5 * (G1 if filtered else S)) / (S * (S + A[1]))
    gain, phase, _, _, crossover, _ = ct.stability_margins(by_hand)
    assert found.gain == pytest.approx(gain, rel=1e-4)
    assert found.phase == pytest.approx(phase, abs=1e-4)
    assert found.crossover == pytest.approx(crossover, rel=1e-5)
    omega = np.logspace(-1, 3, 20)
    s, t = found.sensitivities(omega)
    np.testing.assert_allclose(s, 1 / (1 + by_hand(1j * omega)), rtol=1e-5)
    np.testing.assert_allclose(s + t, 1)


def test_the_filters_lag_eats_margin():
    bare, lagging = (margins(PLANT, paper.KP, paper.KD, 0, filtered=f) for f in (False, True))
    assert bare.gain == np.inf and lagging.gain == pytest.approx(201.1, abs=0.2)
    assert bare.phase - lagging.phase == pytest.approx(0.738, abs=2e-3)
    assert lagging.delay < bare.delay


def test_gain_margin_is_where_the_poles_cross_the_axis():
    factor = margins(PLANT, paper.KP, paper.KD, 0, filtered=True).gain
    inside, outside = gain_sweep(PLANT, paper.KP, paper.KD, [0.99 * factor, 1.02 * factor],
                                 filtered=True)
    assert np.all(inside.real < 0) and np.any(outside.real > 0)


def test_gravity_gives_the_arm_a_smallest_gain():
    """Pointing up, the arm is a pendulum that falls when the loop is too weak."""
    found = margins(paper.paper_arm(), paper.KP, paper.KD, 0, q=paper.SET_POINT)
    assert 0.005 < found.least_gain < 0.01
    weak = closed_loop_poles(paper.paper_arm(), 1e-3 * paper.KP, paper.KD, q=[np.pi / 2, 0.0])
    assert not weak.stable


def test_opened_loop_closes_to_the_diagram():
    loop = joint_loop(PLANT, paper.KP, paper.KD)
    around = -transfer(loop, "plant.u")
    np.testing.assert_allclose(
        np.sort(ct.feedback(around, np.eye(2)).poles()),
        np.sort(closed_loop_poles(PLANT, paper.KP, paper.KD).values), atol=1e-5)
    cut = cut_open(loop, "plant.u[1]")
    assert cut.input_labels[-1] == "cut[0]" and cut.output_labels[-1] == "driver[0]"
    assert loop.ninputs == 4 and loop.noutputs == 6  # the diagram itself is untouched


def test_on_path_keeps_the_transfer():
    system = ct.ss(np.diag([-1.0, -2.0, -3.0]), [[1], [1], [0]], [[1, 0, 1]], 0)
    small = on_path(system)
    assert small.nstates == 1
    np.testing.assert_allclose(small(2j), system(2j))


@pytest.mark.parametrize("port, message", [("plnt.u", "did you mean 'plant'"),
                                           ("plant.uu", "did you mean 'u'")])
def test_unknown_ports_are_named(port, message):
    with pytest.raises(DiagramError, match=message):
        cut_open(joint_loop(PLANT, paper.KP, paper.KD), port)


def test_margins_of_a_loop_without_crossover_are_refused():
    """A joint held by its own strong spring: the loop gain stays below one at all frequencies."""
    spring = ct.nlsys(lambda t, x, u, p: np.array([x[1], u[0] - 100 * x[0] - 50 * x[1]]),
                      lambda t, x, u, p: x, name="plant", states=2, inputs=["u[0]"],
                      outputs=["q[0]", "dq[0]"])
    with pytest.raises(NotIdentifiableError, match="never crosses one"):
        margins(spring, [1.0], [1.0], 0)
