"""The command `clie check`: order of the answer, exit codes, JSON, page, speed."""

import json
import subprocess
import sys
import time

import numpy as np
import pytest

from clie_blocks.analysis.records.check_report import as_text, check_log, main
from clie_blocks.analysis.records.write import write_record
from clie_blocks.errors import RecordError


@pytest.fixture(scope="module")
def log(clean, tmp_path_factory):
    return write_record(clean, tmp_path_factory.mktemp("log") / "log.csv")


def test_the_answer_comes_in_the_order_of_need(clean):
    wrong = clean.replace(dq=-clean.dq, robot=clean.robot)
    lines = as_text(check_log(wrong)).splitlines()
    assert "not usable as it is: 3 errors" in lines[0]
    joint = next(i for i, line in enumerate(lines) if line.startswith("  base: error; sweeps"))
    error = next(i for i, line in enumerate(lines) if "ERROR [velocity.sign] base, arm" in line)
    able = lines.index("Can be diagnosed:")
    last = next(i for i, line in enumerate(lines) if line.startswith("Most helpful next:"))
    assert joint < error < able < last


def test_exit_codes(clean, log, tmp_path, capsys):
    assert main([str(log)]) == 0
    wrong = write_record(clean.replace(dq=-clean.dq), tmp_path / "wrong.csv")
    assert main([str(wrong)]) == 1
    still = write_record(clean.replace(q=np.zeros_like(clean.q), dq=None), tmp_path / "still.csv")
    assert main([str(still)]) == 4
    (tmp_path / "empty.csv").write_text("")
    with pytest.raises(RecordError):
        main([str(tmp_path / "empty.csv")])
    capsys.readouterr()


def test_json_has_a_version_and_no_nan(log, capsys):
    assert main([str(log), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert answer["schema_version"] == 1
    assert [joint["name"] for joint in answer["logs"][0]["joints"]] == ["base", "arm", "wrist"]
    assert answer["logs"][0]["experiment"]


def test_an_unstated_law_is_recognised(clean):
    bare = check_log(clean.replace(robot=None))
    law = next(c for c in bare.capabilities if c.subject.startswith("controller"))
    assert not law.possible
    assert "not stated" in law.reason


def test_a_page_with_the_signals_is_written(log, tmp_path, capsys):
    assert main([str(log), "-o", str(tmp_path / "out")]) == 0
    page = tmp_path / "out" / "check-1.png"
    assert page.read_bytes().startswith(b"\x89PNG")
    assert str(page) in capsys.readouterr().err


def test_a_check_starts_fast_and_imports_nothing_heavy(log):
    code = ("import sys; from clie_blocks.analysis.records.check_report import main; "
            f"main([{str(log)!r}]); "
            "heavy = {'control', 'scipy', 'matplotlib'} & set(sys.modules); "
            "sys.exit(f'imports {heavy}' if heavy else 0)")
    begun = time.perf_counter()
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert time.perf_counter() - begun < 10  # for busy machines; it takes 0.5 s
