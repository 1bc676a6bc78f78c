"""A wrong gear ratio of the robot file is fitted to its true value from far away."""

import dataclasses

import numpy as np
import pytest

pytest.importorskip("mujoco")

from clie_blocks.analysis.blind.engine.robot import draw_robot
from clie_blocks.analysis.blind.population.files import write_trial
from clie_blocks.analysis.blind.population.maker import RejectedError
from clie_blocks.analysis.blind.population.standard import draw_trial
from clie_blocks.analysis.gap.causes.description import GEAR_RATIO
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.fitting.observer import with_observer
from clie_blocks.analysis.gap.method import METHOD
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.search.file_numbers import fit_numbers, wrong_numbers
from clie_blocks.analysis.records import read_trial

pytestmark = pytest.mark.slow

TRUE_OVER_STATED = 0.6, 0.75, 0.9, 1.1, 1.25, 1.4
ROBOTS = {"pendulum": ("pendulum", 1, True, 1), "arm": ("arm", 2, True, 1),
          "arm in a plane": ("arm", 2, False, 1), "pendulum in a plane": ("pendulum", 1, False, 1),
          "axes without links": ("axes", 2, False, 1)}


def sound_trial(kind, n, gravity, seed):
    """Sound robot of a kind, logged by the engine of the blind trials."""
    for index in range(400):
        robot = draw_robot(np.random.default_rng([seed, index]), kind)
        if robot.n != n or robot.gravity != gravity:
            continue
        try:
            return draw_trial(np.random.default_rng([seed, index]), index, "none", (), None, kind)
        except RejectedError:
            continue
    raise AssertionError("no robot was drawn")


@pytest.fixture(scope="module")
def records_of(tmp_path_factory):
    """Function from a robot's name to its logs."""
    known = {}

    def records(name):
        if name not in known:
            folder = tmp_path_factory.mktemp("trial")
            write_trial(sound_trial(*ROBOTS[name]), folder)
            known[name] = read_trial(folder)[1]
        return known[name]
    return records


def misstated(records, joint, true_over_stated):
    """Problem whose robot file states the gear ratio of a joint wrong."""
    robot = records[0].robot
    ratio = np.array(robot.motor.gear_ratio, float)
    ratio[joint] /= true_over_stated
    stated = dataclasses.replace(robot, motor=dataclasses.replace(robot.motor, gear_ratio=ratio))
    return Problem.from_logs(stated, [record.replace(robot=stated) for record in records])


@pytest.mark.parametrize("true_over_stated", TRUE_OVER_STATED)
@pytest.mark.parametrize("name, joint", [
    *((name, 0) for name in ROBOTS), ("arm", 1), ("arm in a plane", 1), ("axes without links", 1)])
def test_the_fit_of_a_gear_ratio_reaches_the_truth(records_of, name, joint, true_over_stated):
    problem = with_observer(misstated(records_of(name), joint, true_over_stated), METHOD)
    residuals, nominal = fit_nominal(problem, METHOD)
    member, = (one for one in wrong_numbers(problem) if one.cause.variant == GEAR_RATIO)
    found = fit_numbers([member], residuals, nominal)
    change = found.hypothesis.values[f"{member.name}.change"][joint]
    assert 1.0 + change == pytest.approx(true_over_stated, rel=0.02)
    assert found.excess < 0.6  # the noise is judged by a nominal model that is far off
