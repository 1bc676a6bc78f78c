"""Study of poorer logs: what is drawn, and how answers count."""

import dataclasses
import json
import tomllib
from collections import Counter

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.blind.laws import run as runs  # noqa: E402
from clie_blocks.analysis.blind.poor_logs import trials as made  # noqa: E402
from clie_blocks.analysis.blind.poor_logs.kinds import (  # noqa: E402
    CONDITIONS,
    CONTENTS,
    CURRENT,
    conditions_of,
    turn,
)
from clie_blocks.analysis.blind.poor_logs.logger import Encoder  # noqa: E402
from clie_blocks.analysis.blind.poor_logs.scoring import score, terminal_lines  # noqa: E402
from clie_blocks.analysis.blind.protocol import seal  # noqa: E402
from clie_blocks.analysis.cli import main as clie  # noqa: E402
from clie_blocks.analysis.gap.batch import read  # noqa: E402
from clie_blocks.analysis.gap.causes.vocabulary import class_of  # noqa: E402
from clie_blocks.analysis.gap.diagnosis import diagnose  # noqa: E402

SEED = 29  # of robots that no study has


def index_of(content, condition=None):
    return next(k for k in range(99) if turn(k)[0] == content
                and condition in (None, turn(k)[1]))


def test_every_content_meets_every_condition():
    turns = [turn(k) for k in range(len(CONTENTS) * len(CONDITIONS))]
    assert {turn[:2] for turn in turns} == {(a, b) for a in CONTENTS for b in CONDITIONS}
    sound = Counter(content for content, _, is_sound in turns if is_sound)
    assert set(sound) == set(CONTENTS) and {3, 4} >= set(sound.values())


def test_rates_go_from_50_hz_to_5_khz():
    rates = {1.0 / (one.every * one.period) for name in CONDITIONS for content in CONTENTS
             for one in [conditions_of(name, content)]}
    assert min(rates) == pytest.approx(50.0) and max(rates) == pytest.approx(5000.0)
    servos = [conditions_of(name, "servo") for name in CONDITIONS]
    for one in servos:
        rate = 1.0 / (one.every * one.period * (2.0 if one.is_jittered else 1.0))
        assert rate == pytest.approx(50.0)
        assert 0.97 * rate * one.seconds > 400.0  # rows that a diagnosis needs


def test_a_trial_is_the_same_for_its_seed(tmp_path):
    for name in ("a", "b"):
        made.write_trial(made.draw_trial(SEED, index_of("both", "short")), tmp_path / name)
    assert seal.folder_digest(tmp_path / "a") == seal.folder_digest(tmp_path / "b")
    made.write_trial(made.draw_trial(SEED + 1, index_of("both", "short")), tmp_path / "c")
    assert seal.folder_digest(tmp_path / "a") != seal.folder_digest(tmp_path / "c")


@pytest.mark.parametrize("content", [
    "command", "servo", "current", "two_sides",
    *(pytest.param(content, marks=pytest.mark.slow) for content in (
        "measured", "measured_without_law", "both", "neither", "torque_alone"))])
def test_files_say_what_their_logs_hold(content, tmp_path):
    trial = made.draw_trial(SEED, index_of(content, "one_log"))
    made.write_trial(trial, tmp_path)
    stated = tomllib.loads((tmp_path / "robot.toml").read_text())
    head = (tmp_path / "log-1.csv").read_text().splitlines()[0].split(",")
    for signal in ("u", "tau", "qd", "q_motor"):
        assert any(name.startswith(f"{signal}1") for name in head) == (
            signal in CONTENTS[content].signals)
    assert (stated["controller"]["law"] == "pd") == CONTENTS[content].states_law
    problem = read(tmp_path)
    assert len(problem.robot.joints) == trial.robot.arm.n
    if content == CURRENT:
        assert "tau1[A]" in head and stated["motor"]["torque_constant_tolerance"] == 0.1
        assert np.all(np.abs(trial.constant - 1.0) <= 0.05)


