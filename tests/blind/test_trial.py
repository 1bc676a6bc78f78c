"""Trials: independent of the package's effects, repeatable, in the format that is read."""

import ast
import dataclasses
import gzip
import hashlib
import types
from pathlib import Path

import numpy as np
import pytest

import clie_blocks.analysis.blind as blind
from clie_blocks.analysis.blind.engine.control_loop import run
from clie_blocks.analysis.blind.engine.drive import Chance
from clie_blocks.analysis.blind.engine.experiments import draw_motions
from clie_blocks.analysis.blind.engine.robot import (
    NEUTRAL,
    SAG,
    G,
    draw_robot,
    draw_truth,
    link_inertia,
    restated,
)
from clie_blocks.analysis.blind.population import standard
from clie_blocks.analysis.blind.population.effect_size import prediction, ratio_of, reference
from clie_blocks.analysis.blind.population.effects import EFFECTS, OUTSIDERS, Scene, draw_hidden
from clie_blocks.analysis.blind.population.files import robot_text, write_trial
from clie_blocks.analysis.blind.population.maker import Family, RejectedError, Trial, make_trial
from clie_blocks.analysis.blind.population.standard import HIDDEN, KINDS, ONE_OF, SEVERITY, plan
from clie_blocks.analysis.blind.scoring.decisions import FAMILY
from clie_blocks.analysis.records import read_trial

FILES = sorted(Path(blind.__file__).parent.glob("*.py"))
MAKERS = ("robot", "motion", "world", "controller", "drive", "loop", "hidden", "size", "family",
          "trial", "folder")


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_nothing_comes_from_the_package_that_is_on_trial(path):
    found = {node.module if isinstance(node, ast.ImportFrom) else node.names[0].name
             for node in ast.walk(ast.parse(path.read_text()))
             if isinstance(node, (ast.Import, ast.ImportFrom))}
    ours = {name for name in found if name.startswith("clie_blocks")}
    assert not any(name.startswith("clie_blocks.effects") for name in ours)
    if path.stem in MAKERS:
        assert all(name.startswith("clie_blocks.analysis.blind")
                   or name in ("clie_blocks.errors", "clie_blocks.output") for name in ours)


def test_a_study_holds_all_kinds_and_every_effect_in_all_sizes():
    plans = [plan(5, index) for index in range(3 * len(KINDS))]
    named = {kind: {name for k, names, _ in plans if k == kind for name in names}
             for kind in ("single", "unknown")}
    assert named == {"single": set(EFFECTS), "unknown": set(OUTSIDERS)}
    assert {kind for kind, _, _ in plans} == set(KINDS)
    sizes = {(names[0], severity) for kind, names, severity in plans if kind == "single"}
    assert len(sizes) == len(EFFECTS) * len(SEVERITY)


def test_pairs_and_triples_hold_that_many_different_effects():
    plans = [plan(6, index) for index in range(2 * len(KINDS))]
    for kind, count in (("pair", 2), ("triple", 3)):
        found = [set(names) for k, names, _ in plans if k == kind]
        assert found and all(len(names) == count for names in found)
        assert all(len(names & set(group)) < 2 for names in found for group in ONE_OF)


def test_robots_have_one_to_six_joints_and_gears_up_to_200():
    robots = [draw_robot(np.random.default_rng(k)) for k in range(300)]
    assert {robot.n for robot in robots} == set(range(1, 7))
    assert {robot.n for robot in robots if robot.kind == "arm"} == set(range(2, 7))
    ratios = np.concatenate([robot.ratio for robot in robots])
    assert 1.0 <= ratios.min() < 2.0 and 150.0 < ratios.max() <= 200.0
    assert {robot.period for robot in robots} == {5e-4, 1e-3, 2e-3}
    assert {robot.discretisation for robot in robots} >= {"tustin", "zoh", "backward"}


def test_a_robot_carries_its_own_weight():
    for seed in range(40):
        robot = draw_robot(np.random.default_rng(seed), "arm", True)
        stretched = [G * sum(robot.mass[i] * (robot.length[k:i].sum() + robot.com[i])
                             for i in range(k, robot.n)) for k in range(robot.n)]
        assert np.all(stretched / (robot.kp * robot.ratio) < 1.01 * SAG)


