"""Noise of an encoder, told from a joint that moves as fast."""

import numpy as np
import pytest

from clie_blocks.analysis.gap.problem.noise_above_motion import noise_above_motion
from clie_blocks.linear_filters import high_pass

RATE, CORNER, SIGMA = 1000.0, 30.0, 5e-5
TIME = np.arange(6000) / RATE
RINGING = slice(3000, 3400)


def _noise(seed: int) -> np.ndarray:
    return SIGMA * np.random.default_rng(seed).standard_normal((len(TIME), 1))


def _ringing() -> np.ndarray:
    """A step of 0.2 rad at 3 s, after which a light wrist rings at 28 Hz."""
    since = np.maximum(TIME - 3.0, 0.0)
    return (0.2 * (1.0 - np.exp(-12.0 * since) * np.cos(176.0 * since)))[:, None]


@pytest.mark.parametrize("seed", range(20))
def test_noise_alone_passes_the_filter_as_it_is(seed):
    noise = _noise(seed)
    np.testing.assert_array_equal(noise_above_motion(noise, CORNER, RATE),
                                  high_pass(noise, 2, CORNER, RATE))


def test_a_slow_motion_adds_nothing():
    noise, slow = _noise(1), 0.5 * np.sin(2.0 * np.pi * TIME)[:, None]
    difference = noise_above_motion(noise + slow, CORNER, RATE) - noise_above_motion(
        noise, CORNER, RATE)
    assert np.abs(difference[500:-500]).max() < 0.1 * SIGMA


def test_a_joint_that_rings_is_not_taken_for_noise():
    noise = _noise(2)
    moved = noise_above_motion(noise + _ringing(), CORNER, RATE)
    assert np.abs(high_pass(_ringing(), 2, CORNER, RATE)[RINGING]).max() > 100.0 * SIGMA
    assert np.abs(moved[RINGING]).max() < 6.0 * SIGMA
    assert 0.5 * SIGMA < moved[RINGING].std() < 1.3 * SIGMA
    quiet = np.r_[500:2800, 4500:5500]
    np.testing.assert_allclose(moved[quiet], noise_above_motion(noise, CORNER, RATE)[quiet],
                               atol=0.1 * SIGMA)


def test_each_joint_is_looked_at_alone():
    both = np.hstack([_noise(3), _noise(4) + _ringing()])
    noise, fast = noise_above_motion(both, CORNER, RATE), high_pass(both, 2, CORNER, RATE)
    np.testing.assert_array_equal(noise[:, 0], fast[:, 0])
    assert np.abs(noise[RINGING, 1]).max() < 0.01 * np.abs(fast[RINGING, 1]).max()


def test_an_encoder_that_rests_on_one_count_is_not_without_noise():
    """Most of the log rests, where the median is zero; in motion its rounding is noise."""
    count = 1e-3
    moved = np.where(TIME < 4.0, 0.0, 0.5 * (TIME - 4.0))[:, None]
    rounded = count * np.round(moved / count)
    noise = noise_above_motion(rounded, CORNER, RATE)
    in_motion = noise[4500:5500]
    assert 0.1 * count < in_motion.std() < 0.5 * count


def test_a_signal_that_never_changes_has_no_noise():
    assert not noise_above_motion(np.ones((1000, 2)), CORNER, RATE).any()
