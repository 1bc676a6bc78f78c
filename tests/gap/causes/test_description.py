"""Numbers of the robot file as hypotheses: each moves the model as the mended file would."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.causes import description
from clie_blocks.analysis.gap.causes.description import (
    CHANGE,
    is_of_coupling,
    numbers_of_coupling,
    ratios_of_inertia,
    stated_numbers,
)
from clie_blocks.analysis.gap.causes.load import COUPLING
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records import Record
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.robot_sections import Links, Motor, Nominal

TIME = 1e-3 * np.arange(1500)
Q = np.stack([0.4 * np.sin(3 * TIME), 0.3 * np.sin(5 * TIME)], axis=1)
LENGTH, MASS, COM, INERTIA = [0.5, 0.3], [1.2, 0.6], [0.3, 0.1], [0.02, 0.004]


def arm(links=True, gravity=True, coupling=True, ratio=(30.0, 50.0), **changed):
    """Arm of two links; `changed` holds numbers by the names of their fields."""
    values = {"gear_ratio": list(ratio), "length": LENGTH, "mass": MASS, "com": COM,
              "inertia": INERTIA, **changed}
    motor = Motor(gear_ratio=values.pop("gear_ratio"), inertia=[1e-3, 2e-4],
                  viscous_friction=[0.01, 0.002])
    return Robot(n=2, motor=motor,
                 links=Links(**values, joint_viscous_friction=[0.2, 0.1]) if links else Links(),
                 nominal=Nominal(gravity=gravity, coupling=coupling),
                 controller=Controller(kp=[20.0, 5.0], kd=[1.5, 0.3],
                                       velocity_filter="difference", sample_time=1e-3))


def problem_of(robot):
    logs = [Record(time=TIME, q=Q, u=np.sin(7 * TIME)[:, None] * [1.0, 0.5], qd=Q, pe=0.0 * Q,
                   source="log-1")]
    return Problem.from_logs(robot, logs, trust_logs=True)


def motion(problem, *members):
    hypothesis = build_hypothesis(problem, members)
    return hypothesis.simulator.run(problem.logs[0], hypothesis.of_log(0))[0]


def member(problem, key, change):
    cause = next(cause for cause, _ in stated_numbers(problem) if cause.variant == key)
    return Member(cause, (0, 1), {CHANGE: np.array(change)}, {CHANGE: np.full(2, 0.1)})


@pytest.mark.slow
@pytest.mark.parametrize("key, change, mended", [
    (description.GEAR_RATIO, [0.2, -0.1], {"gear_ratio": [36.0, 45.0]}),
    (description.MASS, [0.25, -0.2], {"mass": [1.5, 0.48]}),
    (description.COM, [-0.2, 0.5], {"com": [0.2, 0.25]}),
    (description.LENGTH, [0.2, 0.0], {"length": [0.6, 0.3]}),
    (description.INERTIA, [0.5, 1.0], {"inertia": [0.03, 0.008]})])
def test_a_number_moves_the_model_as_the_mended_file_does(key, change, mended):
    stated, right = problem_of(arm()), problem_of(arm(**mended))
    assert np.abs(motion(stated) - motion(right)).max() > 1e-5
    np.testing.assert_allclose(motion(stated, member(stated, key, change)), motion(right),
                               atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("key, change, mended", [
    (description.MASS, [0.25, -0.2], {"mass": [1.5, 0.48]}),
    (description.COM, [-0.2, 0.5], {"com": [0.2, 0.25]}),
    (description.LENGTH, [0.2, 0.0], {"length": [0.6, 0.3]})])
def test_beside_its_coupling_an_arm_moves_as_the_mended_file_with_coupling(key, change, mended):
    stated = problem_of(arm(gravity=False, coupling=False))
    right = problem_of(arm(gravity=False, **mended))
    cause = next(one for one, _ in numbers_of_coupling(stated) if one.variant == key)
    assert is_of_coupling(cause)
    number = Member(cause, (0, 1), {CHANGE: np.array(change)}, {CHANGE: np.full(2, 0.1)})
    one = {"share": np.ones(2)}
    coupled = motion(stated, Member(COUPLING, (0, 1), one, one), number)
    assert np.abs(motion(stated) - motion(right)).max() > 1e-5
    np.testing.assert_allclose(coupled, motion(right), atol=1e-9)


@pytest.mark.parametrize("links", [True, False])
@pytest.mark.parametrize("change", [-0.3, 0.25, 0.4])
def test_the_gear_ratios_of_an_inertia_give_it_and_the_nearer_is_first(links, change):
    problem = problem_of(arm(links=links))
    of_links = problem.links.diagonal / problem.gear_ratio
    rotor = problem.nominal.inertia - of_links

    def met(change):
        return rotor * (1.0 + change) + of_links / (1.0 + change)

    near, far = ratios_of_inertia(problem, met(np.full(2, change)))
    assert np.all(np.abs(near) <= np.abs(far))
    assert all(min(abs(one - change) for one in pair) < 1e-6 for pair in zip(near, far))
    within = (far > -0.9) & (far < 10.0)  # bounds of a change
    assert within.any() == links
    np.testing.assert_allclose(met(near), met(change), rtol=1e-9)
    np.testing.assert_allclose(met(far)[within], met(np.full(2, change))[within], rtol=1e-9)


def test_numbers_that_the_model_does_not_use_are_not_questioned():
    def keys(robot):
        return {cause.variant for cause, _ in stated_numbers(problem_of(robot))}

    of_links = {description.MASS, description.COM, description.LENGTH, description.INERTIA,
                description.ZERO}
    assert keys(arm()) == of_links | {description.GEAR_RATIO}
    assert keys(arm(gravity=False, coupling=False)) == {description.GEAR_RATIO}
    assert keys(arm(links=False)) == {description.GEAR_RATIO}
    assert keys(arm(ratio=(1.0, 1.0))) == of_links
    assert keys(arm(links=False, ratio=(1.0, 1.0))) == set()


def test_a_joint_without_a_gear_has_no_ratio_to_be_wrong():
    (cause, joints), = stated_numbers(problem_of(arm(links=False, ratio=(1.0, 50.0))))
    assert cause.variant == description.GEAR_RATIO and joints == (1,)


@pytest.mark.parametrize("key, change, stated, identified, unit", [
    (description.GEAR_RATIO, 0.1, 50.0, 55.0, "1"), (description.MASS, 0.5, 0.6, 0.9, "kg"),
    (description.COM, 0.5, 0.1, 0.25, "m"), (description.ZERO, 0.2, 0.0, 0.2, "rad")])
def test_what_is_identified_is_said_in_the_terms_of_the_file(key, change, stated, identified,
                                                             unit):
    found = description.stated_and_identified(key, change, problem_of(arm()), 1)
    assert found == (pytest.approx(stated), pytest.approx(identified), unit)


def test_the_links_of_a_simulator_have_the_identified_numbers():
    problem = problem_of(arm())
    hypothesis = build_hypothesis(problem, [member(problem, description.MASS, [0.25, 0.0])])
    links = description.corrected_links(problem.links, hypothesis.values)
    assert links.mass == pytest.approx([1.5, 0.6])
    unchanged = dataclasses.replace(links, mass=problem.links.mass)
    assert unchanged.com == pytest.approx(problem.links.com)
    assert unchanged.length == pytest.approx(problem.links.length)
