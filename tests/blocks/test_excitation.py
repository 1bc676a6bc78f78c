import numpy as np
import pytest
from scipy.signal import chirp as scipy_chirp
from scipy.signal import sawtooth

from clie_blocks.excitation import (
    chirp,
    multisine,
    paper_excitation,
    source,
    steps,
    triangle,
)
from clie_blocks.signals import DiagramError

TIME = np.linspace(0, 10, 2001)


def over_time(f, *arguments):
    return np.array([f(t, *arguments) for t in TIME])


def test_paper_excitation_has_two_tones_and_no_mean():
    time = np.arange(0, 20, 0.01)
    lines = np.abs(np.fft.rfft([paper_excitation(t) for t in time])) / (len(time) / 2)
    f = np.fft.rfftfreq(len(time), 0.01)
    strong = {round(float(x), 6) for x in f[lines > 1e-9]}
    assert strong == {0.5, 1.0}
    assert lines[np.isclose(f, 1.0)] == pytest.approx(0.7)
    assert lines[np.isclose(f, 0.5)] == pytest.approx(np.hypot(0.5, 0.25))


def test_paper_excitation_is_what_makes_the_pd_bound():
    """max ||B PE - D|| = 0.876945 at t = 1.7331 s with the real values of Table 2."""
    from clie_blocks import paper

    time = np.arange(0, 2, 1e-4)
    b, d = paper.THETA[2:4], paper.THETA[4:]
    norm = np.linalg.norm(np.outer(paper_excitation(time), b) - d, axis=1)
    assert norm.max() == pytest.approx(0.876945, abs=1e-5)
    assert time[norm.argmax()] == pytest.approx(1.7331, abs=1e-3)


def test_multisine_has_the_power_of_its_tones():
    f = np.arange(1, 21)
    one = over_time(multisine, f, 1.0)
    assert np.mean(one[:-1] ** 2) == pytest.approx(10.0)


def test_multisine_runs_over_the_joints():
    value = multisine(0.3, np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([[1.0, 0.5], [2.0, 0.0]]))
    assert value == pytest.approx([np.sin(0.6 * np.pi) + 0.5 * np.sin(1.2 * np.pi),
                                   2 * np.sin(1.8 * np.pi)])


def test_chirp_against_scipy():
    ours = over_time(chirp, 0.1, 5.0, 10.0, 2.0)
    theirs = 2.0 * scipy_chirp(TIME, 0.1, 10.0, 5.0, method="logarithmic", phi=-90)
    np.testing.assert_allclose(ours, theirs, atol=1e-10)


def test_triangle_against_scipy_and_its_constant_speed():
    ours = over_time(triangle, 4.0, 0.5)
    theirs = 0.5 * sawtooth(2 * np.pi * TIME / 4.0 + np.pi / 2, 0.5)
    np.testing.assert_allclose(ours, theirs, atol=1e-12)
    assert np.median(np.abs(np.gradient(ours, TIME))) == pytest.approx(4 * 0.5 / 4.0)


def test_steps_hold_their_levels():
    times, levels = [1.0, 2.0, 5.0], [0.5, -0.5, 2.0]
    assert [steps(t, times, levels) for t in (0.5, 1.0, 1.9, 2.0, 9.0)] == [0, 0.5, 0.5, -0.5, 2]
    np.testing.assert_allclose(steps(3.0, times, [levels, [1.0, 1.0, 1.0]]), [-0.5, 1.0])


def test_source_is_a_block_without_inputs():
    block = source(paper_excitation, "pe", 2)
    assert block.ninputs == 0 and block.output_labels == ["pe[0]", "pe[1]"]
    np.testing.assert_allclose(block.output(0.3, [], []), [paper_excitation(0.3)] * 2)
    np.testing.assert_array_equal(source([1.0, 2.0], "q_d", 2).output(5.0, [], []), [1.0, 2.0])


def test_source_of_the_wrong_size_is_named():
    with pytest.raises(DiagramError, match=r"source 'pe'.*shape \(3,\).*2 joints"):
        source(lambda t: np.zeros(3), "pe", 2)
