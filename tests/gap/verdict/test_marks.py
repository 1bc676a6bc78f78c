"""Marks: what a fault, a limit, a weight and a drift must show to be called so."""

import dataclasses

import numpy as np
import pytest
from factories import make_fit, make_member, make_problem, make_residual_model, moved

from clie_blocks.analysis.gap.causes import drive, friction, load, timed
from clie_blocks.analysis.gap.verdict.marks import causes_without_marks

PERIOD = 0.01  # s
TIME = PERIOD * np.arange(2000)
SWAY = [np.stack([np.sin(TIME + j), np.cos(2.3 * TIME + j)], axis=1) for j in range(3)]
NOISE = 1e-4  # rad
NEVER = 1e9
FAULT = timed.STEP_FAULT[0]


def marked(problem, *members, fit=None):
    found = make_fit(problem, *members) if fit is None else fit
    return not causes_without_marks(found, make_residual_model(found.hypothesis.problem, NOISE))


def ran(problem, *members):
    """Problem whose logs a hypothesis has made, with sensor noise."""
    rng = np.random.default_rng(1)
    hypothesis = make_fit(problem, *members).hypothesis
    logs = []
    for j, log in enumerate(problem.logs):
        q, u = hypothesis.simulator.run(log, hypothesis.of_log(j))
        logs.append(dataclasses.replace(log, q=q + NOISE * rng.standard_normal(q.shape), u=u))
    return problem.with_log_list(logs)


def fault(problem, *moments, torque=0.3, joints=None):
    onset = np.array(moments)[:, None] * np.ones(problem.n)
    return make_member(FAULT, problem, joints, onset=onset, torque=torque)


@pytest.fixture(scope="module")
def faulted():
    """Problem of a robot in which a fault sets in after 8 s, and the fault."""
    problem = make_problem(SWAY, period=PERIOD)
    member = fault(problem, 8.0, 8.0, 8.0)
    return ran(problem, member), member


def test_a_fault_before_which_the_model_is_right_is_a_fault(faulted):
    problem, member = faulted
    assert marked(problem, member)


def test_a_fault_that_takes_a_part_of_what_was_always_there_is_none(faulted):
    problem, _ = faulted
    rubbed = ran(problem, make_member(friction.COULOMB, problem, level=0.3))
    assert not marked(rubbed, fault(problem, 8.0, 8.0, 8.0, torque=0.02))


def test_a_log_without_the_fault_must_be_right_throughout(faulted):
    problem, _ = faulted
    part = ran(problem, fault(problem, 8.0, 8.0, NEVER))
    assert marked(part, fault(problem, 8.0, 8.0, NEVER))
    assert not marked(ran(problem, fault(problem, 8.0, 8.0, 0.0)),
                      fault(problem, 8.0, 8.0, NEVER))


@pytest.mark.parametrize("moment", [1.0, 19.0])
def test_the_start_and_the_end_of_a_log_are_no_onsets(faulted, moment):
    problem, _ = faulted
    member = fault(problem, moment, moment, moment)
    assert not marked(ran(problem, member), member)


def test_one_fault_sets_in_at_all_joints_together(faulted):
    problem, _ = faulted
    apart = make_member(FAULT, problem, onset=np.array([[8.0, 12.0]] * 3), torque=0.3)
    assert not marked(ran(problem, apart), apart)
    alone = make_member(FAULT, problem, joints=[0], onset=np.array([[8.0, NEVER]] * 3), torque=0.3)
    assert marked(ran(problem, alone), alone)


def test_a_limit_must_be_met_before_it_acts():
    growing = [course * np.linspace(0.0, 1.0, len(TIME))[:, None] for course in SWAY]
    problem = make_problem(growing, period=PERIOD)

    def limit_below_peak(logged):
        peak = np.min([np.abs(log.u).max(axis=0) for log in logged.logs], axis=0)
        return make_member(drive.ACTUATOR_SATURATION, problem, limit=0.7 * peak)

    limited = limit_below_peak(ran(problem))
    assert marked(ran(problem, limited), limited)
    rubbed = ran(problem, make_member(friction.COULOMB, problem, level=0.3))
    assert not marked(rubbed, limit_below_peak(rubbed))


@pytest.mark.parametrize("along, across, has_gravity, is_weight", [
    (1.0, 0.0, False, True), (0.1, -0.2, False, True), (0.0, -1.0, False, True),
    (1.5, 0.0, False, False), (0.4, 0.0, True, False), (-0.1, 0.3, True, True)])
