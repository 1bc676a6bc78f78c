"""Rivals of the leading hypothesis: fewer causes, look-alikes, other forms of one effect."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from clie_blocks.analysis.gap.causes import CAUSES, drive, friction
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.initial_guess import initial_guess
from clie_blocks.analysis.gap.fitting.jacobian import jacobian
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.problem.problem import problem
from clie_blocks.analysis.gap.search.alternatives import alternatives


@pytest.fixture(scope="module")
def rubbing(case):
    """Bench and refitted nominal model of a robot with dry friction."""
    made = case("coulomb")
    return fit_nominal(problem(made.robot, made.records), METHOD)


def member(cause, n, **values):
    values = {name: np.full(n, value) for name, value in values.items()}
    return Member(cause, tuple(range(n)), values, values)


def leading(base, *members, left=10.0, links=False):
    """Fit of some causes that leaves so many times the noise."""
    asked = dataclasses.replace(base.hypothesis.problem, chain=SimpleNamespace(known=links))
    at = dataclasses.replace(build_hypothesis(base.hypothesis.problem, members, base.hypothesis),
                             problem=asked)
    return dataclasses.replace(base, hypothesis=at, chi2=left * base.samples)


def keys(candidates):
    return [{one.cause.key for one in candidate.members} for candidate in candidates]


def test_a_second_cause_must_be_needed_beside_every_look_alike_of_the_first(rubbing):
    bench, base = rubbing
    n = base.hypothesis.problem.n
    pair = (member(friction.COULOMB, n, level=0.1),
            member(drive.TORQUE_GAIN_ERROR, n, error=0.1))
    far, near = leading(base, *pair), leading(base, *pair, left=1.0)
    assert far.excess > 1.0 > 0.3 > near.excess
    wide = keys(alternatives(far, [far], CAUSES, bench))
    for alone in ({"coulomb"}, {"torque_gain_error"}, {"stribeck"}):
        assert alone in wide
    narrow = keys(alternatives(near, [near], CAUSES, bench))
    assert {"stribeck"} not in narrow and {"coulomb"} in narrow
    assert {"stribeck", "torque_gain_error"} in narrow


def test_both_forms_of_load_dependent_friction_are_rivals_where_links_are_stated(rubbing):
    bench, base = rubbing
    n = base.hypothesis.problem.n
    plain, grows = "load_dependent_friction", "load_dependent_friction:links"
    dry = member(friction.COULOMB, n, level=0.1)
    known, stated = leading(base, dry), leading(base, dry, links=True)
    assert {plain} in keys(alternatives(known, [known], CAUSES, bench))
    assert {grows} not in keys(alternatives(known, [known], CAUSES, bench))
    assert {grows} in keys(alternatives(stated, [stated], CAUSES, bench))
    loaded = leading(base, member(friction.LOAD_DEPENDENT_FRICTION[1], n, level=0.1, slope=0.2),
                     links=True)
    (swapped,) = [one for one in alternatives(loaded, [loaded], CAUSES, bench)
                  if keys([one]) == [{plain}]]
    assert np.all(swapped.members[0].values["slope"] == 0.2)


def test_what_was_tried_for_a_former_leader_is_not_tried_again(rubbing):
    bench, base = rubbing
    found = leading(base, member(friction.COULOMB, base.hypothesis.problem.n, level=0.1))
    first = alternatives(found, [found], CAUSES, bench)
    assert first and alternatives(found, [found], CAUSES, bench, first) == []


def test_a_sibling_starts_beside_the_joint_model_of_the_leader(rubbing):
    bench, base = rubbing
    at, n = base.hypothesis, base.hypothesis.problem.n
    other = {**at.values, "inertia": 1.1 * at.values["inertia"]}
    dry = member(friction.COULOMB, n, level=0.1)
    found = dataclasses.replace(base, hypothesis=build_hypothesis(at.problem, (dry,),
                                                            at.with_values(other)))
    swapped = next(one for one in alternatives(found, [found], CAUSES, bench)
                   if keys([one]) == [{"stribeck"}])
    generous = dataclasses.replace(base, chi2=1e9 * base.samples)
    start = initial_guess(swapped, bench, generous)
    assert np.array_equal(start.values["inertia"], other["inertia"])


def test_a_fit_that_ended_in_a_false_minimum_starts_again_beside_the_leader(rubbing):
    """Uneven friction is plain friction with an offset: as good as the leader, with one less."""
    bench, base = rubbing
    at, n = base.hypothesis, base.hypothesis.problem.n
    plain = fit(build_hypothesis(at.problem, (member(friction.COULOMB, n, level=0.02),), at), bench)
    level, tilt = plain.hypothesis.values["coulomb.level"], 0.2
    uneven = Member(friction.ASYMMETRIC_COULOMB, tuple(range(n)),
                    {"forward": (1 + tilt) * level, "backward": (1 - tilt) * level},
                    {"forward": level, "backward": level})
    values = plain.hypothesis.values
    leader = dataclasses.replace(plain, hypothesis=build_hypothesis(
        at.problem, (uneven,), at.with_values({**values, "load": values["load"] - tilt * level})))
    stuck = dataclasses.replace(plain, chi2=2.0 * plain.chi2)
    (again,) = [one for one in alternatives(leader, [leader, stuck], CAUSES, bench)
                if keys([one]) == [{"coulomb"}]]
    start = build_hypothesis(at.problem, again.members, again.extends.hypothesis)
    assert jacobian(start, bench).cost == pytest.approx(plain.cost, rel=1e-6)
    assert {"coulomb"} not in keys(alternatives(leader, [leader, plain], CAUSES, bench))
