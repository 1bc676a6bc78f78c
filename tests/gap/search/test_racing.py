"""Which candidates a race begins: those that may come near the best fit."""

from types import SimpleNamespace

import numpy as np
import pytest

from clie_blocks.analysis.gap.causes.drive import ACTUATOR_LAG, TIME_DELAY
from clie_blocks.analysis.gap.causes.friction import COULOMB
from clie_blocks.analysis.gap.causes.load import PAYLOAD, SPRING
from clie_blocks.analysis.gap.causes.timed import STEP_FAULT
from clie_blocks.analysis.gap.fitting.hypothesis import Member
from clie_blocks.analysis.gap.method import METHOD
from clie_blocks.analysis.gap.search import racing
from clie_blocks.analysis.gap.search.candidates import Candidate

SAMPLES = 1000.0
STEP = STEP_FAULT[0]


def fitted(left, *causes):
    """A fit of one joint and one log that leaves an excess per sample."""
    members = [SimpleNamespace(cause=cause, name=cause.key) for cause in causes]
    hypothesis = SimpleNamespace(members=members, free_parameters=(),
                                 problem=SimpleNamespace(fit=(None,), fit_runs=1))
    return SimpleNamespace(hypothesis=hypothesis, samples=np.array([[SAMPLES]]),
                           cost=(1.0 + left) * SAMPLES)


def parts(*causes):
    """Members of a candidate, as far as a race looks at them."""
    return tuple(SimpleNamespace(cause=cause) for cause in causes)


def candidate(left, *causes):
    """A candidate that is predicted to leave an excess, and extends a fit that leaves 100."""
    return Candidate(parts(*causes), (100.0 - left) * SAMPLES, fitted(100.0, *causes[:-1]))


def test_what_is_predicted_of_a_candidate_is_the_excess_that_it_would_leave():
    assert racing.predicted_excess(candidate(3.0, SPRING, COULOMB)) == pytest.approx(3.0)


@pytest.mark.parametrize("left, competes", [(5.0, True), (24.0, True), (26.0, False)])
def test_a_cause_that_is_predicted_to_stay_far_behind_the_best_is_not_begun(left, competes):
    best = fitted(2.0, SPRING, ACTUATOR_LAG)
    assert racing.can_compete(candidate(left, SPRING, COULOMB), best, METHOD) == competes


def test_a_cause_of_the_best_is_begun_with_another_one_whatever_is_predicted():
    best = fitted(0.0, SPRING, ACTUATOR_LAG)
    assert racing.can_compete(candidate(90.0, COULOMB, ACTUATOR_LAG), best, METHOD)
    assert not racing.can_compete(candidate(90.0, COULOMB, TIME_DELAY), best, METHOD)


@pytest.mark.parametrize("left, whole, worth_it", [
    (79.0, 300.0, True), (81.0, 300.0, False), (49.0, 100.0, True), (51.0, 100.0, False)])
def test_a_further_cause_must_be_predicted_to_explain_a_fair_share_of_what_is_left(
    left, whole, worth_it
):
    further = candidate(left, SPRING, COULOMB)
    assert racing.worth_extending(further, fitted(whole), METHOD) == worth_it


def test_onsets_are_sought_anew_only_where_a_cause_has_explained_a_fair_share():
    assert racing.explains_fair_share(fitted(79.0, STEP), fitted(100.0), METHOD)
    assert not racing.explains_fair_share(fitted(81.0, STEP), fitted(100.0), METHOD)


def test_nothing_more_is_looked_for_where_the_logs_to_fit_are_explained():
    done = fitted(-0.1, SPRING)
    more = Candidate((SimpleNamespace(cause=COULOMB),), 0.2 * SAMPLES, done)
    assert not racing.worth_extending(more, fitted(100.0), METHOD)


def extending_nominal(left, *causes):
    """Causes that are predicted to leave an excess, of a nominal model that leaves 100."""
    return Candidate(tuple(SimpleNamespace(cause=cause) for cause in causes),
                     (100.0 - left) * SAMPLES)


def test_a_pair_must_be_predicted_to_leave_less_than_the_best_single_cause_does():
    alone = [extending_nominal(40.0, SPRING), extending_nominal(60.0, COULOMB)]
    pairs = [extending_nominal(5.0, SPRING, COULOMB), extending_nominal(35.0, SPRING, TIME_DELAY)]
    kept = racing.pairs_worth_fitting(pairs, alone, [fitted(30.0, SPRING)],
                                      fitted(100.0), METHOD)
    assert kept == pairs[:1]


def test_where_a_fit_does_far_better_than_predicted_no_prediction_counts():
    alone = [extending_nominal(40.0, SPRING)]
    pairs = [
        extending_nominal(35.0, COULOMB, TIME_DELAY),
        extending_nominal(5.0, SPRING, TIME_DELAY),
    ]
    kept = racing.pairs_worth_fitting(pairs, alone, [fitted(10.0, SPRING)],
                                      fitted(100.0), METHOD)
    assert kept == pairs[:1]  # what may be added to the spring, its own extensions show


@pytest.mark.parametrize("left, far", [(50.0, True), (5.0, False)])
def test_a_part_of_a_leader_is_left_where_it_starts_far_behind(left, far):
    leader = fitted(1.0, SPRING, COULOMB)
    assert racing.starts_far_behind(fitted(left, COULOMB), leader, fitted(100.0), METHOD) == far


