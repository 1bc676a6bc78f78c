"""Gears whose errors the motors feel: the motion that they add to the links costs torque."""

import numpy as np
import pytest

from clie_blocks.analysis.blind.population import catalogue
from clie_blocks.analysis.blind.population.files import write_trial
from clie_blocks.analysis.blind.population.maker import Population, make_trial
from clie_blocks.analysis.blind.population.standard import draw_trial
from clie_blocks.analysis.export.replay import replay
from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.verdict.posterior import marginals
from clie_blocks.analysis.records import read_trial

pytestmark = pytest.mark.slow
pytest.importorskip("mujoco")

NO_LIMIT = 3600.0  # s: a busy machine does not change an answer


def diagnose_trial(folder, name, kind, index):
    """True numbers of a robot with an effect, and its diagnosis."""
    def draw(rng, seed, number):
        return draw_trial(rng, number, "single", (name,), "medium", robot_kind=kind,
                          vocabulary=catalogue.CATALOGUE)

    trial = make_trial(Population(draw, (7,)), 5151, index)
    write_trial(trial, folder)
    problem = Problem.from_logs(*read_trial(folder))
    return trial.label["effects"][0]["numbers"], diagnose(problem, seconds=NO_LIMIT)


@pytest.mark.parametrize("index", [0, 4])
def test_a_belt_over_the_joint_before_pulls_at_its_motor(tmp_path, index):
    true, diagnosis = diagnose_trial(tmp_path, "coupled_joints", "arm", index)
    assert marginals(diagnosis.ranking)["coupled_joints"] > 0.9
    found = diagnosis.model.hypothesis.values["coupled_joints_felt.ratio"]
    np.testing.assert_allclose(found, true["travel_of_neighbour"], atol=1e-4)
    assert diagnosis.reduction.percent > 85.0
    diagnosis.export("mujoco", tmp_path)
    for gap in replay(diagnosis.problem, tmp_path / "robot.corrected.xml").gaps:
        assert gap.corrected < 1.15 * gap.floor


@pytest.mark.parametrize("index", [0, 3])  # of 0 the order is missed along the nominal motion
def test_teeth_of_links_that_count_to_the_rotor_are_named(tmp_path, index):
    true, diagnosis = diagnose_trial(tmp_path, "kinematic_error", "axes", index)
    assert marginals(diagnosis.ranking)["kinematic_error"] > 0.8
    (member,), values = diagnosis.model.hypothesis.members, diagnosis.model.hypothesis.values
    sine, cosine, order = (values[f"{member.cause.block}.{key}"]
                           for key in ("sine", "cosine", "order"))
    np.testing.assert_allclose(np.hypot(sine, cosine), true["wobble"], atol=1e-4)
    k = np.argmax(true["wobble"])
    assert order[k] == true["wobble_order"][k]