def test_what_a_drive_does_is_not_asked_of_a_torque_behind_it():
    blind = [k for k in range(99) if not CONTENTS[turn(k)[0]].shows_drive
             and not turn(k)[2] and turn(k)[1] == "one_log"]
    assert blind
    assert all(made.draw_trial(SEED, k).effect.name != "time_delay" for k in blind)


LABEL = {"content": "both", "condition": "short", "kind": "single", "labels": ["coulomb"],
         "joints": 1, "effects": [{"effect": "coulomb", "joints": [1], "size": 1.0}]}
SOUND = {**LABEL, "kind": "none", "labels": ["none"], "effects": []}


def said(*names, covers, unexplained=False):
    return {"verdict": "effect", "unexplained": unexplained, "set_90": list(covers), "log": {},
            "effects": [{"effect": name, "joint": None, "probability": probability}
                        for name, probability in names]}


def test_answers_count_by_what_would_be_done_on_them():
    answers = {
        "trial-0": said(("coulomb", 0.8), ("backlash", 0.2), covers=["coulomb"]),
        "trial-1": said(("backlash", 0.7), ("coulomb", 0.3), covers=["backlash", "coulomb"]),
        "trial-2": said(("none", 0.6), ("backlash", 0.4), covers=["none", "backlash"]),
        "trial-3": said(("unknown", 0.8), ("backlash", 0.2), covers=["unknown"],
                        unexplained=True),
        "trial-4": said(("backlash", 0.55), ("none", 0.45), covers=["backlash"]),
        "trial-5": {"error": "log-1.csv: no time", "exit_code": 3}}
    labels = {name: SOUND if name in ("trial-2", "trial-4") else LABEL for name in answers}
    labels["trial-3"] = {**LABEL, "content": "neither"}
    board = score(answers, labels, str)
    hits = {key: board[key]["hits"] for key in (
        "wrong", "covered", "right_first", "unknown", "stopped")}
    assert hits == {"wrong": 2, "covered": 3, "right_first": 2, "unknown": 1, "stopped": 1}
    neither = board["by_content"]["neither"]
    assert (neither["unknown"]["hits"], neither["wrong"]["hits"], neither["wrong"]["of"]) == (
        1, 0, 1)
    assert board["covered"]["of"] == 6  # an error has no set, and covers nothing
    lines = "\n".join(terminal_lines({**board, "command": "clie blind"}))
    assert "wrong name with half the probability: 2 of 6" in lines
    assert "trial-4: none (both, short), named backlash" in lines
    assert "trial-3" not in lines


def test_steps_of_the_position_that_the_logger_made_are_no_false_name():
    rounded = {**LABEL, "content": "neither", "condition": "coarse"}
    answer = said(("encoder_quantization", 0.97), ("coulomb", 0.8),
                  covers=["encoder_quantization", "coulomb"])
    for label, wrong in ((rounded, 0), ({**rounded, "content": "both"}, 1)):
        board = score({"trial-0": answer}, {"trial-0": label}, str)
        assert (board["wrong"]["hits"], board["covered"]["hits"]) == (wrong, 1)
        assert board["right_first"]["hits"] == 1 - wrong


def test_a_channel_that_the_logger_delays_is_no_false_name():
    """A low-pass of the measured torque lets it lag the position."""
    filtered = {**LABEL, "content": "measured", "condition": "filtered"}
    answer = said(("channel_skew", 0.99), ("coulomb", 0.8), covers=["channel_skew", "coulomb"])
    for label, wrong in ((filtered, 0), ({**filtered, "content": "neither"}, 1)):
        board = score({"trial-0": answer}, {"trial-0": label}, str)
        assert (board["wrong"]["hits"], board["covered"]["hits"]) == (wrong, 1)


