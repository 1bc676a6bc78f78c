"""A recommended run is executed as it is written, on the robot whose logs led to it."""

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")

from clie_blocks.analysis.blind.experiments import rounds, trials  # noqa: E402
from clie_blocks.analysis.blind.experiments.scoring import (  # noqa: E402
    figures,
    is_missed,
    score,
    terminal_lines,
)
from clie_blocks.analysis.blind.population.maker import make_trial  # noqa: E402
from clie_blocks.analysis.records import read_trial  # noqa: E402

SEED = 5002


@pytest.fixture(scope="module")
def trial():
    return make_trial(trials.POPULATION, SEED, 0)


def csv(robot, q_d, pe):
    """Set-points as an answer writes them."""
    head = ",".join(["time", *(f"{name}{k + 1}" for name in ("qd", "pe") for k in range(robot.n))])
    rows = np.column_stack([robot.period * np.arange(len(q_d)), q_d, pe])
    return "\n".join([head, *(",".join(map(str, row)) for row in rows)])


def test_the_robot_repeats_a_run_of_its_logs(trial):
    """Executed again, the set-points of the first log give its motion, but for the noise."""
    first, (q, u) = trial.experiments[0], trial.runs[0]
    short = slice(0, round(2.0 / trial.robot.period))
    again = rounds.execute(trial, csv(trial.robot, first.q_d[short], first.pe[short]), SEED, 0, 1)
    assert len(again.runs) == len(trial.runs) + 1
    moved = np.ptp(q[short])
    assert np.abs(again.runs[-1][0] - q[short]).max() < 0.05 * moved + 5 * trial.robot.sigma.max()
    assert again.runs[-1][1].shape == u[short].shape


def test_the_robot_file_states_limits_that_hold_its_logs(trial, tmp_path):
    trials.write_robot(trial, tmp_path)
    robot, records = read_trial(tmp_path)
    assert len(records) == trials.LOGS
    q = np.concatenate([record.q for record in records])
    assert (robot.limits.lower <= q.min(axis=0) + 1e-5).all()
    assert (robot.limits.upper >= q.max(axis=0) - 1e-5).all()
    assert (robot.limits.speed == trials.SPEED).all()


def answer(*names, probability=0.9):
    """An answer whose set holds some names, the first with some probability."""
    rest = (1.0 - probability) / max(len(names) - 1, 1)
    return {"effects": [{"effect": name, "joint": [1], "probability": probability if k == 0 else
                         rest} for k, name in enumerate(names)],
            "set_90": list(names), "unexplained": False, "used": None}


def test_runs_are_counted_to_one_name():
    label = {"kind": "single", "labels": ["coulomb"], "severity": "mild",
             "effects": [{"effect": "coulomb", "joints": [1]}]}
    ran = {"used": [0.9, 0.5, 0.4]}
    answers = {"a": [answer("stribeck", "coulomb", probability=0.6), answer("coulomb") | ran],
               "b": [answer("coulomb")],
               "c": [answer("coulomb", "stribeck", probability=0.6),
                     answer("coulomb", "stribeck", probability=0.6) | {"used": [1.2, 0.1, 0.1]}],
               "d": [answer("coulomb", "stribeck", probability=0.6)]}
    board = score(answers, dict.fromkeys(answers, label), lambda name: name)
    assert (board["ambiguous"]["hits"], board["followed"]["hits"]) == (3, 2)
    rows = {row["trial"]: row for row in board["rows"]}
    assert rows["a"]["runs"] == 1 and rows["c"]["runs"] == rounds.RUNS + 1
    assert rows["a"]["right"] == [False, True]
    assert board["runs"]["value"] == pytest.approx((1 + rounds.RUNS + 1) / 2)
    assert [one["value"] for one in board["sizes"]] == [2.0, 1.5, 1.5, 1.5]
    assert board["exceeded"]["hits"] == 1 and board["largest"]["position"] == 1.2
    assert is_missed(board)
    failed = score({"a": [*answers["a"][:1], {"error": "stopped", **ran}]}, {"a": label},
                   lambda name: name)
    assert failed["rows"][0]["runs"] == rounds.RUNS + 1 and not failed["reached"]["hits"]
    told = "\n".join(terminal_lines({**board, "command": "clie blind"}))
    assert "runs beyond a stated limit: 1 of 2" in told
    assert not is_missed({**figures([]), "left": 0})


@pytest.mark.slow
@pytest.mark.parametrize("index, name", [(70, "dead_zone"), (172, "time_delay")])
def test_a_robot_that_its_run_left_without_a_name_is_named(index, name, tmp_path):
    last = rounds.follow(tmp_path / "robot", 88069, index)[-1]
    assert last["effects"][0]["effect"] == name
    assert last["effects"][0]["probability"] > 0.9
