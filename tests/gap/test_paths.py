"""What a user may name: every mixture of paths and options is understood or refused in words."""

import itertools
import shlex

import numpy as np
import pytest

from clie_blocks.analysis.gap import batch, tasks
from clie_blocks.analysis.gap.command import _parser, main
from clie_blocks.analysis.records import check_report, write_record
from clie_blocks.analysis.records.model import Record
from clie_blocks.errors import ClieError, NotIdentifiableError, RecordError
from clie_blocks.output import guarded

ROBOT = "joints = 1\n[controller]\nKp = 2\nKd = 1\n"


def write_log(path, value):
    time = 0.001 * np.arange(5)
    write_record(Record(time, np.full((5, 1), value), u=np.zeros((5, 1))), path)


def robot_folder(folder, *names):
    folder.mkdir(parents=True)
    (folder / "robot.toml").write_text(ROBOT)
    for k, name in enumerate(names):
        write_log(folder / name, k)
    return folder


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """Folder with one of everything that a user may name."""
    place = tmp_path_factory.mktemp("things")
    robot_folder(place / "arm", "log-1.csv", "log-2.csv", "log-3.csv")
    robot_folder(place / "set" / "one", "a.csv")
    robot_folder(place / "set" / "arm", "a.csv", "b.csv")
    robot_folder(place / "Roboter für alle", "Fahrt 1.csv", "Fahrt 2.csv")
    robot_folder(place / "no logs")
    (place / "empty").mkdir()
    (place / "no robot").mkdir()
    write_log(place / "no robot" / "run.csv", 1)
    write_log(place / "lone.csv", 1)
    (place / "empty.csv").write_text("")
    (place / "binary.csv").write_bytes(bytes(range(256)) * 9)
    (place / "words.txt").write_text("nothing of interest\n")
    (place / "bag").mkdir()
    (place / "bag" / "metadata.yaml").write_text("{")
    (place / "data set").mkdir()
    (place / "data set" / "runs.parquet").write_bytes(b"PAR1")
    (place / "data set" / "runs.json").write_text("{}")
    (place / "broken.toml").write_text("joints =\n")
    return place


PATHS = ("arm", "arm/log-1.csv", "arm/log-2.csv", "arm/robot.toml", "set", "set/arm", "set/one",
         "Roboter für alle", "Roboter für alle/Fahrt 1.csv", "no logs", "empty", "no robot",
         "no robot/run.csv", "lone.csv", "empty.csv", "binary.csv", "words.txt", "bag",
         "data set", "missing", "")
OPTIONS = ((), ("--robot", "arm/robot.toml"), ("--robot", "missing.toml"), ("--robot", "arm"),
           ("--robot", "broken.toml"), ("--holdout", "log-2"), ("--holdout", "nothing"),
           ("--holdout", "2"), ("--simulated", "lone.csv"),
           ("--simulated", "missing", "empty.csv"), ("--map", "q=foo"), ("--time-unit", "ms"),
           ("--topic", "/x"), ("--json",), ("--effects", "nothing"), ("--jobs", "0"))
QUICK = ("arm", "set", "lone.csv", "missing")


def before_diagnosing(task, options):
    """What comes before a diagnosis: logs are read, and the hold-out log is found."""
    robot, records = batch.read_task(task, options.reading)
    batch._held_out(options.holdout, records)
    raise NotIdentifiableError(f"stopped: {robot.n} {len(records)}")


@pytest.mark.parametrize("first", [
    first if first in QUICK else pytest.param(first, marks=pytest.mark.slow) for first in PATHS])
def test_every_mixture_is_answered_in_words(place, first, monkeypatch, capsys):
    monkeypatch.chdir(place)
    monkeypatch.setenv("CLIE_TRACEBACK", "1")
    monkeypatch.setattr(batch, "_diagnose", before_diagnosing)
    mixtures = [([first], options) for options in OPTIONS]
    mixtures += [([first, second], ()) for second in PATHS if second != "bag" or first == "bag"]
    mixtures += [([first, "arm", "lone.csv"], OPTIONS[1])]
    for paths, options in mixtures:
        try:
            code = guarded(main, [*paths, *options])
        except SystemExit as stopped:  # argparse, at --jobs 0
            code = stopped.code
        said = capsys.readouterr().err
        assert code in (2, 3, 4) and "error: " in said, (paths, options)
        assert "Traceback" not in said
        assert code != 4 or "stopped: " in said, (paths, options, said)


