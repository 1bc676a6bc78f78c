"""The torque of a cause on the measured motion."""

import numpy as np
import pytest

from clie_blocks.analysis.blind.comparison.baselines.smoothed_motion import (
    opposing_torque,
    smooth_motions,
)
from clie_blocks.analysis.gap.causes.friction import COULOMB


@pytest.mark.slow
def test_the_measured_motion_has_the_torque_of_a_cause(own_robot):
    problem, _ = own_robot("coulomb")
    (motion,) = smooth_motions(problem, problem.fit[:1])
    torque = opposing_torque(motion, COULOMB, {"level": np.full(problem.n, 0.3)})
    assert np.allclose(torque, 0.3 * np.sign(motion.state.dq), atol=1e-12)
