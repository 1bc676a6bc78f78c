"""Where a search had to stop, its leading set loses the causes that explain nothing."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.causes import CAUSES, drive, friction
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.search.fewer import with_other_delays, without_idle_causes


@pytest.fixture(scope="module")
def stopped(case):
    """Residual model whose time is over, refitted nominal model, and dry friction that is there
    beside a gain and a lag that are not."""
    made = case("coulomb")
    residuals, nominal = fit_nominal(Problem.from_logs(made.robot, made.records), METHOD)
    n = made.robot.n
    torque = np.sqrt(np.mean(nominal.hypothesis.problem.fit[0].u**2, axis=0))
    members = [Member(friction.COULOMB, tuple(range(n)), {"level": 0.05 * torque},
                      {"level": 0.05 * torque}),
               Member(drive.TORQUE_GAIN_ERROR, (0,), {"error": np.zeros(n)},
                      {"error": np.full(n, 0.05)}),
               Member(drive.ACTUATOR_LAG, (0,), {"lag": np.zeros(n)}, {"lag": np.full(n, 1e-3)})]
    leader = fit(build_hypothesis(nominal.hypothesis.problem, members, nominal.hypothesis),
                 residuals)
    return dataclasses.replace(residuals, deadline=-np.inf), nominal, leader


def names(one):
    return {member.cause.name for member in one.hypothesis.members}


def test_causes_that_explain_nothing_are_left_out_one_after_the_other(stopped):
    residuals, nominal, leader = stopped
    smaller = without_idle_causes(leader, [leader], nominal, residuals)
    assert [len(names(one)) for one in smaller] == [2, 1]
    assert names(smaller[-1]) == {"coulomb"}
    assert smaller[-1].excess == pytest.approx(leader.excess, abs=0.05)


def test_a_cause_that_is_needed_and_sets_that_were_fitted_stay_as_they_are(stopped):
    residuals, nominal, leader = stopped
    smaller = without_idle_causes(leader, [leader], nominal, residuals)
    assert without_idle_causes(smaller[-1], [leader, *smaller], nominal, residuals) == []
    again = without_idle_causes(leader, [leader, *smaller], nominal, residuals)
    assert all(names(one) != names(smaller[0]) for one in again)


def test_a_delay_that_stands_for_a_lag_gives_way_to_it_after_the_time(case):
    made = case("actuator_lag")
    residuals, nominal = fit_nominal(Problem.from_logs(made.robot, made.records), METHOD)
    n = made.robot.n
    delay = Member(drive.TIME_DELAY, tuple(range(n)), {"delay": np.full(n, 2e-3)},
                   {"delay": np.full(n, 2e-3)})
    leader = fit(build_hypothesis(nominal.hypothesis.problem, [delay], nominal.hypothesis),
                 residuals)
    stopped = dataclasses.replace(residuals, deadline=-np.inf)
    (lag,) = with_other_delays(leader, [leader], CAUSES, stopped)
    assert names(lag) == {"actuator_lag"} and lag.excess < leader.excess
    assert with_other_delays(leader, [leader, lag], CAUSES, stopped) == []
    assert with_other_delays(leader, [leader], [drive.TIME_DELAY], stopped) == []