@pytest.mark.parametrize(("index", "digest"), [
    (21, "7970eb4378625790"), (40, "228a19bcd8c6df18"), (82, "639312a9b7efd7a2"),
    (89, "924e55f30130e184")])
def test_robots_and_experiments_of_a_published_seed_stay_what_they_were(index, digest):
    """Healthy robots of seed 41, of which nothing but chance decides; simulation is not asked."""
    rng = np.random.default_rng([41, index, 0])
    robot = draw_robot(rng)
    draw_truth(rng, robot)
    text = robot_text(robot, draw_motions(rng, robot))
    assert hashlib.sha256(text.encode()).hexdigest().startswith(digest)


def test_at_least_eight_effects_are_outside_the_vocabulary():
    assert len(OUTSIDERS) >= 8 and not set(OUTSIDERS) & set(FAMILY)
    assert set(EFFECTS) == set(FAMILY)


@pytest.mark.parametrize("name", [*EFFECTS, *OUTSIDERS])
def test_an_effect_changes_numbers_only_at_its_joint_and_vanishes_with_its_size(name):
    rng = np.random.default_rng(8)
    robot = draw_robot(rng, "arm", name == "load_dependent_friction", name != "coupling")
    truth = draw_truth(rng, robot)
    runs = [(robot.pose + 0.1 * np.sin(np.arange(50.0))[:, None], np.ones((50, robot.n)))]
    hidden = draw_hidden(rng, name, Scene(robot, truth, runs, 1))
    strong, weak = hidden.onto(truth, 3.0), hidden.onto(truth, 1e-9)
    changed = {key for key in NEUTRAL if not np.array_equal(strong[key], truth[key])}
    assert changed
    if hidden.joints:
        assert all(strong[key][0] == truth[key][0] for key in changed)
    grows = [key for key in changed if not np.array_equal(strong[key], weak[key])]
    assert grows


def test_link_inertia_of_a_stretched_arm_is_that_of_its_masses():
    length, mass, com = np.array([0.5, 0.4]), np.array([1.0, 0.6]), np.array([0.2, 0.3])
    inertia, stretched = np.array([0.01, 0.02]), np.array([0.7, 0.0])
    found = link_inertia("arm", length, mass, com, inertia, stretched)
    assert found == pytest.approx([1.0 * 0.04 + 0.01 + 0.6 * 0.8**2 + 0.02, 0.6 * 0.09 + 0.02])


@pytest.mark.parametrize(("trace", "size"), [
    (lambda s: np.log(s), 4.0), (lambda s: np.log(40 * s), 0.1), (lambda s: np.log(s / 40), 160.0),
    (lambda s: np.log(1e4 * s), 4e-4),
    (lambda s: np.where(s < 5, np.log(s), np.nan), 4.0),
    (lambda s: np.log(s) + 5.0 * (s > 5), 4.0)],
    ids=["plain", "strong", "weak", "far too strong", "wild beyond", "rings beyond"])
def test_the_size_of_an_effect_is_found_wherever_it_lies(monkeypatch, trace, size):
    monkeypatch.setattr(standard, "_traces", lambda robot, lanes, *rest: trace(np.array(lanes)))
    hidden = types.SimpleNamespace(name="coulomb", onto=lambda truth, size: size)
    monkeypatch.setitem(standard.SEVERITY, "four", np.sqrt(17.0))
    found, reached = standard._sized(None, None, None, None, None, hidden, "four", 0)
    assert reached and found == pytest.approx(size, rel=1e-6)


def test_a_size_that_no_robot_shows_is_said_to_be_missed(monkeypatch):
    monkeypatch.setattr(standard, "_traces", lambda robot, lanes, *rest: np.tanh(lanes) - 2.0)
    hidden = types.SimpleNamespace(name="coulomb", onto=lambda truth, size: size)
    assert not standard._sized(None, None, None, None, None, hidden, "strong", 0)[1]


def test_chance_is_the_same_for_copies_of_an_experiment_and_differs_between_experiments():
    one, two = object(), object()
    draw = Chance((3, 1), [one, two, one], 2)("standard_normal")
    assert np.array_equal(draw[0], draw[2]) and not np.any(draw[0] == draw[1])
    assert np.array_equal(Chance((3, 1), [one], 2)("standard_normal")[0], draw[0])


