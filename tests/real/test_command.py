"""`clie real` on a machine of the user's own, and on public ones."""

import json
import shutil

import pytest

from clie_blocks.analysis.cli import main

TRUTH = """machine = "bench arm"
source = "our laboratory"

[[run]]
name = "after the repair"
logs = ["log-1", "log-2"]
cause = ["coulomb", "asymmetric_coulomb"]
absent = ["backlash"]
joint = ["elbow"]
why = "weighed with a spring balance"
"""


@pytest.fixture
def bench(tmp_path):
    """A folder of machines with one that is made as the page on real machines says."""
    arm = tmp_path / "machines" / "arm"
    assert main(["example", "friction-arm", str(arm)]) == 0
    (arm / "truth.toml").write_text(TRUTH)
    return tmp_path / "machines"


def test_a_machine_of_the_users_own_is_scored(bench, tmp_path, capsys):
    capsys.readouterr()
    assert main(["real", str(bench), "-o", str(tmp_path / "out"), "--json"]) == 0
    board = json.loads(capsys.readouterr().out)
    (row,) = board["runs"]
    assert row["first"] and row["at_joint"] and row["in_set"] and not row["false"]
    assert board["first"] == {"right": 1, "of": 1} and board["false"] == 0
    page = (tmp_path / "out" / "real.html").read_text()
    assert "bench arm" in page and "weighed with a spring balance" in page
    assert json.loads((tmp_path / "out" / "real.json").read_text()) == board


def test_a_run_that_cannot_be_read_says_why_and_the_others_go_on(bench, capsys):
    truth = bench / "arm" / "truth.toml"
    truth.write_text(truth.read_text().replace("log-2", "log-9"))
    capsys.readouterr()
    assert main(["real", str(bench)]) == 0
    said = capsys.readouterr().out
    assert "refused  bench arm, after the repair" in said and "no log of" in said


def test_a_false_attribution_is_the_exit_code(bench, capsys):
    truth = bench / "arm" / "truth.toml"
    truth.write_text(truth.read_text().replace('["elbow"]', "[]").replace(
        'absent = ["backlash"]', 'control = ["elbow"]'))
    capsys.readouterr()
    assert main(["real", str(bench)]) == 1
    said = capsys.readouterr().out
    assert said.startswith("false  bench arm, after the repair: coulomb at elbow")
    assert "effects attributed that are not there: 0" not in said


def test_joints_are_chosen_from_a_data_set_alone(bench, capsys):
    truth = bench / "arm" / "truth.toml"
    truth.write_text(truth.read_text() + 'joints = ["elbow"]\n')
    capsys.readouterr()
    assert main(["real", str(bench)]) == 0
    assert "name the columns of these logs" in " ".join(capsys.readouterr().out.split())


def test_only_names_runs(bench, capsys):
    assert main(["real", str(bench), "--only", "go2"]) == 2
    assert "no run has this" in capsys.readouterr().err


@pytest.mark.slow
def test_public_machines_are_measured(shared, tmp_path, capsys):
    shutil.copytree(shared / "data" / "cycloidal", tmp_path / "cycloidal")
    assert main(["real", str(tmp_path), "--only", "350 g", "locked", "--json"]) == 0
    rows = {row["run"]: row for row in json.loads(capsys.readouterr().out)["runs"]}
    assert rows["350 g against the bar"]["first"]
    sizes = {one["parameter"]: one["right"] for row in rows.values() for one in row["sizes"]}
    assert sizes.pop("distance") is False  # 0.31 m where 0.42 m are known
    assert set(sizes) == {"mass", "moment", "lost_motion", "stiffness"} and all(sizes.values())
