"""An arm in MuJoCo whose light wrist rings after every step, faster than joints usually move."""

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
from clie_blocks import gap  # noqa: E402
from clie_blocks.analysis.blind.population.arms_in_space import ARMS_IN_SPACE  # noqa: E402
from clie_blocks.analysis.blind.population.files import write_trial  # noqa: E402
from clie_blocks.analysis.blind.population.maker import make_trial  # noqa: E402

ARM, WRIST = (7411, 0), 5  # seed and number of an arm whose wrist rings at 25 Hz


@pytest.mark.slow
def test_a_wrist_that_rings_hides_no_friction_of_the_shoulder(tmp_path):
    """The ringing was taken for noise of the encoder, with which every model rang along."""
    trial = make_trial(ARMS_IN_SPACE, *ARM)
    write_trial(trial, tmp_path)
    problem = gap.read(tmp_path)
    taken_for_noise = max(np.abs(log.dither[:, WRIST]).max() for log in problem.logs)
    assert taken_for_noise < 10.0 * trial.robot.sigma[WRIST]
    found = gap.diagnose(problem)
    assert trial.label["labels"] == ["stribeck"]
    assert found.ranking[0].names == ("stribeck",)
    assert found.reduction.after < 1.1 * found.reduction.floor
