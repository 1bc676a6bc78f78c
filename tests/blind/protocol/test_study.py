"""A folder keeps its study, and changed trials are refused."""

import pytest

from clie_blocks.analysis.blind.protocol import study
from clie_blocks.errors import ClieError


def test_a_folder_keeps_its_study(free_study, tmp_path):
    study.make_trials(tmp_path, 2, 4)
    study.make_trials(tmp_path, 2, 4)
    with pytest.raises(ClieError, match="holds a study of 2 trials with seed 4"):
        study.make_trials(tmp_path, 2, 5)


def test_trials_that_were_changed_after_sealing_are_refused(free_study, tmp_path):
    study.make_trials(tmp_path, 2, 4)
    (tmp_path / study.TRIALS / "trial-001" / "robot.toml").write_text("joints = 2\n")
    with pytest.raises(ClieError, match="changed since they were made"):
        study.diagnose_trials(tmp_path)
