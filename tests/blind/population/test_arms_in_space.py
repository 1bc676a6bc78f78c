"""Arms in space whose links are stated: their plan, their files, their labels."""

import numpy as np
import pytest

from clie_blocks.analysis.blind.engine import experiments
from clie_blocks.analysis.blind.engine.robot import ARTICULATED, draw_robot
from clie_blocks.analysis.blind.engine.spatial_links import MASS_TOLERANCE
from clie_blocks.analysis.blind.population import arms_in_space
from clie_blocks.analysis.blind.population.arms_in_space import ARMS_IN_SPACE, KINDS, NAMES, plan
from clie_blocks.analysis.blind.population.files import write_trial
from clie_blocks.analysis.blind.population.maker import make_trial
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records import read_trial


def test_two_laps_of_the_plan_hold_every_name_and_size():
    plans = [plan(5, index) for index in range(150)]
    single = [names[0] for kind, names, _ in plans if kind == "single"]
    assert set(single) == set(NAMES.effects)
    assert {names[0] for kind, names, _ in plans if kind == "unknown"} == set(NAMES.outsiders)
    assert {size for kind, _, size in plans if kind == "single"} == {"mild", "medium", "strong"}
    assert {size for kind, _, size in plans if kind == "unknown"} == {"medium", "strong"}
    assert sum(kind == "none" for kind, *_ in plans) == 150 * KINDS.count("none") // len(KINDS)


@pytest.fixture(scope="module")
def sound_arm():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(experiments, "DURATIONS", (3.0,))
        index = next(i for i in range(60) if plan(7002, i)[0] == "none")
        return make_trial(ARMS_IN_SPACE, 7002, index)


def test_a_trial_is_read_with_its_links_and_their_tolerance(sound_arm, tmp_path):
    write_trial(sound_arm, tmp_path)
    assert (tmp_path / sound_arm.robot.links.file).is_file()
    problem = Problem.from_logs(*read_trial(tmp_path))
    assert problem.links.known and not problem.links.is_planar
    assert problem.links.mass == pytest.approx(sound_arm.robot.links.mass)
    assert problem.nominal.mass_tolerance == MASS_TOLERANCE
    assert sound_arm.label["robot"] == f"articulated of {sound_arm.robot.n}"


def test_a_link_beyond_its_tolerance_is_one_that_others_carry():
    robot = draw_robot(np.random.default_rng(3), ARTICULATED)
    truth = {"heavier": np.zeros(robot.n)}
    changed = arms_in_space._heavier_link(np.random.default_rng(3), robot, truth)["heavier"]
    (link,) = np.flatnonzero(changed)
    assert 1 <= link <= 3 and 0.2 <= abs(changed[link]) <= 0.4
    assert not truth["heavier"].any()

