"""Where a large gap leads models astray, causes are found along the measured motion."""

import dataclasses
import math
import time

import numpy as np
import pytest

from clie_blocks.analysis.blind.many.robots import MANY_CAUSES
from clie_blocks.analysis.blind.population.files import write_trial
from clie_blocks.analysis.blind.population.maker import make_trial
from clie_blocks.analysis.gap import diagnose, read
from clie_blocks.analysis.gap.causes.drive import TIME_DELAY
from clie_blocks.analysis.gap.causes.friction import COULOMB
from clie_blocks.analysis.gap.causes.load import PAYLOAD
from clie_blocks.analysis.gap.causes.sensor import ENCODER_DELAY
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method import METHOD
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.search.along_motion import (
    following_problem,
    in_stated_loop,
    within_share_of_time,
)
from clie_blocks.analysis.gap.search.steps import SEARCH_STEPS
from clie_blocks.analysis.gap.search.strategy import search_causes
from clie_blocks.errors import DivergedError

SEARCH = METHOD.search


def test_models_follow_more_stiffly_than_the_law_holds_the_joint(healthy):
    following = following_problem(healthy, SEARCH)
    assert np.all(following.law.kp == SEARCH.following_stiffness * healthy.law.kp)
    assert np.all(following.law.kd == SEARCH.following_damping * healthy.law.kd)
    assert following_problem(following, SEARCH) is None  # they do already


def test_a_law_without_feedback_or_a_loop_that_would_be_unstable_is_left_alone(healthy):
    law = healthy.law
    for other in (dataclasses.replace(law, kp=0.0 * law.kp, kd=0.0 * law.kd),
                  dataclasses.replace(law, kd=0.0 * law.kd),
                  dataclasses.replace(law, kd=200.0 * law.kd)):  # one sample is too late for it
        assert following_problem(dataclasses.replace(healthy, law=other), SEARCH) is None


def test_a_share_of_the_time_is_taken_and_all_of_it_where_there_is_no_end(healthy):
    residuals, _ = fit_nominal(healthy, METHOD)
    assert within_share_of_time(residuals, residuals).deadline == math.inf
    now = time.monotonic()
    ending = dataclasses.replace(residuals, deadline=now + 1000.0)
    assert (within_share_of_time(residuals, ending).deadline - now
            == pytest.approx(1000.0 * SEARCH.following_time, abs=5.0))


def test_a_set_that_is_found_has_the_same_numbers_in_the_stated_loop(case):
    made = case("coulomb")
    stated = Problem.from_logs(made.robot, made.records)
    following, nominal = fit_nominal(following_problem(stated, SEARCH), METHOD)
    size = 0.05 * np.sqrt(np.mean([log.u**2 for log in stated.fit]))
    level = np.full(stated.n, size)
    coulomb = Member(COULOMB, tuple(range(stated.n)), {"level": level}, {"level": level})
    along = fit(build_hypothesis(following.problem, (coulomb,), nominal.hypothesis), following)
    residuals, nominal = fit_nominal(stated, METHOD)
    found = in_stated_loop(along, residuals)
    assert found.excess < 0.02 * nominal.excess and along.excess < 0.02 * nominal.excess
    levels = [one.hypothesis.values["coulomb.level"].max() for one in (along, found)]
    assert levels[0] == pytest.approx(levels[1], rel=0.03)


def test_a_robot_whose_models_diverge_along_the_motion_is_searched_in_the_stated_loop(case):
    made, laws = case("coulomb"), []

    def screen(residuals, nominal, causes):
        laws.append(residuals.problem.law)
        if residuals.problem.quiet:
            raise DivergedError("the model diverges")
        return SEARCH_STEPS.screen(residuals, nominal, causes)

    residuals, nominal = fit_nominal(Problem.from_logs(made.robot, made.records), METHOD)
    found = search_causes(residuals, nominal, (TIME_DELAY, ENCODER_DELAY, PAYLOAD),
                          dataclasses.replace(SEARCH_STEPS, screen=screen)).fits
    assert [np.all(law.kp == residuals.problem.law.kp) for law in laws] == [True, False]
    assert {"time_delay"} in [{member.cause.name for member in one.hypothesis.members}
                              for one in found]


@pytest.mark.slow
def test_strong_commutation_ripple_beside_three_others_is_found(tmp_path):
    """In the stated loop the wave is a radian off, and every fit ended in a false minimum."""
    made = make_trial(MANY_CAUSES, 57037, 3)
    write_trial(made, tmp_path / "trial")
    found = diagnose(read(tmp_path / "trial")).to_dict()
    likely = {row["effect"] for row in found["effects"] if row["probability"] > 0.5}
    assert likely == {effect["effect"] for effect in made.label["effects"]}
    assert not found["unexplained"]
