"""CSV and its relatives: what engineers' exports look like, and what is wrong with some."""

import gzip
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from clie_blocks.analysis.records import read_record
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.readers import bombs, csv_text
from clie_blocks.analysis.records.write import write_record
from clie_blocks.errors import RecordError

TABLE = np.array([[0.0, 0.5, -1.25], [0.001, 0.625, 1e-3], [0.002, -0.75, 2.0]])


def log(tmp_path, text, name="log.csv"):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def same(record, rows=TABLE):
    np.testing.assert_array_equal(np.column_stack([record.time, record.q, record.u]), rows)


PLAIN = "time,q1,u1\n0,0.5,-1.25\n0.001,0.625,1e-3\n0.002,-0.75,2\n"


@pytest.mark.parametrize("text, words", [
    (PLAIN, None),
    ("\ufeff" + PLAIN, None),
    (PLAIN.replace("\n", "\r\n"), None),
    (PLAIN.replace("\n", "\r"), None),
    (PLAIN.rstrip("\n"), None),
    (PLAIN.replace("\n", "\n\n"), None),
    (PLAIN.replace(",", ", "), None),
    (PLAIN.replace(",", "\t"), "tab"),
    (PLAIN.replace(",", ";"), "semicolon"),
    (PLAIN.replace(",", "|"), "bar"),
    (PLAIN.replace(",", "   "), "white space"),
    (PLAIN.replace(",", ";").replace(".", ","), "decimal comma"),
    ("sep=;\n" + PLAIN.replace(",", ";"), "semicolon"),
    ("# robot: arm\n% rate 1000\n" + PLAIN, None),
    ("# " + PLAIN, "comment line"),
    (PLAIN.replace("0.001,", "# pause\n0.001,"), None),
    (PLAIN.replace("time,q1,u1", '"time","q1","u1"'), None),
    (PLAIN.replace("0.625", '"0.625"'), None),
    (PLAIN.replace("\n", ",\n"), None),
    ('time,note,q1,u1\n0,a,0.5,-1.25\n0.001,"b,c",0.625,1e-3\n0.002,d,-0.75,2\n', None),
    ('time,q,u\n0,"[0.5]","[-1.25]"\n0.001,"[0.625]","[1e-3]"\n0.002,"[-0.75]","[2]"\n', "lists"),
], ids=range(21))
def test_dialects(tmp_path, text, words):
    record = read_record(log(tmp_path, text))
    same(record)
    if words is None:
        assert not any("separated" in sentence for sentence in record.decisions)
    else:
        assert any(words in sentence for sentence in record.decisions)


def test_gzip_is_recognised_by_content(tmp_path):
    same(read_record(log(tmp_path, gzip.compress(PLAIN.encode()), "log.csv")))


def test_a_truncated_gzip_is_an_error(tmp_path):
    packed = gzip.compress(("time,q1,u1\n" + "0,1,2\n" * 100_000).encode())
    with pytest.raises(RecordError, match="cannot be unpacked"):
        read_record(log(tmp_path, packed[:-20], "log.csv.gz"))


def test_a_gzip_bomb_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr(bombs, "HARMLESS", 1_000_000)
    path = tmp_path / "log.csv.gz"
    with gzip.open(path, "wb", 9) as file:
        file.write(b"time,q1\n")
        file.write(b"0,0\n" * 2_000_000)
    assert path.stat().st_size < 20_000
    with pytest.raises(RecordError, match="300 times its size"):
        read_record(path)


def test_units_in_a_line_of_their_own(tmp_path):
    record = read_record(log(tmp_path, "time,q1,u1\nms,deg,V\n0,180,1\n1,90,2\n"))
    np.testing.assert_allclose(record.time, [0, 1e-3])
    np.testing.assert_allclose(record.q[:, 0], [np.pi, np.pi / 2])
    assert record.units["u"] == ("V",)


