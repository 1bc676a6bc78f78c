"""The study of imperfect logs, from making to page, with robots and answers that cost nothing."""

import json
import subprocess
import sys

import numpy as np
import pytest

from clie_blocks.analysis.blind.command import main
from clie_blocks.analysis.blind.imperfect import runs, trials
from clie_blocks.analysis.blind.imperfect.damages import DAMAGES, HARMLESS
from clie_blocks.analysis.blind.imperfect.export import DoesNotApplyError, Export
from clie_blocks.analysis.blind.population.standard import plan
from clie_blocks.analysis.blind.protocol import seal, study
from clie_blocks.analysis.blind.report import imperfect as page
from clie_blocks.analysis.blind.scoring import timings
from clie_blocks.analysis.blind.scoring.imperfect import figures
from clie_blocks.errors import ClieError
from clie_blocks.output import to_json

ROBOT = """joints = 1
[motor]
gear_ratio = [{gear}]
inertia_kgm2 = [0.02]
viscous_friction_nms = [0.04]
peak_torque_nm = [20.0]
[controller]
Kp = [10.0]
Kd = [5.0]
[encoder]
resolution_rad = 4e-05
"""
NAMED = {"effects": [{"effect": "none", "joint": None, "probability": 0.98}], "set_90": ["none"],
         "unexplained": False, "verdict": "none", "seconds": 3.0}


def write_robot(folder, gear=100.0):
    """One short log of a robot of one joint."""
    time = 1e-3 * np.arange(300)
    table = {"time": time, "q1": np.sin(9 * time), "u1": np.cos(9 * time),
             "qd1": np.cos(7 * time), "pe1": np.sin(5 * time)}
    Export(ROBOT.format(gear=gear), {"log-1.csv": table}).write(folder)


@pytest.fixture
def twins(tmp_path):
    """Folders of sixty robots."""
    folders = [tmp_path / "twins" / f"trial-{k:03d}" for k in range(60)]
    for k, folder in enumerate(folders):
        write_robot(folder, 50.0 + k)
    return folders


@pytest.fixture
def free_robots(monkeypatch):
    """Robots that cost nothing, and the command that answers at once; counts its calls."""
    label = {"kind": "none", "labels": ["none"], "effects": [], "ratio": 1.0,
             "robot": "pendulum of 1"}
    calls = []

    def without_robot(seed, index, factor):
        raise DoesNotApplyError("these robots are files alone")

    def make(folder, count, seed, jobs, population):
        for index in range(count):
            name = f"trial-{index:03d}"
            write_robot(folder / study.TRIALS / name, 50.0 + index)
            (folder / study.OPEN).mkdir(exist_ok=True)
            yield name, label

    def answer(trial):
        calls.append(trial)
        return dict(NAMED)

    monkeypatch.setattr(study, "_make_in_parallel", make)
    monkeypatch.setattr(runs, "_answer", answer)
    monkeypatch.setattr(trials, "_logged_with_noise", without_robot)
    return calls


def test_a_third_is_sound_and_the_damages_come_in_turn(twins, tmp_path):
    labels = trials.damage_all(twins, tmp_path / "out", 3)
    names = [label["damage"] for label in labels.values()]
    assert names.count(trials.SOUND) == 20
    assert all(names[k:k + 3].count(trials.SOUND) == 1 for k in range(0, 60, 3))
    counts = {name: names.count(name) for name in DAMAGES}
    assert max(counts.values()) == 2
    assert {name for name, count in counts.items() if count == 2} <= {
        name for name, one in DAMAGES.items() if one.kind == HARMLESS}
    assert counts["commands_swapped"] == counts["joint_order"] == counts["wrong_com"] == 0
    assert trials.damage_all(twins, tmp_path / "again", 3) == labels


def test_sound_copies_equal_their_twins_and_no_other_does(twins, tmp_path):
    labels = trials.damage_all(twins, tmp_path / "out", 3)
    for twin in twins:
        same = seal.folder_digest(twin) == seal.folder_digest(tmp_path / "out" / twin.name)
        assert same == (labels[twin.name]["damage"] == trials.SOUND)


@pytest.mark.slow
def test_noise_in_the_encoders_goes_round_the_loop():
    once, louder = (trials._logged_with_noise(9007, 1, factor) for factor in (1.0, 20.0))
    assert once.robot == louder.robot

    def roughness(export, name):
        return np.std(np.diff(export.logs["log-1.csv.gz"][name], 3))

    assert roughness(louder, "q1") / roughness(once, "q1") == pytest.approx(20, rel=0.1)
    assert roughness(louder, "u1") > 5 * roughness(once, "u1")


def test_a_quarter_of_the_robots_has_no_effect(monkeypatch):
    drawn = []
    monkeypatch.setattr(trials, "draw_trial",
                        lambda rng, index, *how, noise_factor: drawn.append(how))
    for index in range(40):
        trials._draw(None, 5, index)
    assert [how[0] for how in drawn[3::4]] == ["none"] * 10
    rest = [how for k, how in enumerate(drawn) if k % 4 != 3]
    assert rest == [plan(5, k) for k in range(30)]


