"""The study of simulator faults: sealed, examined, scored."""

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.blind.command import main  # noqa: E402
from clie_blocks.analysis.blind.protocol import seal  # noqa: E402
from clie_blocks.analysis.blind.simulator_faults import study, trials  # noqa: E402
from clie_blocks.analysis.blind.simulator_faults.injected import INJECTED, NONE  # noqa: E402
from clie_blocks.analysis.blind.simulator_faults.joint import (  # noqa: E402
    PERIOD,
    draw_joint,
    experiments,
)
from clie_blocks.analysis.blind.simulator_faults.run import Run, simulate  # noqa: E402
from clie_blocks.analysis.gap.simulator_faults.faults import FAULTS  # noqa: E402


@pytest.fixture
def few(monkeypatch):
    """Two kinds of trials, whose answers are given here."""
    kept = {name: INJECTED[name] for name in (NONE, "gravity_twice")}
    for module in (study, trials):
        monkeypatch.setattr(module, "INJECTED", kept)
    monkeypatch.setattr(study, "_examine", lambda folder, jobs: {
        path.name: {"verdict": "gravity_twice", "faults": []}
        for path in (folder / "trials").iterdir()})


def test_labels_are_sealed_until_all_answers_are_there(few, tmp_path, capsys):
    """One answer for all: every fault is right, and every sound simulator a false alarm."""
    command = ["--simulator-faults", "2", "--seed", "5", "-o", str(tmp_path)]
    assert main([*command, "--json"]) == 0
    board = json.loads(capsys.readouterr().out)
    assert board["named_first"]["hits"] == board["named_first"]["of"] == 2
    assert board["false_alarm"]["hits"] == board["false_alarm"]["of"] == 2
    assert [row["fault"] for row in board["wrong"]] == [NONE, NONE]
    events = [line["event"] for line in seal.read_log(tmp_path)]
    assert events == ["made", "sealed", "diagnosed", "unsealed"]
    assert main(command) == 0  # goes on with the same trials
    assert "false alarm on a sound simulator: 2 of 2" in capsys.readouterr().out


def test_a_trial_holds_no_trace_of_its_fault(few, tmp_path):
    """The files of a fault and of none are the same for the same robot: only the logs differ."""
    for name in (NONE, "gravity_twice"):
        trials.write_trial(tmp_path / name, name, 3, 0)
    for file in (trials.MODEL, trials.ROBOT):
        assert len({(tmp_path / name / file).read_text() for name in (NONE, "gravity_twice")}) == 1
    one, other = (np.loadtxt(tmp_path / name / "log-1.csv", delimiter=",", skiprows=1)
                  for name in (NONE, "gravity_twice"))
    np.testing.assert_array_equal(one[:, 3:], other[:, 3:])
    assert np.abs(one[:, 1] - other[:, 1]).max() > 1e-3


def test_a_sound_joint_follows_its_set_points_with_the_stated_law():
    joint = draw_joint(np.random.default_rng(0))
    q_d, pe = experiments(np.random.default_rng(0), joint)[0]
    time, q, u, reference, excitation = simulate(joint, Run(), q_d[:400], pe[:400]).T
    rate = np.diff(q, prepend=q[0]) / PERIOD
    np.testing.assert_allclose(u, joint.kp * (reference - q) - joint.kd * rate + excitation,
                               atol=1e-12)
    assert np.abs(q - reference).max() < 0.5 and time[-1] == pytest.approx(399 * PERIOD)


def test_the_page_holds_the_published_figures():
    docs = Path(__file__).resolve().parents[3] / "docs"
    board = json.loads((docs / "blind" / "simulator_faults.json").read_text())
    page = " ".join((docs / "simulator_faults.md").read_text().split())
    for key in ("named_first", "false_alarm"):
        low, high = board[key]["interval"]
        assert f"{board[key]['hits']} of {board[key]['of']} ({low:.2f} to {high:.2f})" in page
    assert f"{board['command']} -o study" in page
    assert set(board["by_fault"]) == set(INJECTED)
    listed = {name for name in page.split("`") if name in {fault.name for fault in FAULTS}}
    assert listed == {fault.name for fault in FAULTS}