def test_units_in_the_header(tmp_path):
    record = read_record(log(tmp_path, "t[us],q_elbow[deg],u_elbow(mNm),dq_elbow[rpm]\n"
                                       "0,180,1000,60\n1000,90,500,30\n"))
    np.testing.assert_allclose(record.time, [0, 1e-3])
    np.testing.assert_allclose(record.q[:, 0], [np.pi, np.pi / 2])
    np.testing.assert_allclose(record.u[:, 0], [1.0, 0.5])
    np.testing.assert_allclose(record.dq[:, 0], [2 * np.pi, np.pi])
    assert record.joints == ("elbow",)
    assert "Converted q from deg to rad." in record.decisions


def test_stamps_that_are_dates(tmp_path):
    rows = [f"2026-01-15T10:28:{k / 100 + 9.95:09.6f}Z,{k}" for k in range(20)]
    record = read_record(log(tmp_path, "\n".join(["time,q1", *rows])))
    np.testing.assert_allclose(record.time, np.arange(20) / 100, atol=1e-6)
    assert any("counts from 1970" in sentence for sentence in record.decisions)


def test_empty_cells_anywhere(tmp_path):
    record = read_record(log(tmp_path, "time,q1,u1,qd1,tau1\n0,,,,\n0.1,1,,,4\n0.2,1,2,3,\n"))
    np.testing.assert_array_equal(record.q[:, 0], [np.nan, 1, 1])
    np.testing.assert_array_equal(record.tau[:, 0], [np.nan, 4, np.nan])
    assert record.valid.tolist() == [False, False, True]


@pytest.mark.parametrize("cell", ["", "NaN", "nan", "NA", "null", "None", "inf", "-"])
def test_missing_values_are_masked_not_filled(tmp_path, cell):
    record = read_record(log(tmp_path, PLAIN.replace("0.625", cell)))
    assert record.valid.tolist() == [True, False, True]
    assert not np.isfinite(record.q[1, 0])
    assert any("masked" in sentence for sentence in record.decisions)


def test_rows_without_a_stamp_are_dropped_and_counted(tmp_path):
    record = read_record(log(tmp_path, PLAIN.replace("0.001,", ",")))
    assert len(record) == 2
    assert "Dropped 1 rows without a time stamp." in record.decisions


@pytest.mark.parametrize("old, new, message", [
    ("0.625", "oops", r"log.csv:3:2: 'oops' in column 'q1' is not a number"),
    ("0.625", "1_0", r"log.csv:3:2"),
    ("0.625", "0.6.2", r"log.csv:3:2"),
    ("0.625", "0.625,7", r"log.csv:3: this line has 4 values, the header has 3 columns"),
    ("0.625,", "", r"log.csv:3: this line has 2 values"),
    ("time,q1,u1", "time,q1,q1", "two columns are called 'q1'"),
    ("time,q1,u1", "time,foo,u1", r"no column is recognised as q.*as in --map q=foo"),
    ("time,q1,u1", "when,q1,u1", r"no column is recognised as time"),
    ("time,q1,u1\n", "", "has no header"),
    ("q1", "q1[furlong]", "unit 'furlong' is not known"),
    ("q1", "q1[V]", "q cannot be in 'V'"),
])
def test_faults_are_named_with_their_place(tmp_path, old, new, message):
    with pytest.raises(RecordError, match=message):
        read_record(log(tmp_path, PLAIN.replace(old, new, 1)))


@pytest.mark.parametrize("text", [PLAIN.replace(",", " ").replace("0.625", "0.625 7"),
                                  PLAIN.replace("0.5", '"0.5"').replace("0.625", '"0.625",7')])
def test_a_row_that_is_too_long_is_found_with_blanks_and_quotes(tmp_path, text):
    with pytest.raises(RecordError, match="log.csv:3: this line has 4 values"):
        read_record(log(tmp_path, text))


def test_the_line_of_a_fault_in_a_later_block(tmp_path, monkeypatch):
    monkeypatch.setattr(csv_text, "BLOCK", 1000)
    lines = [f"{k / 1000},{k},{k}" for k in range(5000)]
    lines[4321] = "4.321,x,4321"
    with pytest.raises(RecordError, match="log.csv:4323:2"):
        read_record(log(tmp_path, "\n".join(["time,q1,u1", *lines])))
    lines[4321] = "4.321,,4321"
    record = read_record(log(tmp_path, "\n".join(["time,q1,u1", *lines])))
    np.testing.assert_array_equal(record.u[:, 0], np.arange(5000))
    assert np.flatnonzero(~record.valid).tolist() == [4321]


