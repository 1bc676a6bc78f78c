import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from clie_blocks.measurement import encoder, noisy_measurement, quantized


@given(st.floats(-10, 10), st.floats(1e-5, 0.1))
def test_rounding_is_within_half_a_step_and_idempotent(q, resolution):
    rounded = quantized(q, resolution)
    assert abs(rounded - q) <= resolution / 2 * (1 + 1e-9)
    assert abs(rounded / resolution - np.round(rounded / resolution)) < 1e-6
    assert quantized(rounded, resolution) == rounded


def test_zero_resolution_leaves_the_position_bit_for_bit():
    q = np.array([0.1, -np.pi, 1e-300])
    np.testing.assert_array_equal(encoder([0.0, 0.0, 0.0]).output(0, [], q), q)


def test_noise_is_added_and_the_block_is_linear():
    block = noisy_measurement(2)
    np.testing.assert_allclose(block.D @ [1.0, 2.0, 0.1, -0.1], [1.1, 1.9])
    assert block.nstates == 0
