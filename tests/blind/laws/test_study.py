"""Study of laws: what is drawn, right statements give the commands, and how answers count."""

import json
from collections import Counter

import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.blind.laws import trials as made  # noqa: E402
from clie_blocks.analysis.blind.laws.drawn import KINDS  # noqa: E402
from clie_blocks.analysis.blind.laws.scoring import (  # noqa: E402
    is_law_named,
    score,
    terminal_lines,
)
from clie_blocks.analysis.cli import main as clie  # noqa: E402
from clie_blocks.analysis.gap.batch import read  # noqa: E402
from clie_blocks.analysis.gap.controller.check import check_controller  # noqa: E402

SEED = 23  # of robots that no study has


@pytest.fixture
def short(monkeypatch):
    monkeypatch.setattr(made, "SECONDS", 4.0)
    monkeypatch.setattr(made, "LOGS", 1)


def index_of(kind, described, sound):
    return next(k for k in range(1000) if made.turn(k) == (kind, described, sound))


def test_six_laps_have_every_law_in_every_turn():
    turns = Counter(made.turn(k) for k in range(len(KINDS) * len(made.TURNS)))
    assert turns == Counter((kind, *one) for kind in KINDS for one in made.TURNS)
    assert sum(count for (_, _, sound), count in turns.items() if sound) * 3 == turns.total()
    assert 2 * sum(count for (_, described, _), count in turns.items()
                   if described == made.RIGHT) == turns.total()


@pytest.mark.parametrize("kind", [
    "integral_that_winds_up", "computed_torque",
    *(pytest.param(kind, marks=pytest.mark.slow) for kind in (
        "old_gains", "slower_position_loop", "velocity_of_error", "limit", "cascade",
        "feedforward_of_acceleration", "weight",
        "inverse_dynamics", "command_low_pass", "error_low_pass", "rate_limit"))])
def test_a_right_statement_gives_the_commands(kind, tmp_path, short):
    made.write_trial(made.draw_trial(SEED, index_of(kind, made.RIGHT, True)), tmp_path)
    check = check_controller(read(tmp_path))
    assert check.as_stated and not check.differences


LABEL = {"law": "integral", "described": "wrong", "kind": "none", "labels": ["none"],
         "joints": 2, "effects": [], "words": ["is PID ("], "numbers": {"ki": [2.0, 0.5]}}
ANSWER = {"verdict": "none", "effects": [{"effect": "none", "joint": None, "probability": 0.9}],
          "unexplained": False, "set_90": ["none"], "laws": [],
          "controller_as_stated": False, "controller_differences": [], "log": {}}


def said(*gains):
    return [f"joint{k}: the law that ran is PID (>99 %): kp 3 +- 0 N m/rad, ki {ki} +- 1e-06 N "
            "m/(rad s)" for k, ki in enumerate(gains, 1)]


def test_a_law_counts_as_named_with_its_numbers_at_every_joint():
    def counts(*gains):
        return is_law_named(LABEL, {**ANSWER, "controller_differences": said(*gains)})

    assert counts(2.05, 0.49)
    assert not counts(2.5, 0.5) and not counts(2.0) and not counts()
    assert not is_law_named(LABEL, {**ANSWER, "decisions": ["the log has a PID (1): 2 0.5"]})
    right = {**LABEL, "described": "right"}
    assert is_law_named(right, {**ANSWER, "controller_as_stated": True})
    assert not is_law_named(right, {**ANSWER, "controller_as_stated": True,
                                    "laws": [{"joint": 1, "law": "PID", "numbers": {}}]})


def test_what_is_said_of_the_law_accuses_no_robot():
    effect = {"effect": "hidden_integral", "joint": [1], "probability": 0.97}
    of_law = {**ANSWER, "verdict": "effect", "effects": [effect],
              "controller_differences": said(2.0, 0.5)}
    robot = {**ANSWER, "verdict": "effect",
             "effects": [{"effect": "coulomb", "joint": [1], "probability": 0.6}]}
    board = score({"trial-0": of_law, "trial-1": robot},
                  {"trial-0": LABEL, "trial-1": LABEL}, str)
    assert board["accused"]["hits"] == 1 and board["none_of_sound"]["hits"] == 1
    assert board["law_named"]["hits"] == 1


def test_effects_are_compared_with_the_same_robots_under_pd():
    label = {**LABEL, "kind": "single", "labels": ["coulomb"], "effects": [
        {"effect": "coulomb", "joint": 1, "size": 1.0}]}
    named = {**ANSWER, "effects": [{"effect": "coulomb", "joint": [1], "probability": 0.8}]}
    board = score({"trial-0": ANSWER, "twin-0": named}, {"trial-0": label}, str)
    assert (board["right_first"]["hits"], board["right_first_of_twins"]["hits"]) == (0, 1)
    assert board["beside_twins"]["value"] == -1.0
    assert "difference: -100 points" in "\n".join(terminal_lines({**board, "command": "clie"}))


@pytest.mark.slow
def test_a_study_from_one_command(tmp_path, short, capsys):
    clie(["blind", "--laws", "1", "--seed", str(SEED), "-o", str(tmp_path)])
    assert "law accepted, or named with its numbers" in capsys.readouterr().out
    board = json.loads((tmp_path / "laws.json").read_text())
    assert board["trials"] == 1 and board["command"] == f"clie blind --laws 1 --seed {SEED}"
    assert board["by_law"]["old_gains"]["of"] == board["law_named"]["of"] == 1


@pytest.mark.slow
@pytest.mark.parametrize("kind", [
    "integral_that_winds_up", "integral_at_its_limit", "limit", "rate_limit"])
def test_a_sound_arm_whose_command_meets_a_limit_is_not_called_unknown(kind, tmp_path):
    """Its loop is open at the limit, so that no model under that law would follow it."""
    from clie_blocks.analysis.gap.diagnosis import diagnose

    for described in (made.RIGHT, made.WRONG):
        made.write_trial(made.draw_trial(SEED, index_of(kind, described, True)),
                         tmp_path / described)
        answer = diagnose(read(tmp_path / described))
        assert answer.verdict == "none"
        assert any("meets a limit" in one for one in answer.to_dict()["decisions"])


@pytest.mark.slow
def test_backlash_shows_where_the_rate_of_the_command_is_limited(tmp_path, monkeypatch):
    from clie_blocks.analysis.gap.diagnosis import diagnose

    monkeypatch.setattr(made, "EFFECTS", ("backlash",))
    trial = made.draw_trial(SEED, index_of("rate_limit", made.WRONG, False))
    made.write_trial(trial, tmp_path)
    effects = diagnose(read(tmp_path)).to_dict()["effects"]
    assert effects[0]["effect"] == "backlash" and effects[0]["probability"] > 0.9