@pytest.mark.parametrize("paths, options, robots, logs", [
    (["arm"], [], 1, [3]), (["set"], [], 2, [2, 1]), (["set/arm", "arm"], [], 2, [3, 2]),
    (["arm/log-1.csv", "arm/log-3.csv"], [], 1, [2]), (["lone.csv"], ["arm/robot.toml"], 1, [1]),
    (["lone.csv", "arm/log-1.csv"], ["arm/robot.toml"], 1, [2]),
    (["no robot"], ["arm/robot.toml"], 1, [1]),
    (["arm", "set/one"], ["set/one/robot.toml"], 2, [3, 1]),
    (["Roboter für alle"], [], 1, [2])])
def test_what_is_diagnosed_together(place, monkeypatch, paths, options, robots, logs):
    monkeypatch.chdir(place)
    found = tasks.find_tasks(paths, *options)
    assert len({task.name for task in found}) == len(found) == robots
    read = [len(batch.read_task(task, batch.Options().reading)[1]) for task in found]
    assert sorted(read) == sorted(logs)


def test_equal_names_are_told_apart(place):
    found = tasks.find_tasks([place / "arm", place / "set" / "arm", place / "set" / "one"])
    assert [task.name for task in found] == [f"{place.name}-arm", "set-arm", "one"]


def test_the_folder_one_is_in_has_a_name(place, monkeypatch):
    monkeypatch.chdir(place / "arm")
    assert [task.name for task in tasks.find_tasks(["."])] == ["arm"]


@pytest.mark.parametrize("paths, options, error, message", [
    (["arm", "arm/log-1.csv"], (), ClieError, "is a log and arm a folder"),
    (["arm/log-1.csv", "arm/./log-1.csv"], (), ClieError, "named twice"),
    (["set", "set"], (), ClieError, "named twice"),
    (["arm/log-1.csv", "set/one/a.csv"], (), ClieError, "in 2 folders.*--robot arm/robot.toml"),
    (["set"], ["arm/robot.toml"], ClieError, "robot files of 2 folders"),
    (["no robot"], (), RecordError, "has logs, as run.csv, but no robot.toml"),
    (["no logs"], (), RecordError, "holds robot.toml, but no log"),
    (["empty"], (), RecordError, "is empty, but no log"),
    (["missing"], (), RecordError, "missing does not exist"),
    (["arm/robot.toml"], (), RecordError, "describes a robot and is no log"),
    (["/dev/null"], (), RecordError, "neither a file nor a folder")])
def test_what_cannot_be_meant(place, monkeypatch, paths, options, error, message):
    monkeypatch.chdir(place)
    with pytest.raises(error, match=message):
        tasks.find_tasks(paths, *options)


@pytest.mark.parametrize("first, second", list(itertools.permutations(
    ["arm", "arm/log-1.csv", "Roboter für alle", "Roboter für alle/Fahrt 1.csv"], 2)))
def test_the_command_that_a_refusal_names_is_understood(place, monkeypatch, first, second):
    monkeypatch.chdir(place)
    try:
        tasks.find_tasks([first, second])
    except ClieError as refused:
        text = str(refused)
        commands = [part.partition("clie diagnose ")[2] for part in
                    text.replace("; ", ", or ").split(", or ") if "clie diagnose " in part]
        assert commands or "--robot" in text
        for command in commands:
            options = _parser().parse_args(shlex.split(command))
            assert len(tasks.find_tasks(options.paths, options.robot)) == 1


def test_a_log_is_held_out_by_name_beginning_or_number(place):
    records = batch.read_task(*[tasks.find_tasks([place / "arm"])[0], batch.Options().reading])[1]
    assert [batch._held_out(name, records) for name in
            ("log-2.csv", "log-2", "2", "arm/log-2.csv", None)] == [[1]] * 4 + [None]
    for wrong in ("log-9", "0", "4", ""):
        with pytest.raises(RecordError, match=r"no such log; .* 1 \(log-1.csv\), 2 \(log-2.csv\)"):
            batch._held_out(wrong, records)
    with pytest.raises(RecordError, match="it is the only log"):
        batch._held_out("1", records[:1])


def test_columns_that_are_named_reach_the_diagnosis(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(batch, "_diagnose", before_diagnosing)
    (tmp_path / "robot.toml").write_text(ROBOT)
    (tmp_path / "log.csv").write_text("stempel,winkel_1,u1\n" + "".join(
        f"{k},{k},0\n" for k in range(5)))
    options = ["--map", "time=stempel", "--map", "q=winkel_{k}", "--time-unit", "ms"]
    assert guarded(main, [str(tmp_path)]) == 3
    assert "as in --map time=" in capsys.readouterr().err
    assert guarded(main, [str(tmp_path), *options]) == 4
    assert "stopped: 1 1" in capsys.readouterr().err
    check_report.main([str(tmp_path / "log.csv"), *options])
    assert "5 samples, 0.004 s" in capsys.readouterr().out
