"""Robots that log the encoders of motor and link, under a law that acts on either of them."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.blind.population import catalogue
from clie_blocks.analysis.blind.population.files import write_trial
from clie_blocks.analysis.blind.population.maker import Population, make_trial
from clie_blocks.analysis.blind.population.standard import draw_trial
from clie_blocks.analysis.blind.population.vocabulary import Vocabulary
from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.verdict.posterior import marginals
from clie_blocks.analysis.records import read_trial

pytestmark = pytest.mark.slow
pytest.importorskip("mujoco")

NO_LIMIT = 3600.0  # s: a busy machine does not change an answer
SOUND = "none"


@dataclasses.dataclass(frozen=True, eq=False)
class BothEncoders(Vocabulary):
    """The catalogue, in robots that log both encoders."""

    on_motor: bool = False

    def mount_encoder(self, rng, robot, names):
        rng.random()
        return dataclasses.replace(robot, encoder_on_motor=self.on_motor, two_encoders=True)


def trial_folder(folder, mounting, name, index):
    """Trial of a pendulum with an effect, as a user has it."""
    fields = {field.name: getattr(catalogue.CATALOGUE, field.name)
              for field in dataclasses.fields(catalogue.CATALOGUE)}
    names = BothEncoders(**fields, on_motor=mounting == "motor side")

    def draw(rng, seed, number):
        kind, effects, size = (SOUND, (), None) if name == SOUND else ("single", (name,), "medium")
        return draw_trial(rng, number, kind, effects, size, vocabulary=names,
                          robot_kind="pendulum")

    write_trial(make_trial(Population(draw, (7,)), 777, index), folder)
    return folder


@pytest.mark.parametrize("mounting, name, index", [
    ("joint side", "joint_elasticity", 0), ("motor side", "joint_elasticity", 0),
    ("joint side", "backlash", 2), ("motor side", "backlash", 2),
    ("joint side", "torsional_hysteresis", 3), ("motor side", "torsional_hysteresis", 3),
    ("joint side", "kinematic_error", 30)])
def test_what_lies_between_the_encoders_is_named(tmp_path, mounting, name, index):
    robot, records = read_trial(trial_folder(tmp_path, mounting, name, index))
    assert robot.encoder.mounting == mounting and "q_motor" in records[0].signals
    diagnosis = diagnose(Problem.from_logs(robot, records), seconds=NO_LIMIT)
    assert diagnosis.verdict == "effect"
    alike = next((names for names in diagnosis.alike if name in names), (name,))
    assert sum(marginals(diagnosis.ranking).get(one, 0.0) for one in alike) > 0.8


@pytest.mark.parametrize("mounting", ["joint side", "motor side"])
def test_a_sound_robot_leaves_the_noise_of_both_encoders(tmp_path, mounting):
    problem = Problem.from_logs(*read_trial(trial_folder(tmp_path, mounting, SOUND, 1)))
    diagnosis = diagnose(problem, seconds=NO_LIMIT)
    assert diagnosis.verdict == "none"
    nominal = diagnosis.nominal
    assert nominal.hypothesis.problem.two_encoders
    np.testing.assert_allclose(nominal.chi2 / nominal.samples, 1.0, atol=0.25)


def test_a_report_of_two_encoders_draws_what_the_law_saw(tmp_path):
    folder = trial_folder(tmp_path, "motor side", "joint_elasticity", 0)
    diagnosis = diagnose(Problem.from_logs(*read_trial(folder)), seconds=NO_LIMIT)
    for name in ("motions", "where", "residuals"):
        assert diagnosis.plot(name).axes
    assert "predicted beside it" in str(diagnosis.to_dict())
    assert [one.effect.name for one in diagnosis.effects()] == ["joint_elasticity"]


@pytest.mark.parametrize("mounting", ["joint side", "motor side"])
def test_another_ratio_than_stated_is_seen_between_the_encoders(tmp_path, mounting):
    robot, records = read_trial(trial_folder(tmp_path, mounting, "ratio_error", 40))
    diagnosis = diagnose(Problem.from_logs(robot, records), seconds=NO_LIMIT)
    assert diagnosis.verdict == "parametric"
    assert any(member.cause.variant == "motor.gear_ratio"
               for member in diagnosis.model.hypothesis.members)
