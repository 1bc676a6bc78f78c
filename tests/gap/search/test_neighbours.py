"""Robots in MuJoCo with three and four causes: a mass that all joints carry, and one exchanged."""

import pytest

pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
from clie_blocks import gap  # noqa: E402
from clie_blocks.analysis.blind.many.robots import MANY_CAUSES  # noqa: E402
from clie_blocks.analysis.blind.population.files import write_trial  # noqa: E402
from clie_blocks.analysis.blind.population.maker import make_trial  # noqa: E402
from clie_blocks.analysis.gap.verdict.posterior import marginals  # noqa: E402

SEED = 4242  # of no study
OPENED = 38207  # of a published one, since opened


def diagnosed(seed, index, folder):
    """A robot of a seed, its diagnosis, and the names with half of the probability."""
    trial = make_trial(MANY_CAUSES, seed, index)
    write_trial(trial, folder)
    found = gap.diagnose(gap.read(folder))
    return trial, found, {name for name, probability in marginals(found.ranking).items()
                          if probability > 0.5}


@pytest.mark.slow
@pytest.mark.parametrize("index", [43, 67])
def test_causes_that_show_together_alone_and_behind_one_with_many_numbers(tmp_path, index):
    """Friction and drag, of which damping takes over either; heating behind a periodic torque."""
    trial, found, likely = diagnosed(OPENED, index, tmp_path)
    alike = {"asymmetric_coulomb": "coulomb"} if index == 67 else {}
    assert likely == {alike.get(name, name) for name in trial.label["labels"]}
    assert found.reduction.percent > 95.0


@pytest.mark.slow
@pytest.mark.parametrize("index", [0, 1, 11])
def test_all_causes_of_a_robot_are_named_though_one_stands_for_several_at_first(tmp_path, index):
    trial, found, likely = diagnosed(SEED, index, tmp_path)
    truth = {name for name, share in trial.label["shares"].items() if share > 0.0}
    unseen = {"load_dependent_friction"} if index == 0 else set()  # within one that waves
    assert likely >= truth - unseen
    assert found.reduction.percent > 95.0
