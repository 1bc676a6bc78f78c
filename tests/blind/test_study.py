"""A study from making to scoreboard."""

import json

import pytest

from clie_blocks.analysis.blind.command import main
from clie_blocks.analysis.blind.comparison import methods, rerun
from clie_blocks.analysis.blind.comparison.ablations import ABLATIONS
from clie_blocks.analysis.blind.comparison.baselines import BASELINES
from clie_blocks.analysis.blind.protocol import seal, study
from clie_blocks.errors import ClieError

LABEL = {"kind": "none", "labels": ["none"], "effects": [], "severity": None, "ratio": 1.0,
         "robot": "arm of 2", "excitations": ["chirp", "steps", "other"],
         "gap": {"nominal": 1e-4, "true_model": 1e-4, "achievable_reduction": 0.0}}
ANSWER = {"effects": [{"effect": "none", "joint": None, "probability": 0.98}],
          "set_90": ["none"], "unexplained": False, "verdict": "none", "gap_before": 1e-4,
          "gap_after": 1e-4, "seconds": 1.0}


@pytest.fixture
def quick(monkeypatch):
    """Trials and diagnoses that cost nothing."""
    def made(folder, seed, index):
        (folder / study.TRIALS / f"trial-{index:03d}").mkdir(parents=True)
        (folder / study.TRIALS / f"trial-{index:03d}" / "robot.toml").write_text("joints = 1\n")
        (folder / study.OPEN).mkdir(exist_ok=True)
        return f"trial-{index:03d}", LABEL

    def spread(folder, trials, seed, jobs, family):
        return [made(folder, seed, index) for index in range(trials)]

    def diagnosed(found, **options):
        return [(trial.name, ANSWER) for trial in found]

    monkeypatch.setattr(study, "_spread", spread)
    monkeypatch.setattr("clie_blocks.analysis.gap.batch.diagnose_all", diagnosed)


def test_the_log_proves_the_order(quick, tmp_path, capsys):
    assert main(["--trials", "3", "--seed", "4", "-o", str(tmp_path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["false_alarm"] == {"rate": 0.0, "hits": 0, "of": 3,
                                    "interval": [0.0, pytest.approx(0.5615, abs=1e-3)]}
    events = [line["event"] for line in seal.verified(tmp_path)]
    assert events == ["made", "sealed", "diagnosed", "unsealed"]
    assert not (tmp_path / study.OPEN).exists()
    assert {"scoreboard.html", "scoreboard.json", "labels.json", "diagnoses.json",
            "labels.sealed", "run.log"} <= {path.name for path in tmp_path.iterdir()}


def test_a_folder_keeps_its_study(quick, tmp_path):
    study.make(tmp_path, 2, 4)
    study.make(tmp_path, 2, 4)
    with pytest.raises(ClieError, match="holds a study of 2 trials with seed 4"):
        study.make(tmp_path, 2, 5)


def test_trials_that_were_changed_after_sealing_are_refused(quick, tmp_path):
    study.make(tmp_path, 2, 4)
    (tmp_path / study.TRIALS / "trial-001" / "robot.toml").write_text("joints = 2\n")
    with pytest.raises(ClieError, match="changed since they were made"):
        study.diagnose(tmp_path)


def test_several_seeds_make_one_study(quick, tmp_path, capsys):
    command = ["--trials", "2", "--seed", "4", "5", "-o", str(tmp_path)]
    assert main([*command[:3], "4", "-o", str(tmp_path / "seed-4")]) == 0
    assert main(command) == 0
    found = json.loads((tmp_path / "scoreboard.json").read_text())
    assert found["trials"] == 4 and found["seeds"] == [4, 5]
    assert found["command"] == "clie blind --trials 2 --seed 4 5"
    assert sorted(seal.unseal(tmp_path / "seed-5")) == ["trial-000", "trial-001"]


def test_methods_are_compared_on_the_same_trials(quick, tmp_path, monkeypatch):
    monkeypatch.setattr(rerun, "_answer", lambda method, path: ANSWER | {"seconds": 0.5})
    monkeypatch.setattr(rerun, "_spread", lambda tasks, jobs: map(rerun.answered, tasks))
    main(["--trials", "3", "--seed", "4", "--baselines", "--ablations", "--subset", "2",
          "-o", str(tmp_path)])
    rows = json.loads((tmp_path / "scoreboard.json").read_text())["compared"]
    assert [row["method"] for row in rows] == [methods.FULL, *BASELINES, *ABLATIONS]
    assert all(row["false_alarm"]["of"] == row["trials"] == 2 for row in rows)
    assert [row["seconds"]["median"] for row in rows] == [1.0] + [0.5] * 8
    assert [row["paired"]["lost"]["value"] for row in rows[1:]] == [0.0] * 8
    kept = tmp_path / rerun.PARTS / "no-polish"
    assert [path.name for path in sorted(kept.iterdir())] == ["trial-000.json", "trial-002.json"]
    assert "other methods reach" in (tmp_path / "scoreboard.html").read_text()


def test_families_of_sound_robots_are_sealed_and_told(quick, tmp_path, monkeypatch, capsys):
    command = ["--trials", "2", "--seed", "4", "--controllers", "3", "--spatial", "2",
               "-o", str(tmp_path)]
    monkeypatch.setitem(LABEL, "wrong", "stated x 1.1")
    monkeypatch.setitem(LABEL, "present", [])
    assert main(command) == 0
    found = json.loads((tmp_path / "scoreboard.json").read_text())
    assert found["command"] == "clie blind --trials 2 --seed 4 --controllers 3 --spatial 2"
    assert found["controllers"]["trials"] == 3 and found["spatial"]["missed"]["hits"] == 2
    assert "controllers described wrong, a robot effect accused" in capsys.readouterr().out
    for family in ("controllers", "spatial"):
        events = [line["event"] for line in seal.verified(tmp_path / family)]
        assert events == ["made", "sealed", "diagnosed", "unsealed"]


@pytest.mark.slow
def test_a_small_study_holds_its_accuracy(tmp_path):
    """Twelve fixed trials; tolerances are what may be lost before somebody looks."""
    main(["--trials", "12", "--seed", "20", "--jobs", "2", "-o", str(tmp_path)])
    found = json.loads((tmp_path / "scoreboard.json").read_text())
    assert found["failed"] == []
    assert found["all_decisions"]["rate"] >= 0.7
    assert found["false_alarm"]["of"] == 1 and found["false_alarm"]["rate"] == 0.0
    assert found["unknown_called_none"]["rate"] == 0.0
    assert found["set_coverage"]["rate"] >= 0.7
    assert found["against_true_model"]["median"] <= 1.1
