"""Onsets are sought anew in every log, in one taken for a log without the fault, too."""

import pytest

from clie_blocks.analysis.gap.calibration import robots
from clie_blocks.analysis.gap.diagnosis import diagnose
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.search.event_times import refit_event_times
from clie_blocks.analysis.gap.search.events import NEVER

SET_IN = 6.0  # s


@pytest.fixture(scope="module")
def diagnosed():
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(robots.EFFECTS, "step_fault", lambda rng, joint: joint.update(
            step=0.02 * joint["kp"], step_at=SET_IN))
        made, = robots.draw_cases(1, 2, ["step_fault"], ["single"], duration=12.0)
    found = diagnose(Problem.from_logs(made.robot, made.records),
                     effects=("step_fault", "friction_drift"))
    right = next(row.fit for row in found.evidence.rows if row.names == ("step_fault",))
    return found.residuals, right, made.causes["step_fault"] - 1


def displaced(right, k, change):
    at = right.hypothesis
    key = next(key for key in at.values if key.endswith(".onset"))
    moments = at.values[key].copy()
    for log, moment in change.items():
        moments[log, k] = moment
    return key, at.with_values({**at.values, key: moments})


@pytest.mark.slow
@pytest.mark.parametrize("change", [{0: NEVER}, {1: SET_IN + 0.4}, {0: SET_IN - 0.3, 2: NEVER}])
def test_an_onset_that_was_missed_is_found_again(diagnosed, change):
    residuals, right, k = diagnosed
    key, at = displaced(right, k, change)
    wrong = fit(at, residuals, 0)
    again = refit_event_times(wrong, residuals)
    assert wrong.total > right.total + 1000.0
    assert again.hypothesis.values[key][:, k] == pytest.approx(SET_IN, abs=0.02)
    assert again.total < right.total + 20.0