def test_a_last_line_that_is_cut_off_is_left_out(tmp_path):
    record = read_record(log(tmp_path, PLAIN + "0.003,0."))
    same(record)
    assert any("line 5" in sentence and "cut off" in sentence for sentence in record.decisions)


@pytest.mark.parametrize("data, message", [
    (b"time,q1\n", "no samples"), (b"\n\n", "no line with values"),
    (b"\xff\xfet\0i\0", "UTF-16"), (b"\0\1\2\3" * 100, "neither text nor a known log format"),
    (b"x" * 9_000_000, "first line has more than 100000 characters")])
def test_files_that_are_no_log(tmp_path, data, message):
    with pytest.raises(RecordError, match=message):
        read_record(log(tmp_path, data))


def test_values_beyond_the_memory_limit_go_to_a_file(tmp_path, monkeypatch):
    from clie_blocks.analysis.records import table

    monkeypatch.setattr(table, "IN_MEMORY", 10_000)
    monkeypatch.setattr(csv_text, "BLOCK", 5_000)
    rows = np.random.default_rng(0).normal(size=(2000, 4))
    record = Record(np.arange(2000) / 1000, rows[:, :2], rows[:, 2:])
    found = read_record(write_record(record, tmp_path / "log.csv"))
    np.testing.assert_array_equal(found.q, record.q)
    np.testing.assert_array_equal(found.u, record.u)
    with pytest.raises(ValueError, match="read-only"):
        found.q[0, 0] = 1.0


def test_a_full_disk_is_an_error_in_words(tmp_path, monkeypatch):
    from clie_blocks.analysis.records import table

    monkeypatch.setattr(table, "IN_MEMORY", 10)
    monkeypatch.setattr(table.tempfile, "TemporaryFile", lambda: open("/dev/full", "r+b", 0))
    with pytest.raises(RecordError, match="No space left.*TMPDIR"):
        read_record(log(tmp_path, PLAIN))


def test_a_minute_of_six_joints_is_read_nearly_as_fast_as_by_numpy(tmp_path):
    rng = np.random.default_rng(1)
    n = 60_000
    walks = np.cumsum(rng.normal(size=(n, 18)), axis=0)
    path = tmp_path / "log.csv"
    names = ["time", *(f"{name}{k}" for name in ("q", "u", "qd") for k in range(1, 7))]
    np.savetxt(path, np.column_stack([np.arange(n) / 1000, walks]), "%.9g", ",",
               header=",".join(names), comments="")
    start = time.process_time()
    np.loadtxt(path, delimiter=",", skiprows=1)
    by_numpy = time.process_time() - start
    start = time.process_time()
    record = read_record(path)
    assert time.process_time() - start < 12 * by_numpy  # three to four times on a free core
    assert record.q.shape == (n, 6)


# VmHWM and not ru_maxrss: that one a new process takes over from the one that started it.
STREAM = """
import re, sys
from clie_blocks.analysis.records import read_record
record = read_record(sys.argv[1])
print(len(record), re.search(r"VmHWM:\\s+(\\d+)", open("/proc/self/status").read())[1])
"""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="reads /proc")
def test_two_gigabytes_stream_within_one(tmp_path):
    rng = np.random.default_rng(2)
    block = "".join(f"{row}\n" for row in (",".join(f"{x:.8f}" for x in line)
                                           for line in rng.normal(size=(20_000, 18))))
    path, count = tmp_path / "log.csv", 0
    with open(path, "w") as file:
        file.write(",".join(["time", *(f"{s}{k}" for s in "qu" for k in range(1, 10))]) + "\n")
        while file.tell() < 2_000_000_000:
            lines = block.splitlines()
            file.writelines(f"{(count + k) / 1000},{line}\n" for k, line in enumerate(lines))
            count += len(lines)
    done = subprocess.run([sys.executable, "-c", STREAM, str(path)], capture_output=True,
                          text=True, check=True)
    samples, kilobytes = map(int, done.stdout.split())
    assert samples == count
    assert kilobytes < 1_000_000
