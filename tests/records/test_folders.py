"""The folder of a robot: any tables beside robot.toml are its logs; what is left out is said."""

import numpy as np
import pytest

from clie_blocks.analysis.records import read_records, read_trial
from clie_blocks.analysis.records import write_record as write
from clie_blocks.analysis.records.folder import contents
from clie_blocks.analysis.records.model import Record
from clie_blocks.errors import ClieError, RecordError


def log(value=1.0, samples=3):
    time = 0.001 * np.arange(samples)
    return Record(time, np.full((samples, 1), value), u=np.zeros((samples, 1)))


def fill(folder, *names, robot="joints = 1\n"):
    folder.mkdir(exist_ok=True)
    for k, name in enumerate(names):
        path = folder / name
        if name.endswith((".csv", ".csv.gz")):
            write(log(k), path)
        else:
            path.write_text("not a log\n")
    if robot is not None:
        (folder / "robot.toml").write_text(robot)
    return folder


@pytest.mark.parametrize("names, read, left_out", [
    (["log-2.csv", "log-10.csv.gz", "log-1.csv"], ["log-1.csv", "log-2.csv", "log-10.csv.gz"], []),
    (["run 10.csv", "run 9.csv", "Armübung.csv"], ["armübung.csv", "run 9.csv", "run 10.csv"], []),
    (["2024-08-07_a.csv", "2024-08-06_b.csv"], ["2024-08-06_b.csv", "2024-08-07_a.csv"], []),
    (["log-1.csv", "notes.csv"], ["log-1.csv"], ["notes.csv (not called log-N"]),
    (["a.csv", "a.next.csv", "sim-1.csv", "simulated.csv", "simple.csv"], ["a.csv", "simple.csv"],
     ["a.next.csv (set-points of a next run)", "sim-1.csv (of a simulator, by its name)",
      "simulated.csv (of a simulator"]),
    (["a.csv", "a.csv.gz"], ["a.csv"], ["a.csv.gz (the same log as a.csv"]),
    ([".hidden.csv", "a.csv", "a.html", "a.json", "a.xml", "README.md", "notes.txt", "plot.png"],
     ["a.csv"], []),
])
def test_which_files_are_logs(tmp_path, names, read, left_out):
    folder = fill(tmp_path / "Mein Roboter Ü", *names)
    found = contents(folder)
    assert [path.name.lower() for path in found.logs] == read
    assert len(found.left_out) == len(left_out)
    assert all(text in " ".join(found.left_out) for text in left_out)
    robot, records = read_trial(folder)
    assert [record.source.rpartition("/")[2].lower() for record in records] == read
    said = [note for record in records for note in record.decisions if "Not read: " in note]
    assert len(said) == (1 if left_out else 0)


def test_a_folder_without_a_robot_is_read_but_is_no_trial(tmp_path):
    folder = fill(tmp_path / "logs", "b.csv", "a.csv", robot=None)
    assert [record.q[0, 0] for record in read_records(folder)] == [1.0, 0.0]
    with pytest.raises(RecordError, match="robot.toml, with 'joints = 1' as its first line"):
        read_trial(folder)


@pytest.mark.parametrize("names, message", [
    ([], "is empty, but no log; put logs beside robot.toml, with one of the endings .csv"),
    (["notes.txt"], "holds notes.txt, but no log; put logs beside robot.toml"),
])
def test_a_folder_without_logs_says_what_it_holds(tmp_path, names, message):
    with pytest.raises(RecordError, match=message):
        read_records(fill(tmp_path / "logs", *names, robot=None))


def test_a_folder_of_folders_says_which_to_name(tmp_path):
    fill(tmp_path / "arm", "a.csv")
    with pytest.raises(RecordError, match=f"name one of its folders, as {tmp_path / 'arm'}"):
        read_records(tmp_path)


def test_a_robot_file_is_no_log(tmp_path):
    folder = fill(tmp_path / "arm", "a.csv")
    with pytest.raises(RecordError, match="describes a robot and is no log; name the log"):
        read_records(folder / "robot.toml")


def test_a_log_counts_once(tmp_path):
    from clie_blocks.analysis.records.read import read_logs

    folder = fill(tmp_path / "arm", "a.csv", "b.csv")
    assert len(read_logs([folder])) == 2
    for twice in ([folder, folder / "a.csv"], [folder / "b.csv", folder / "." / "b.csv"]):
        with pytest.raises(ClieError, match="is named twice"):
            read_logs(twice)


@pytest.mark.parametrize("options, message", [
    ({"columns": {"q": "u{k}"}}, "of the format double_pendulum.*leave out --map q="),
    ({"topic": "/joint_states"}, "topics are of ROS bags: leave out --topic"),
    ({"command_topic": "/commands"}, "leave out --command-topic")])
def test_what_would_have_no_effect_is_refused(tmp_path, options, message):
    (tmp_path / "sysid.parquet").write_bytes(b"PAR1")
    with pytest.raises(RecordError, match=message):
        read_records(tmp_path, **options)
