"""Alternatives of the leading hypothesis: fewer causes, similar ones, other forms of an effect."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from clie_blocks.analysis.gap.causes import CAUSES, drive, friction, load
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.initial_guess import initial_guess
from clie_blocks.analysis.gap.fitting.jacobian import jacobian
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.search.alternatives import alternatives


@pytest.fixture(scope="module")
def rubbing(case):
    """Residual model and refitted nominal model of a robot with dry friction."""
    made = case("coulomb")
    return fit_nominal(Problem.from_logs(made.robot, made.records), METHOD)


def member(cause, n, **values):
    values = {name: np.full(n, value) for name, value in values.items()}
    return Member(cause, tuple(range(n)), values, values)


def leading(nominal, *members, left=10.0, links=False):
    """Fit of some causes that leaves so many times the noise."""
    start = build_hypothesis(nominal.hypothesis.problem, members, nominal.hypothesis)
    problem = dataclasses.replace(start.problem, links=SimpleNamespace(known=links))
    at = dataclasses.replace(start, problem=problem)
    return dataclasses.replace(nominal, hypothesis=at, chi2=left * nominal.samples)


def keys(candidates):
    return [{one.cause.key for one in candidate.members} for candidate in candidates]


def test_a_second_cause_must_be_needed_with_every_alternative_of_the_first(rubbing):
    residuals, nominal = rubbing
    n = nominal.hypothesis.problem.n
    pair = (member(friction.COULOMB, n, level=0.1),
            member(drive.TORQUE_GAIN_ERROR, n, error=0.1))
    far, near = leading(nominal, *pair), leading(nominal, *pair, left=1.0)
    assert far.excess > 1.0 > 0.3 > near.excess
    wide = keys(alternatives(far, [far], CAUSES, residuals))
    for alone in ({"coulomb"}, {"torque_gain_error"}, {"stribeck"}):
        assert alone in wide
    narrow = keys(alternatives(near, [near], CAUSES, residuals))
    assert {"stribeck"} not in narrow and {"coulomb"} in narrow
    assert {"stribeck", "torque_gain_error"} in narrow


def test_both_forms_of_load_dependent_friction_are_alternatives_where_links_are_stated(rubbing):
    residuals, nominal = rubbing
    n = nominal.hypothesis.problem.n
    plain, grows = "load_dependent_friction", "load_dependent_friction:links"
    dry = member(friction.COULOMB, n, level=0.1)
    known, stated = leading(nominal, dry), leading(nominal, dry, links=True)
    assert {plain} in keys(alternatives(known, [known], CAUSES, residuals))
    assert {grows} not in keys(alternatives(known, [known], CAUSES, residuals))
    assert {grows} in keys(alternatives(stated, [stated], CAUSES, residuals))
    loaded = leading(nominal, member(friction.LOAD_DEPENDENT_FRICTION[1], n, level=0.1, share=0.2),
                     links=True)
    (swapped,) = [one for one in alternatives(loaded, [loaded], CAUSES, residuals)
                  if keys([one]) == [{plain}]]
    assert np.all(swapped.members[0].values["share"] == 0.2)


def test_a_dry_friction_that_drifts_is_tried_as_an_even_one_beside_a_drag_that_drifts(rubbing):
    """Beside the one, another cause may have stood for the drag."""
    residuals, nominal = rubbing
    n, logs = nominal.hypothesis.problem.n, len(residuals.problem.logs)
    dry = member(friction.FRICTION_DRIFT[1], n, level=0.1, coulomb_change=0.04, time_constant=8.0)
    since = np.zeros((logs, n))
    dry = dataclasses.replace(dry, values={**dry.values, "since": since})
    error = member(drive.TORQUE_GAIN_ERROR, n, error=0.1)
    leader = leading(nominal, dry, error)
    apart = {"coulomb", "friction_drift:viscous"}
    candidates = alternatives(leader, [leader], CAUSES, residuals)
    assert {*apart, "torque_gain_error"} in keys(candidates) and apart in keys(candidates)
    (even, drag), = [one.members for one in candidates if keys([one]) == [apart]]
    assert even.values["level"] == pytest.approx(0.12)
    assert np.all(drag.values["viscous_change"] > 0) and np.all(
        drag.values["time_constant"] == 8.0)
    without = [cause for cause in CAUSES if cause is not friction.COULOMB]
    assert apart not in keys(alternatives(leader, [leader], without, residuals))


def test_stops_that_may_leave_no_play_are_tried_as_a_spring(rubbing):
    residuals, nominal = rubbing
    stops = leading(nominal, member(load.SOFT_STOP, nominal.hypothesis.problem.n, stiffness=2.0,
                                    lower=0.1, upper=0.0, damping=0.0))
    (spring,) = [one for one in alternatives(stops, [stops], CAUSES, residuals)
                 if keys([one]) == [{"spring"}]]
    assert np.all(spring.members[0].values["stiffness"] == 2.0)


def swapped(leader, residuals, name):
    """The only member of the alternative of a name."""
    (one,) = [one for one in alternatives(leader, [leader], CAUSES, residuals)
              if keys([one]) == [{name}]]
    return one.members[0]


def test_ripples_of_the_same_height_are_tried_for_each_other(rubbing):
    residuals, nominal = rubbing
    problem = nominal.hypothesis.problem
    torque = np.sqrt(np.mean([np.mean(log.u**2, axis=0) for log in problem.fit], axis=0))
    ripple = member(drive.TORQUE_RIPPLE, problem.n, sine=0.3, cosine=0.4, order=24.0)
    leader = leading(nominal, ripple)
    mesh = swapped(leader, residuals, "gear_mesh_ripple")
    height = np.hypot(mesh.values["sine"], mesh.values["cosine"]) * (
        torque + mesh.values["preload"])
    assert height == pytest.approx(0.5) and np.all(mesh.values["order"] == 24.0)
    share = swapped(leader, residuals, "commutation_ripple").values["sine"]
    assert share * torque == pytest.approx(0.3)
    back = swapped(leading(nominal, mesh), residuals, "torque_ripple").values
    assert back["sine"] == pytest.approx(0.3) and back["cosine"] == pytest.approx(0.4)


def test_a_second_clock_is_tried_as_its_mean_delay(rubbing):
    residuals, nominal = rubbing
    problem = nominal.hypothesis.problem
    clock = member(drive.TICK_JITTER, problem.n, spread=4e-3, beat=3.0)
    clock.values["phase"] = np.zeros((problem.fit_runs, problem.n))
    delay = swapped(leading(nominal, clock), residuals, "time_delay")
    assert np.all(delay.values["delay"] == 2e-3)


def test_held_packets_are_tried_as_their_mean_delay(rubbing):
    """Held for 6 ms of every 15: a command is 3 ms old then, on average, and 1.2 ms of all."""
    residuals, nominal = rubbing
    problem = nominal.hypothesis.problem
    held = member(drive.PACKET_HOLD, problem.n, hold=6e-3, interval=15e-3)
    held.values["phase"] = np.zeros((problem.fit_runs, problem.n))
    delay = swapped(leading(nominal, held), residuals, "time_delay")
    assert delay.values["delay"] == pytest.approx(1.2e-3)


def test_contacts_of_the_same_stiffness_are_tried_for_each_other(rubbing):
    residuals, nominal = rubbing
    n = nominal.hypothesis.problem.n
    dahl = leading(nominal, member(friction.DAHL, n, level=0.1, reach=0.004,
                                   exponent=1.5))
    slip = swapped(dahl, residuals, "maxwell_slip")
    assert np.all(slip.values["level"] == 0.1) and slip.values["reach"] == pytest.approx(0.008)
    bristles = swapped(leading(nominal, slip), residuals, "presliding").values
    assert bristles["reach"] == pytest.approx(0.004) and np.all(bristles["bristle_damping"] > 0)


@pytest.mark.parametrize("name", [
    "asymmetric_coulomb", "stribeck", "presliding", "dahl", "maxwell_slip",
    "position_dependent_friction", "friction_drift"])
def test_plain_friction_is_fitted_beside_every_friction_that_contains_it(rubbing, name):
    residuals, nominal = rubbing
    cause = next(one for one in CAUSES if one.name == name and one.variant != "viscous")
    dry = member(cause, nominal.hypothesis.problem.n, **{
        number.name: 0.1 for number in cause.numbers if number.scope != "log"})
    if name == "friction_drift":
        since = np.zeros((len(residuals.problem.logs), residuals.problem.n))
        dry = dataclasses.replace(dry, values={**dry.values, "since": since},
                                  sizes={**dry.sizes, "since": since})
    leader = leading(nominal, dry, left=1.0)
    assert {"coulomb"} in keys(alternatives(leader, [leader], CAUSES, residuals))


def test_what_was_tried_for_a_former_leader_is_not_tried_again(rubbing):
    residuals, nominal = rubbing
    leader = leading(nominal, member(friction.COULOMB, nominal.hypothesis.problem.n, level=0.1))
    first = alternatives(leader, [leader], CAUSES, residuals)
    assert first and alternatives(leader, [leader], CAUSES, residuals, first) == []


def test_an_alternative_starts_with_the_joint_model_of_the_leader(rubbing):
    residuals, nominal = rubbing
    at, n = nominal.hypothesis, nominal.hypothesis.problem.n
    other = {**at.values, "inertia": 1.1 * at.values["inertia"]}
    dry = member(friction.COULOMB, n, level=0.1)
    leader = dataclasses.replace(nominal, hypothesis=build_hypothesis(
        at.problem, (dry,), at.with_values(other)))
    swapped = next(one for one in alternatives(leader, [leader], CAUSES, residuals)
                   if keys([one]) == [{"stribeck"}])
    generous = dataclasses.replace(nominal, chi2=1e9 * nominal.samples)
    start = initial_guess(swapped, residuals, generous)
    assert np.array_equal(start.values["inertia"], other["inertia"])


def test_a_fit_that_ended_in_a_false_minimum_starts_again_from_the_leader(rubbing):
    """Uneven friction is plain friction with an offset: as good as the leader, with one less."""
    residuals, nominal = rubbing
    at, n = nominal.hypothesis, nominal.hypothesis.problem.n
    dry = member(friction.COULOMB, n, level=0.02)
    plain = fit(build_hypothesis(at.problem, (dry,), at), residuals)
    level, tilt = plain.hypothesis.values["coulomb.level"], 0.2
    uneven = Member(friction.ASYMMETRIC_COULOMB, tuple(range(n)),
                    {"forward": (1 + tilt) * level, "backward": (1 - tilt) * level},
                    {"forward": level, "backward": level})
    values = plain.hypothesis.values
    leader = dataclasses.replace(plain, hypothesis=build_hypothesis(
        at.problem, (uneven,), at.with_values({**values, "load": values["load"] - tilt * level})))
    stuck = dataclasses.replace(plain, chi2=2.0 * plain.chi2)
    (again,) = [one for one in alternatives(leader, [leader, stuck], CAUSES, residuals)
                if keys([one]) == [{"coulomb"}]]
    start = build_hypothesis(at.problem, again.members, again.extends.hypothesis)
    assert jacobian(start, residuals).cost == pytest.approx(plain.cost, rel=1e-6)
    assert {"coulomb"} not in keys(alternatives(leader, [leader, plain], CAUSES, residuals))