@pytest.mark.parametrize(("deviations", "needed"), [(5.0, False), (400.0, True)])
def test_a_cause_is_needed_where_it_is_far_from_nothing_with_all_others_free(deviations, needed):
    """However far off a model starts that merely lacks it."""
    sigma = 0.02
    members = [Member(cause, (0,), {}, {}) for cause in (COULOMB, SPRING)]
    leader = fitted(1.0)
    leader.hypothesis.members = members
    leader.hypothesis.free_parameters = [
        SimpleNamespace(key=f"{member.name}.{member.cause.numbers[0].name}")
        for member in members]
    leader.hypothesis.get = lambda parameter: deviations * sigma
    leader.covariance = np.diag([1e-9, sigma**2])
    assert racing.is_needed(leader, members[:1], fitted(50.0), METHOD) == needed


def test_only_a_fit_without_one_of_its_causes_is_a_part_of_it():
    leader = fitted(1.0, SPRING, COULOMB)
    assert racing.part_of(Candidate(parts(COULOMB), 0.0, leader)) is leader
    assert racing.part_of(Candidate(parts(ACTUATOR_LAG), 0.0, leader)) is None
    assert racing.part_of(Candidate(parts(COULOMB), 10.0, leader)) is None  # an extension
    assert racing.part_of(Candidate(parts(COULOMB), 0.0)) is None


def test_alternatives_and_pairs_that_extend_the_nominal_model_are_always_begun():
    best = fitted(0.0, SPRING)
    for after in (None, fitted(100.0, COULOMB)):
        alike = Candidate((SimpleNamespace(cause=COULOMB),), 0.0, after)
        assert racing.can_compete(alike, best, METHOD)


@pytest.mark.parametrize("left, score, whole, outclassed", [
    (0.0, 60.0, 300.0, False), (0.0, 40.0, 300.0, True), (2.0, 40.0, 300.0, False),
    (0.0, 40.0, 0.1, False)])
def test_beside_a_cause_that_leaves_noise_of_a_large_gap_only_near_predictions_are_fitted(
    left, score, whole, outclassed
):
    alone = Candidate((SimpleNamespace(cause=COULOMB),), score * SAMPLES)
    assert racing.is_outclassed(alone, fitted(left, SPRING), 100.0 * SAMPLES, fitted(whole),
                                METHOD) == outclassed


def test_a_cause_that_all_joints_share_is_never_outclassed():
    """The screening goes joint by joint: it lets each joint have link masses of its own."""
    alone = Candidate(parts(PAYLOAD), 1.0 * SAMPLES)
    assert not racing.is_outclassed(alone, fitted(0.0, SPRING), 100.0 * SAMPLES, fitted(300.0),
                                    METHOD)


@pytest.mark.parametrize(("left", "leads"), [(20.0, False), (2.0, True)])
def test_a_set_leads_where_what_it_explains_pays_its_further_cause(left, leads):
    whole = fitted(1000.0)
    alone, both = (SimpleNamespace(hypothesis=fit.hypothesis, excess=excess) for fit, excess in (
        (fitted(30.0, SPRING), 30.0), (fitted(left, SPRING, COULOMB), left)))
    whole.excess = 1000.0
    against = [racing.odds_against(fit, whole, METHOD) for fit in (both, alone)]
    assert (against[0] < against[1]) == leads


def test_of_two_that_leave_the_same_the_one_with_fewer_parameters_leads(monkeypatch):
    """A disturbance with a phase in each log explains much that it has no part in."""
    spent = {"payload": 1.0, "spring": 1.0, "coulomb": 9.0}
    monkeypatch.setattr(racing, "parameter_count", lambda fit: sum(
        spent[member.cause.name] for member in fit.hypothesis.members))
    whole, few, many = (SimpleNamespace(hypothesis=fitted(0.0, *causes).hypothesis, excess=left)
                        for left, causes in ((1e3, ()), (70.0, [PAYLOAD, SPRING]),
                                             (60.0, [PAYLOAD, COULOMB])))
    against = [racing.odds_against(fit, whole, METHOD) for fit in (few, many)]
    assert against[0] < against[1]


def test_a_prediction_that_a_fit_does_not_keep_outclasses_nothing(monkeypatch):
    left = {TIME_DELAY: 250.0, SPRING: 0.0, COULOMB: 0.1, ACTUATOR_LAG: 5.0}
    scores = {TIME_DELAY: 400.0, SPRING: 60.0, COULOMB: 59.0, ACTUATOR_LAG: 20.0}
    monkeypatch.setattr(racing, "initial_guess", lambda candidate, *_: candidate)
    monkeypatch.setattr(racing, "_first_steps", lambda start, candidate, *_: fitted(
        left[candidate.members[0].cause], candidate.members[0].cause))
    residuals = SimpleNamespace(method=METHOD, is_out_of_time=False)
    begun = racing._first_fits(residuals, fitted(300.0), [
        Candidate(parts(cause), score * SAMPLES) for cause, score in scores.items()])
    assert [one.hypothesis.members[0].cause for one in begun] == [TIME_DELAY, SPRING, COULOMB]
