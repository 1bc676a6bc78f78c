"""How far the search over several causes goes: what is left, and what a further one predicts."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.causes.drive import (
    ACTUATOR_LAG,
    TIME_DELAY,
    TORQUE_GAIN_ERROR,
    TORQUE_RIPPLE,
)
from clie_blocks.analysis.gap.causes.friction import COULOMB, QUADRATIC_DRAG
from clie_blocks.analysis.gap.causes.load import PAYLOAD, SPRING
from clie_blocks.analysis.gap.fitting.hypothesis import Member
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.problem.problem import holds_stably
from clie_blocks.analysis.gap.search import strategy
from clie_blocks.analysis.gap.search.candidates import Candidate
from clie_blocks.analysis.gap.search.contest import Contest
from clie_blocks.analysis.gap.search.further_causes import one_more_cause
from clie_blocks.analysis.gap.search.screening import Screen
from clie_blocks.analysis.gap.search.steps import SEARCH_STEPS
from clie_blocks.analysis.gap.search.strategy import search_causes

WHOLE = 1000.0  # excess of the refitted nominal model
SAMPLES = 1000.0


MEMBERS = [Member(dataclasses.replace(cause, numbers=()), (0,), {}, {}) for cause in (
    SPRING, ACTUATOR_LAG, TORQUE_GAIN_ERROR, COULOMB, TIME_DELAY, TORQUE_RIPPLE,
    QUADRATIC_DRAG)]


@dataclasses.dataclass(frozen=True, eq=False)
class StubFit:
    """A fit of one joint and one log that leaves an excess per sample."""

    excess: float
    members: tuple

    @property
    def hypothesis(self):
        return SimpleNamespace(members=self.members, free_parameters=(),
                               problem=SimpleNamespace(fit=(None,), fit_runs=1),
                               values={"inertia": np.ones(1), "damping": np.ones(1)})

    @property
    def total(self):
        return (1.0 + self.excess) * SAMPLES

    cost, penalty = total, 0.0
    samples = np.array([[SAMPLES]])


@pytest.fixture
def searched():
    """Function from what sets leave, and what the next cause predicts, to the fits made."""
    def run(pair, third, more=(1.0,), together=None):
        left = dict(enumerate((900.0, pair, *more), 1))  # by the number of causes

        def singles(screen, residuals, fit, causes):
            count = len(fit.members)
            gain = pair - third if count == 2 else 0.6 * WHOLE if count < 2 else fit.excess
            return [Candidate((MEMBERS[count],), gain * SAMPLES)]

        def race(residuals, nominal, candidates, finalists):
            return [StubFit(left.get(len(candidate.members), more[-1]), candidate.members)
                    for candidate in candidates]

        def pairs(screen, method):
            """Two causes more of what a fit leaves, where they are predicted to leave a share."""
            if together is None or screen is None:
                return []
            count = len(screen.members)
            return [Candidate((MEMBERS[count], MEMBERS[count + 1]),
                              (1.0 - together) * screen.excess * SAMPLES)]

        steps = dataclasses.replace(
            SEARCH_STEPS, screen=lambda *_: None, singles=singles, pairs=pairs, race=race,
            screen_residual=lambda screen, residuals, fit: fit,
            wrong_numbers=lambda problem: [], drive_gains=lambda *_: [],
            prune=lambda fit, residuals, excess_of_nominal: fit)
        method = METHOD.with_values(**{"search.alternative_rounds": 0,
                                       "search.neighbour_rounds": 0})
        loopless = SimpleNamespace(holds_joints=False)
        problem = SimpleNamespace(n=1, law=loopless, quiet=True)
        residuals = SimpleNamespace(method=method, problem=problem, is_out_of_time=False)
        return search_causes(residuals, StubFit(WHOLE, ()), CAUSES, steps).fits
    return run


@pytest.mark.parametrize("pair, third, sought", [
    (290.0, 280.0, True),  # the pair explains most of it: a third is sought in any case
    (310.0, 80.0, True),  # it does not, but a third is predicted to explain most of the rest
    (310.0, 100.0, False),  # neither
    (2.0, 0.0, True),  # the same, of little
    (0.2, 0.0, False)])  # nothing is left
def test_a_third_cause_is_sought_where_a_pair_does_well_or_a_third_is_predicted_to(
        searched, pair, third, sought):
    fits = searched(pair, third)
    assert any(len(fit.members) == 2 for fit in fits)
    assert any(len(fit.members) == 3 for fit in fits) == sought


@pytest.mark.parametrize("more, largest", [
    ((80.0, 30.0, 0.1), 5),  # each pays, until nothing is left
    ((80.0, 30.0, 9.0, 3.0, 1.0), 6),  # never more than six
    ((80.0, 80.0, 0.1), 4)])  # a fourth that gains nothing ends it
def test_causes_are_added_one_by_one_while_they_pay(searched, more, largest):
    assert max(len(fit.members) for fit in searched(290.0, 280.0, more)) == largest


@pytest.mark.parametrize("together, largest", [(0.01, 3), (0.5, 2), (None, 2)])
def test_two_causes_are_added_where_one_does_not_pay_and_both_are_predicted_to(
        searched, together, largest):
    fits = searched(890.0, 880.0, (0.1,), together)
    assert max(len(fit.members) for fit in fits) == largest


@pytest.fixture
def arm(monkeypatch):
    """Function from what sets of causes of two joints leave to the sets that were fitted."""
    def run(alone, of_joints, beside_payload):
        one, two, payload = (dataclasses.replace(cause, numbers=()) for cause in (
            COULOMB, TIME_DELAY, PAYLOAD))
        member_of = {cause: Member(cause, (0, 1), {}, {}) for cause in (one, two, payload)}
        left = {frozenset({one}): alone, frozenset({one, two}): of_joints,
                frozenset({one, two, payload}): beside_payload}

        def race(residuals, nominal, candidates, finalists):
            return [StubFit(left.get(frozenset(member.cause for member in each.members), WHOLE),
                            each.members) for each in candidates]

        def singles(screen, residuals, fit, causes):
            """Without causes to search for, those that change the links."""
            return [Candidate((member_of[one if causes else payload],), 0.5 * SAMPLES)]

        monkeypatch.setattr(strategy, "of_each_joint", lambda *_: [])
        monkeypatch.setattr(strategy, "fit_joint_by_joint", lambda base, *_: [
            StubFit(of_joints, (member_of[one], member_of[two]))] * (not base.members))
        paired = []
        steps = dataclasses.replace(
            SEARCH_STEPS, screen=lambda *_: Screen([], [], 1), singles=singles, race=race,
            pairs=lambda screen, method: paired.append(1) or [],
            screen_residual=lambda screen, residuals, fit: screen,
            wrong_numbers=lambda problem: [], drive_gains=lambda *_: [],
            prune=lambda fit, residuals, excess_of_nominal: fit)
        method = METHOD.with_values(**{"search.alternative_rounds": 0,
                                       "search.neighbour_rounds": 0})
        residuals = SimpleNamespace(
            method=method, is_out_of_time=False,
            problem=SimpleNamespace(n=2, law=SimpleNamespace(holds_joints=False), quiet=True))
        fits = search_causes(residuals, StubFit(WHOLE, ()), CAUSES, steps).fits
        return {frozenset(member.cause.name for member in fit.members) for fit in fits}, paired
    return run


def test_a_payload_is_tried_beside_the_causes_of_all_joints_before_any_pair(arm):
    """Alone it explains next to nothing, though it costs most once these are there."""
    sets, paired = arm(alone=900.0, of_joints=700.0, beside_payload=0.1)
    assert {"coulomb", "time_delay", "payload"} in sets and not paired


@pytest.mark.parametrize("alone, of_joints", [(100.0, 90.0), (900.0, 950.0)])
def test_pairs_are_tried_where_one_cause_explains_most_or_the_set_explains_less(
        arm, alone, of_joints):
    assert arm(alone, of_joints, beside_payload=80.0)[1]


def test_a_set_of_all_joints_grows_again_without_what_it_does_not_need(arm, monkeypatch):
    """A set that is full takes no further cause, though the right one may be missing."""
    needed, bases = StubFit(600.0, MEMBERS[-1:]), []
    monkeypatch.setattr(strategy, "without_idle_causes", lambda leader, fits, *_: (
        [needed] if len(leader.members) > 1 and needed not in fits else []))
    monkeypatch.setattr(strategy, "one_more_cause",
                        lambda contest, screen, base: bases.append(base) or [])
    arm(alone=900.0, of_joints=700.0, beside_payload=650.0)
    assert needed in bases


def test_a_fit_whose_loop_is_not_stable_is_not_extended():
    """Its sensitivity grows without bound, and so would what it sees in the error."""
    damped = SimpleNamespace(holds_joints=True, torque_sensitivity=lambda k, inertia, damping: (
        [1.0], [1.0, -damping]))
    assert holds_stably(damped, np.ones(2), np.array([0.5, 0.9]))
    assert not holds_stably(damped, np.ones(2), np.array([0.5, 1.2]))
    undamped = SimpleNamespace(method=METHOD, problem=SimpleNamespace(law=SimpleNamespace(
        holds_joints=True, torque_sensitivity=lambda k, inertia, damping: ([1.0], [1.0, -1.2]))))
    contest = Contest(undamped, StubFit(WHOLE, ()), CAUSES, SEARCH_STEPS)
    assert one_more_cause(contest, None, StubFit(90.0, MEMBERS[:1])) == []


def test_where_no_cause_can_act_nothing_is_fitted():
    steps = dataclasses.replace(SEARCH_STEPS, screen=lambda *_: None, singles=lambda *_: [],
                                wrong_numbers=lambda problem: [], drive_gains=lambda *_: [])
    residuals = SimpleNamespace(method=METHOD, problem=SimpleNamespace(n=1), is_out_of_time=False)
    assert search_causes(residuals, StubFit(WHOLE, ()), CAUSES, steps).fits == []
