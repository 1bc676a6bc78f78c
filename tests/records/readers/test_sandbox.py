"""The child that reads what a hostile file could end: its faults are errors in words."""

import base64
import subprocess
import sys
import zlib

import fuzzing
import pytest

from clie_blocks.analysis.records import read_records
from clie_blocks.analysis.records.readers import sandbox
from clie_blocks.errors import RecordError

# A file found by mutation that ends SciPy 1.17 with a segmentation fault.
CRASH = (b"c-r%I4DoSvQZUssQ1EpO(M`+DNmU5QNi0drFUqx2D9A6)tk6+#E=o--Nlj76&$ChpPApOI%P&(fGE^`$ure^P"
         b"GO|=KGB7e@AOkRZ`tkv(03c=qVh$(`0<2Iz3rHClvoMro=B9E2*$Nm2eXxfz93T{j1IXMBNaix3nac>r%nUjC=|"
         b"FK7uo^}nSqP*-`U?oSiwVgb5a2{O0Le{QXeC@S0P5`})c")


def test_a_mat_file_that_crashes_its_reader(tmp_path):
    pytest.importorskip("pymatreader")
    (tmp_path / "log.mat").write_bytes(zlib.decompress(base64.b85decode(CRASH)))
    with pytest.raises(RecordError, match="log.mat crashed its reader|log.mat cannot be read"):
        read_records(tmp_path / "log.mat")


@pytest.mark.parametrize("name, data", [
    ("truncated.mat", lambda: fuzzing.matlab_bytes()[:-30]),
    ("other.mat", lambda: b"MATLAB 5.0 MAT-file" + b"\xff" * 400),
    ("new.mat", lambda: b"\x89HDF\r\n\x1a\n" + b"\xff" * 400),
    ("log.mcap", lambda: b"\x89MCAP0\r\n" + b"\0" * 50)])
def test_a_damaged_file_through_the_child(name, data, tmp_path):
    pytest.importorskip("rosbags" if name.endswith("mcap") else "pymatreader")
    path = tmp_path / name
    path.write_bytes(data())
    with pytest.raises(RecordError, match=f"{path} .*export it again"):
        read_records(path)


def test_the_child_reports_its_own_errors(tmp_path):
    (tmp_path / "log.mat").write_bytes(b"nonsense")
    with pytest.raises(RecordError, match="cannot be read as a MATLAB file"):
        sandbox.run("mat_variables.load", tmp_path / "log.mat")


def test_a_reader_that_computes_without_end_is_stopped(tmp_path, monkeypatch):
    monkeypatch.setattr(sandbox.subprocess, "run", lambda *given, **said: (
        sandbox.subprocess.CompletedProcess(given, -sandbox.TOO_LONG)))
    with pytest.raises(RecordError, match="log.mat kept its reader computing for more than 20 s"):
        sandbox.run("mat_variables.load", tmp_path / "log.mat")


def test_the_limit_of_computing_ends_a_process(tmp_path):
    pytest.importorskip("resource")
    code = ("from clie_blocks.analysis.records.readers import sandbox\n"
            "sandbox._limit(sandbox.MEMORY, 1)\nwhile True: pass")
    done = subprocess.run([sys.executable, "-c", code], check=False, timeout=60)
    assert done.returncode == -sandbox.TOO_LONG
