"""Files that are too large, unpack to too much, never end, or are no files at all."""

import gzip
import io
import os
import random
import struct
import time
import zipfile

import fuzzing
import numpy as np
import pytest

from clie_blocks.analysis import cli
from clie_blocks.analysis.records import read_record, read_robot
from clie_blocks.errors import RecordError


def npy(shape):
    """Head of an array of a shape, and eighty bytes of its values."""
    text = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".encode()
    text = text.ljust((10 + len(text)) // 64 * 64 + 64 - 11) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + bytes(80)


def archive(path, entries, packing=zipfile.ZIP_STORED):
    with zipfile.ZipFile(path, "w", packing) as file:
        for name, data in entries.items():
            file.writestr(name, data)


def refused(path, words):
    """The message, on one line, names the file; the command ends with 3."""
    with pytest.raises(RecordError, match=words) as caught:
        read_record(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)
    assert cli.main(["check", str(path)]) == 3


def test_a_pipe_and_a_device_are_not_waited_for(tmp_path, capsys):
    os.mkfifo(tmp_path / "log.csv")
    refused(tmp_path / "log.csv", "is a pipe or a device")
    (tmp_path / "other.csv").symlink_to("/dev/zero")
    refused(tmp_path / "other.csv", "is a pipe or a device")
    os.mkfifo(tmp_path / "robot.toml")
    with pytest.raises(RecordError, match=r"robot.toml is a pipe or a device"):
        read_robot(tmp_path / "robot.toml")
    assert "Traceback" not in capsys.readouterr().err


def test_links_and_names_that_lead_nowhere(tmp_path, capsys):
    (tmp_path / "loop").symlink_to("loop")
    refused(tmp_path / "loop", "cannot open")
    assert cli.main(["check", "a" * 300]) == 3
    assert cli.main(["check", str(tmp_path / "none" / "log.csv")]) == 3
    with pytest.raises(RecordError, match="cannot be the name of a file"):
        read_record("a\0b")
    assert "Traceback" not in capsys.readouterr().err


def test_an_array_that_claims_more_than_there_is(tmp_path):
    archive(tmp_path / "a.npz", {"time.npy": npy((10**12,)), "q.npy": npy((10**12,))})
    refused(tmp_path / "a.npz", "needs more memory|cannot be read as NPZ")


def test_an_archive_that_unpacks_to_far_more(tmp_path):
    buffer = io.BytesIO()
    np.save(buffer, np.zeros(13_000_000))
    archive(tmp_path / "a.npz", {"time.npy": buffer.getvalue()}, zipfile.ZIP_DEFLATED)
    refused(tmp_path / "a.npz", "unpacks to more than 300 times its size")


def test_a_bomb_is_found_before_it_is_parsed(tmp_path):
    text = b"time,q1\n" + b"0,0\n" * 26_000_000
    (tmp_path / "log.csv.gz").write_bytes(gzip.compress(text, 9))
    refused(tmp_path / "log.csv.gz", "unpacks to more than 300 times its size")


def test_a_table_that_unpacks_to_far_more(tmp_path):
    pa, pq = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    pq.write_table(pa.table({"time": np.zeros(7_000_000), "q1": np.zeros(7_000_000)}),
                   tmp_path / "log.parquet")
    refused(tmp_path / "log.parquet", "unpacks to more than 300 times its size")


def test_a_table_whose_statistics_are_damaged(tmp_path):
    pytest.importorskip("pyarrow")
    _, make = fuzzing.makers("parquet", tmp_path)  # asking ends the process
    (tmp_path / "log.parquet").write_bytes(make(random.Random("parquet 4040")))
    refused(tmp_path / "log.parquet", "cannot be read as Parquet|no column is recognised")


def test_a_number_of_many_digits_is_looked_at_once(tmp_path):
    (tmp_path / "log.csv").write_text("9" * 90_000 + "x,1\n")
    start = time.process_time()
    refused(tmp_path / "log.csv", "no column|no header|longer than")
    assert time.process_time() - start < 3  # every split of the digits took minutes


def test_a_hundred_thousand_columns(tmp_path):
    names = ",".join(f"q{k}" for k in range(1, 100_001))
    (tmp_path / "log.csv").write_text(f"time,{names}\n")
    refused(tmp_path / "log.csv", r"log.csv:1: the first line has more than 100000 characters")
    (tmp_path / "log.csv").write_text("t," + ",".join(map(str, range(12_000))) + "\n1,2\n")
    refused(tmp_path / "log.csv", "has 12001 columns")
    (tmp_path / "log.csv").write_text("time,q" + "1" * 2000 + "\n1,2\n")
    refused(tmp_path / "log.csv", "a column whose name is longer than 1000 characters")


@pytest.mark.parametrize("text, words", [
    ("joints = " + "9" * 5000, "integer of more than 64 bits"),
    ("joints = 0x" + "f" * 5000, "integer of more than 64 bits"),
    ("joints = 2\n[motor]\ngear_ratio = [1, " + "7" * 30 + "]", "integer of more than 64 bits"),
    ("joints = 2\nx = " + "[" * 5000, "nested more than 8 deep"),
    ("joints = 2\nx = " + "[" * 12 + "]" * 12, "nested more than 8 deep"),
    ("a" + ".a" * 50_000 + " = 1", "nested more than 8 deep"),
    ('"1"' + '."1"' * 50_000 + " = 1", "nested more than 8 deep"),
    ("1" + ".1" * 50_000 + " = 1", "nested more than 8 deep"),
    ("joints = 2\nname = '" + "x" * 5000 + "'", "more than 100 of them"),
    ("joints = 1\njoint_names = [\"a\\u001b[2J\"]", r"joint name 'a\\x1b\[2J' has characters"),
    ("joints = 1\nname = \"a\\nb\"", "the name .* has characters that cannot be printed"),
    ("joints = 2\n" + "".join(f"k{k} = 1\n" for k in range(2_000)), "k0 is not a key"),
], ids=range(12))
def test_robot_files_that_a_parser_chokes_on(text, words, tmp_path):
    (tmp_path / "robot.toml").write_text(text)
    with pytest.raises(RecordError, match=words) as caught:
        read_robot(tmp_path / "robot.toml")
    assert "robot.toml" in str(caught.value) and len(str(caught.value)) < 2100


def test_the_line_of_a_fault_in_a_robot_file(tmp_path):
    (tmp_path / "robot.toml").write_text(
        'joints = 1\n\n[experiment."log-1"]\nscale = 1\n[motor]\n"inertia_kgm2" = -1\n')
    with pytest.raises(RecordError, match=r"toml:6: \[motor\] inertia_kgm2 must be at least"):
        read_robot(tmp_path / "robot.toml")
