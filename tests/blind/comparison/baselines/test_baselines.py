"""Methods of today on robots on which each must work."""

import pytest

from clie_blocks.analysis.blind.comparison.baselines import BASELINES
from clie_blocks.analysis.blind.scoring.decisions import Answer


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(BASELINES))
def test_every_baseline_finds_plain_dry_friction(own_robot, name):
    problem, causes = own_robot("coulomb")
    diagnosis = BASELINES[name](problem)
    answer = Answer(diagnosis)
    assert answer.decision == "coulomb" and answer.joints["coulomb"] == {causes["coulomb"]}
    assert sum(answer.probability.values()) >= 1.0 - 1e-9 and answer.set_90[0] == "coulomb"
    assert diagnosis["gap_after"] < 0.5 * diagnosis["gap_before"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["friction menu, closed loop", "simulator parameter fit"])
def test_a_healthy_robot_has_no_friction_by_simulation(own_robot, name):
    problem, _ = own_robot("none")
    assert Answer(BASELINES[name](problem)).decision == "none"