def test_the_command_makes_seals_answers_and_scores(free_robots, tmp_path, capsys):
    command = ["--imperfect", "--trials", "9", "--seed", "4", "-o", str(tmp_path), "--json"]
    assert main(command) in (0, 1)
    board = json.loads(capsys.readouterr().out)
    assert board["trials"] == 9 and board["by_damage"]["none"]["of"] == 3
    assert board["command"] == "clie blind --imperfect --trials 9 --seed 4"
    assert board["wrong_name"]["hits"] == board["false_alarm"]["hits"] == 0
    for folder in (tmp_path, tmp_path / trials.UNDAMAGED):
        events = [line["event"] for line in seal.read_log(folder)]
        assert events == ["made", "sealed", "diagnosed", "unsealed"]
    assert {"imperfect.html", "imperfect.md", "imperfect.json", "labels.sealed"} <= {
        path.name for path in tmp_path.iterdir()}
    assert len(free_robots) == 15  # each twin once, and each damaged copy


def test_a_later_run_reads_what_is_there_and_writes_the_same_pages(free_robots, tmp_path):
    command = ["--imperfect", "--trials", "6", "--seed", "4", "-o", str(tmp_path)]
    main(command)
    pages = {path.name: path.read_bytes() for path in tmp_path.glob("imperfect.*")}
    count = len(free_robots)
    main(command)
    assert len(free_robots) == count
    assert {path.name: path.read_bytes() for path in tmp_path.glob("imperfect.*")} == pages
    (tmp_path / "imperfect.md").unlink()
    assert page.main([str(tmp_path)]) == 0
    assert {path.name: path.read_bytes() for path in tmp_path.glob("imperfect.*")} == pages


def test_the_figures_follow_from_the_rows_on_disk(free_robots, tmp_path):
    main(["--imperfect", "--trials", "6", "--seed", "4", "-o", str(tmp_path)])
    board = json.loads((tmp_path / "imperfect.json").read_text())
    again = json.loads(to_json(figures(board["rows"])))
    assert again == {key: board[key] for key in again} and again["of"] == 6


def test_seconds_are_kept_apart_from_answers_and_pages(free_robots, tmp_path):
    main(["--imperfect", "--trials", "3", "--seed", "4", "-o", str(tmp_path)])
    seconds = json.loads((tmp_path / timings.FILE).read_text())["seconds"]
    assert set(seconds) == {f"trial-{k:03d}" for k in range(3)} and min(seconds.values()) >= 0
    assert "seconds" not in (tmp_path / study.DIAGNOSES).read_text()
    assert "seconds" not in (tmp_path / "imperfect.json").read_text()


def test_changed_trials_are_refused(free_robots, tmp_path):
    command = ["--imperfect", "--trials", "3", "--seed", "4", "-o", str(tmp_path)]
    main(command)
    (tmp_path / study.TRIALS / "trial-001" / "robot.toml").write_text("joints = 1\n")
    with pytest.raises(ClieError, match="changed since they were made"):
        main(command)


@pytest.mark.parametrize("script, answer", [
    ("print('{\"verdict\": \"none\"}')", {"verdict": "none"}),
    ("import sys; print('error: q is in degrees', file=sys.stderr); sys.exit(3)",
     {"error": "error: q is in degrees", "exit_code": 3}),
    ("raise ValueError('lost')", {"error": "ValueError: lost", "exit_code": 1}),
    ("import os; os.abort()", {"error": "nothing was printed", "exit_code": -6}),
    ("import time; time.sleep(9)", {"error": "no answer in 0.5 s", "exit_code": 124})])
def test_a_process_ends_as_a_user_would_see_it(monkeypatch, tmp_path, script, answer):
    monkeypatch.setattr(runs, "COMMAND", (sys.executable, "-c", script))
    monkeypatch.setattr(runs, "LIMIT", 0.5 if "sleep" in script else 60.0)
    write_robot(tmp_path / "trial")
    told = runs.run(tmp_path / "trial", tmp_path / "kept")
    assert {key: told[key] for key in answer} == answer and told["seconds"] > 0
    monkeypatch.setattr(subprocess, "run", None)
    assert runs.run(tmp_path / "trial", tmp_path / "kept") == told


def test_answers_do_not_show_where_the_study_lies(monkeypatch, tmp_path):
    script = "import sys; print(f'error: {sys.argv[1]}/log-1.csv: no', file=sys.stderr); exit(3)"
    monkeypatch.setattr(runs, "COMMAND", (sys.executable, "-c", script))
    write_robot(tmp_path / "trial")
    assert runs.run(tmp_path / "trial", tmp_path)["error"] == "error: log-1.csv: no"


@pytest.mark.slow
@pytest.mark.timeout(1500)  # two processes of its own beside those of the other tests
def test_a_small_study_of_imperfect_logs_holds(tmp_path):
    """Four fixed trials, damaged and not; what may be lost before somebody looks."""
    main(["--imperfect", "--trials", "4", "--seed", "9012", "--jobs", "2", "-o", str(tmp_path)])
    board = json.loads((tmp_path / "imperfect.json").read_text())
    assert board["broken"]["hits"] == 0
    assert board["wrong_name"]["hits"] <= 1
    assert board["false_alarm"]["of"] >= 1 and board["false_alarm"]["hits"] == 0
    assert board["named"]["rate"] is None or board["named"]["rate"] >= 0.5
