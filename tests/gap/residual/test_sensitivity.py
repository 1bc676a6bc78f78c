"""How the noise of a sensor reaches the joints."""

import numpy as np
import pytest

from clie_blocks.analysis.gap.residual.sensitivity import noise_responses


def test_own_noise_is_what_one_joint_alone_makes_of_it(healthy):
    inertia, damping = healthy.nominal.inertia, healthy.nominal.damping
    own = noise_responses(healthy, 0, inertia, damping)[0]
    b, a = healthy.law.sensor_sensitivity(0, inertia[0], damping[0])
    rebuilt = np.convolve(own, a)[:len(own)]  # a times the response is b, and then nothing
    assert rebuilt[:len(b)] == pytest.approx(b, abs=1e-9)
    assert np.abs(rebuilt[len(b):]).max() < 1e-9