def test_hidden_coupling_leaves_every_joint_its_inertia_at_the_pose():
    robot = draw_robot(np.random.default_rng(8), "arm", False, coupling=False)
    truth = {**draw_truth(np.random.default_rng(9), robot), "links": np.full(robot.n, 0.4)}
    stated = restated(robot, truth)
    assert stated.link == pytest.approx(0.4 * robot.link)
    assert stated.rotor * robot.ratio**2 + stated.link == pytest.approx(
        robot.rotor * robot.ratio**2 + robot.link)
    assert not stated.coupling


def test_a_change_of_the_joint_model_leaves_no_trace_after_the_refit(bench):
    joint = bench()
    there_and_back = 0.3 * joint.robot.kp * np.sin(4 * np.arange(2000) * 1e-3)[:, None]
    motions = [dataclasses.replace(joint.motion(2.0), pe=there_and_back),
               joint.motion(2.0, angle=0.2)]
    noises = [np.zeros(motion.q_d.shape) for motion in motions]
    robot = _noisy(joint.robot)
    ref = reference(robot, joint.truth, motions, noises)
    heavier = {**joint.truth, "rotor": 1.02 * joint.truth["rotor"],
               "drag": 1.05 * joint.truth["drag"]}
    rubbing = {**joint.truth, "level": 3e-3 * robot.kp}
    ratios = [ratio_of(prediction(robot, ref, run(robot, [lane] * 2, motions, noises)))
              for lane in (joint.truth, heavier, rubbing)]
    assert ratios[0] == 1.0 and ratios[1] < 1.05 and ratios[2] > 3


def _noisy(robot):
    return dataclasses.replace(robot, sigma=np.full(robot.n, 1e-4))


@pytest.fixture(scope="module")
def made():
    index = next(i for i in range(60) if plan(2001, i)[0] == "none")
    return index, make_trial(HIDDEN, 2001, index)


def test_a_trial_is_read_by_the_package_and_says_nothing_of_its_label(made, tmp_path):
    _, told = made
    write_trial(told, tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "log-1.csv.gz", "log-2.csv.gz", "log-3.csv.gz", "robot.toml"]
    robot, records = read_trial(tmp_path)
    assert robot.n == told.robot.n and len(records) == 3
    for record, (q, u) in zip(records, told.runs):
        assert record.q == pytest.approx(q, abs=1e-12)
        assert record.u == pytest.approx(u, abs=1e-9)
    head = gzip.decompress((tmp_path / "log-1.csv.gz").read_bytes()).split(b"\n")[0].decode()
    assert head == ",".join(["time"] + [f"{name}{k + 1}" for name in ("q", "u", "qd", "pe")
                                        for k in range(robot.n)])


def test_a_healthy_trial_shows_nothing_beyond_the_noise(made):
    label = made[1].label
    assert label["kind"] == "none" and label["labels"] == ["none"]
    assert label["ratio"] == pytest.approx(1.0, abs=0.01)


def test_the_same_seed_makes_the_same_trial(made, tmp_path):
    index, told = made
    again = make_trial(HIDDEN, 2001, index)
    assert all(np.array_equal(a, b) for one, two in zip(told.runs, again.runs)
               for a, b in zip(one, two))
    assert again.label == told.label


def test_a_rejected_draw_is_drawn_anew_and_its_reason_kept():
    drawn = []

    def draw(rng, seed, index):
        drawn.append(rng.random())
        if len(drawn) < 3:
            raise RejectedError(f"draw {len(drawn)}")
        return Trial(None, [], [], {"seed": seed, "index": index})

    told = make_trial(Family(draw, (7,)), 3, 4)
    assert told.label == {"seed": 3, "index": 4, "rejected": ["draw 1", "draw 2"]}
    assert len(set(drawn)) == 3
    assert drawn[2] == np.random.default_rng([3, 4, 2, 7]).random()


def test_a_family_that_nothing_is_accepted_of_says_why():
    def draw(rng, seed, index):
        raise RejectedError("too heavy")

    with pytest.raises(RuntimeError, match="trial 4 of seed 3: .*too heavy"):
        make_trial(Family(draw), 3, 4)
