"""The study of the whole catalogue: what it holds, and that its trials are what they say."""

import dataclasses
import hashlib

import numpy as np
import pytest

from clie_blocks.analysis.blind.engine import experiments
from clie_blocks.analysis.blind.engine.control_loop import run
from clie_blocks.analysis.blind.engine.parameters import healthy_parameters
from clie_blocks.analysis.blind.engine.robot import draw_robot
from clie_blocks.analysis.blind.population import standard
from clie_blocks.analysis.blind.population.catalogue import (
    CATALOGUE,
    HEALTHY,
    LAP,
    PARAMETERS,
    WHOLE_CATALOGUE,
    plan,
)
from clie_blocks.analysis.blind.population.files import robot_text, write_trial
from clie_blocks.analysis.blind.population.maker import make_trial
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records import read_record, read_robot

PLANS_OF_PUBLISHED_SEEDS = "68e2cb17b2bdaf44"


def test_a_lap_holds_every_name_once_and_robots_without_any():
    for lap in range(2):
        plans = [plan(7, index) for index in range(lap * LAP, (lap + 1) * LAP)]
        named = {kind: sorted(name for k, name, _ in plans if k == kind)
                 for kind in ("single", "parametric", "unknown")}
        assert named == {"single": sorted(CATALOGUE.effects), "parametric": sorted(PARAMETERS),
                         "unknown": sorted(CATALOGUE.outsiders)}
        assert sum(kind == "none" for kind, _, _ in plans) == HEALTHY


def test_a_name_meets_every_size_in_three_laps_and_in_three_seeds():
    for runs in ([(7, lap) for lap in range(3)], [(seed, 0) for seed in (7, 8, 9)]):
        sizes = {}
        for seed, lap in runs:
            for index in range(lap * LAP, (lap + 1) * LAP):
                kind, name, size = plan(seed, index)
                if kind == "single":
                    sizes.setdefault(name, set()).add(size)
        assert all(found == set(standard.SEVERITY) for found in sizes.values())


def test_the_plans_of_published_seeds_stay_what_they_were():
    plans = [standard.plan(seed, index) for seed in range(81, 86) for index in range(100)]
    digest = hashlib.sha256(repr(plans).encode()).hexdigest()
    assert digest.startswith(PLANS_OF_PUBLISHED_SEEDS)


def trial_of(name, monkeypatch, seed=2101):
    monkeypatch.setattr(experiments, "DURATIONS", (3.0,))
    return make_trial(WHOLE_CATALOGUE, seed, next(
        index for index in range(LAP) if plan(seed, index)[1] == name))


def test_a_parametric_trial_says_which_parameter_and_has_no_effect(monkeypatch):
    label = trial_of("viscous", monkeypatch).label
    assert label["kind"] == "parametric" and label["labels"] == ["viscous"]
    assert label["effects"] == [] and label["ratio"] == pytest.approx(1.0)


def test_a_log_with_a_skew_shows_the_command_of_earlier_rows_at_one_joint(monkeypatch, tmp_path):
    made = trial_of("channel_skew", monkeypatch)
    write_trial(made, tmp_path)
    robot = read_robot(tmp_path / "robot.toml")
    problem = Problem.from_logs(robot, [read_record(tmp_path / "log-1.csv.gz", robot)],
                                trust_logs=True)
    (joint,), (log,) = made.label["effects"][0]["joints"], problem.fit
    late = np.ceil(np.divide(made.label["effects"][0]["numbers"]["skew"], problem.period) - 1e-9)
    command = problem.stated_law.replay(log.q, log.q_d, log.pe)
    for k, rows in enumerate(late.astype(int)):
        assert (rows >= 1) == (k == joint - 1)
        difference = log.u[200:, k] - np.roll(command[:, k], rows)[200:]
        assert np.abs(difference).max() < 2 * made.robot.command_step[k]


@pytest.mark.slow
@pytest.mark.parametrize("name", [*CATALOGUE.effects, *CATALOGUE.outsiders])
def test_every_name_reaches_its_size_on_a_robot_that_one_would_log(name, monkeypatch):
    made = trial_of(name, monkeypatch)
    assert all(np.isfinite(values).all() for run in made.runs for values in run)
    assert made.label["labels"] == [name]
    if name not in standard.ABSORBED:
        assert made.label["ratio"] == pytest.approx(made.label["target_ratio"], rel=0.3)


def test_encoders_on_motors_see_a_soft_gear_from_its_other_side(monkeypatch):
    """With its encoders behind the gear a robot logs another motion; the file says which."""
    monkeypatch.setattr(experiments, "DURATIONS", (3.0,))
    logs = {}
    for share, side in ((0.0, "joint side"), (1.0, "motor side")):
        names = dataclasses.replace(CATALOGUE, motor_encoders=share)
        robot = names.mount_encoder(np.random.default_rng(1), draw_robot(
            np.random.default_rng(2), "pendulum"), ("joint_elasticity",))
        assert f'mounting = "{side}"' in robot_text(robot, [])
        truth = {**healthy_parameters(1), "rotor": robot.rotor, "drag": robot.drag,
                 "twist_stiffness": np.array([400.0]), "twist_damping": np.array([0.5])}
        rng = np.random.default_rng(3)
        wanted = experiments.draw_experiments(rng, robot)[:1]
        (logs[side], _), = run(robot, [truth], wanted, [0 * wanted[0].q_d], seed=1)
    assert 1e-5 < np.abs(logs["joint side"] - logs["motor side"]).max() < 0.1
    kept = CATALOGUE.mount_encoder(np.random.default_rng(1), robot, ("kinematic_error",))
    assert kept is robot