def test_a_delayed_channel_that_was_corrected_is_no_false_name_either():
    filtered = {**LABEL, "content": "torque_alone", "condition": "filtered"}
    corrected = {"corrections": [{"effect": "channel_skew", "joint": [1]}]}
    answer = {**said(("coulomb", 0.8), covers=["coulomb"]), "log": corrected}
    for label, wrong in ((filtered, 0), ({**filtered, "condition": "short"}, 1)):
        board = score({"trial-0": answer}, {"trial-0": label}, str)
        assert (board["wrong"]["hits"], board["right_first"]["hits"]) == (wrong, 1 - wrong)


def test_what_names_the_logger_alone_finds_the_robot_sound():
    rounded = {**SOUND, "content": "servo", "condition": "coarse"}
    answer = said(("encoder_quantization", 0.98), ("none", 0.02), covers=["encoder_quantization"])
    board = score({"trial-0": answer}, {"trial-0": rounded}, str)
    assert board["covered"]["hits"] == board["right_first"]["hits"] == 1


def test_an_effect_that_its_logs_do_not_hold_is_drawn_anew():
    trial = next(one for one in (made.draw_trial(SEED, index) for index in range(0, 99, 11))
                 if one.effect.name)
    assert made.shows_effect(trial)
    robot, joint = trial.robot, trial.effect.joint
    light = runs.Effect("coulomb", joint, 1e-6 * robot.arm.gear[joint] * trial.peak[joint])
    arm = dataclasses.replace(robot.arm, has_gravity=True)  # horizontal: held at one flank
    held = dataclasses.replace(robot, arm=arm, condition=CONDITIONS["standstills"])
    loose = runs.Effect("backlash", 0, 0.02)
    noisy = dataclasses.replace(robot, encoder=Encoder(1.0, 1e-6))
    assert not made.shows_effect(dataclasses.replace(trial, effect=light))
    assert not made.shows_effect(dataclasses.replace(trial, effect=loose, robot=held))
    quick = dataclasses.replace(held, arm=dataclasses.replace(arm, has_gravity=False))
    assert made.shows_effect(dataclasses.replace(trial, effect=loose, robot=quick))
    assert not made.shows_effect(dataclasses.replace(trial, robot=noisy))
    assert made.shows_effect(dataclasses.replace(trial, effect=runs.SOUND, robot=noisy))


def test_names_that_are_alike_are_one():
    alike = said(("backlash", 0.9), covers=["backlash"])
    alike["effects"][0]["alike"] = ["coulomb"]
    board = score({"trial-0": alike}, {"trial-0": LABEL}, str)
    assert (board["wrong"]["hits"], board["covered"]["hits"], board["right_first"]["hits"]) == (
        0, 1, 1)


@pytest.mark.slow
@pytest.mark.parametrize(("index", "content"), [(10, "measured"), (54, "command")])
def test_rows_at_uneven_times_hide_no_effect_and_show_none(index, content, tmp_path):
    trial = made.draw_trial(SEED, index)
    assert (trial.content, trial.condition) == (content, "jittered")
    made.write_trial(trial, tmp_path)
    answer = diagnose(read(tmp_path)).to_dict()
    board = score({"trial-0": answer}, {"trial-0": trial.label}, class_of)
    assert (board["wrong"]["hits"], board["right_first"]["hits"]) == (0, 1)


@pytest.mark.slow
def test_a_study_from_one_command_is_continued(tmp_path, capsys):
    command = ["blind", "--poor-logs", "1", "--seed", str(SEED), "-o", str(tmp_path)]
    clie(command)
    assert "90 % set holds the truth" in capsys.readouterr().out
    board = json.loads((tmp_path / "poor_logs.json").read_text())
    assert board["trials"] == 1 and board["wrong"]["hits"] == 0
    assert board["command"] == f"clie blind --poor-logs 1 --seed {SEED}"
    sealed = (tmp_path / seal.SEALED).read_bytes()
    clie(command)
    assert (tmp_path / seal.SEALED).read_bytes() == sealed
    assert json.loads((tmp_path / "poor_logs.json").read_text()) == board