def test_a_tilted_base_brings_no_more_than_the_whole_weight(along, across, has_gravity, is_weight):
    problem = make_problem(SWAY, period=PERIOD, known_links=True)
    problem = dataclasses.replace(problem, links=dataclasses.replace(
        problem.links, has_gravity=has_gravity))
    weight = make_member(load.GRAVITY, problem, along=along, across=across)
    assert marked(problem, weight) is is_weight


def test_the_weight_of_several_joints_needs_their_links():
    two = make_problem(SWAY, period=PERIOD)
    one = make_problem([course[:, :1] for course in SWAY], period=PERIOD)
    assert marked(one, make_member(load.GRAVITY, one, along=9.0))
    assert not marked(two, make_member(load.GRAVITY, two, along=9.0))


@pytest.mark.parametrize("cause", friction.FRICTION_DRIFT)
def test_friction_that_drifts_does_so_after_the_start(cause):
    problem = make_problem(SWAY, period=PERIOD)
    drifting = make_fit(problem, make_member(cause, problem, time_constant=8.0, since=0.0))
    assert marked(problem, fit=drifting)
    key = f"{cause.block}__time_constant"
    assert not marked(problem, fit=moved(drifting, **{key: np.array([1.0, 1.0])}))


@pytest.mark.parametrize("lower, upper, is_mark", [(-10.0, 0.6, True), (-0.6, 0.6, True),
                                                   (-0.1, 0.1, False), (0.2, 0.1, False)])
def test_stops_stand_at_the_ends_of_the_travel(lower, upper, is_mark):
    problem = make_problem(SWAY, period=PERIOD)
    stops = make_member(load.SOFT_STOP, problem, stiffness=2.0, lower=lower, upper=upper,
                        damping=0.0)
    assert marked(problem, stops) is is_mark


def test_a_stop_that_hardly_pushes_may_stand_anywhere():
    problem = make_problem(SWAY, period=PERIOD)
    stops = make_member(load.SOFT_STOP, problem, stiffness=np.array([2.0, 1e-3]),
                        lower=np.array([-10.0, 0.0]), upper=np.array([0.6, 0.0]), damping=0.0)
    assert marked(problem, stops)


STEPS = [np.repeat(np.random.default_rng(j).uniform(-0.6, 0.6, 10), 200)[:, None]
         for j in range(3)]  # a joint that mostly rests


@pytest.mark.parametrize("per_turn, gear, known", [
    (2.0, 50.0, True), (1.0, 50.0, True),
    (2.02, 50.0, False),  # waves of something else
    (0.4, 50.0, False),  # less than one per turn
    (2.0, 1.0, False),  # a ratio that says nothing of the motor
    (2.0, 12.0, False)])  # too few turns to tell
def test_waves_at_rest_are_a_ripple_if_they_turn_with_the_motor(per_turn, gear, known):
    problem = make_problem(STEPS, period=PERIOD, gear_ratio=gear)
    ripple = make_member(drive.TORQUE_RIPPLE, problem, order=per_turn * gear, sine=0.3,
                         cosine=0.1)
    assert marked(ran(problem, ripple), ripple) is known


@pytest.mark.parametrize("waves_in_motion", [True, False])
def test_a_log_in_motion_decides_what_short_waves_at_rest_are(waves_in_motion):
    sway = 0.5 * np.sin(TIME)[:, None]
    problem = make_problem([*STEPS, sway], period=PERIOD, gear_ratio=50.0)
    ripple = make_member(drive.TORQUE_RIPPLE, problem, order=101.0, sine=0.3, cosine=0.1)
    logs = [log if waves_in_motion or j < len(STEPS) else plain for j, (log, plain) in enumerate(
        zip(ran(problem, ripple).logs, ran(problem).logs))]
    assert marked(problem.with_log_list(logs), ripple) is waves_in_motion


def test_held_packets_leave_nothing_but_what_other_causes_explain():
    problem = make_problem(SWAY, period=PERIOD)
    holds = make_member(drive.PACKET_HOLD, problem, hold=0.3, interval=2.5, phase=0.2)
    rubbing = make_member(friction.COULOMB, problem, level=0.3)
    assert marked(ran(problem, holds), holds)
    both = ran(problem, holds, rubbing)
    assert not marked(both, holds)
    assert marked(both, holds, rubbing)
