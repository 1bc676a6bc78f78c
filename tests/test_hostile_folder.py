"""Nothing in a folder of data is run: neither by a command nor by the processes that it starts."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

CONSOLE = "import sys; from clie_blocks.analysis.cli import main; sys.exit(main())"
NAMES = ("json", "pickle", "numpy", "sitecustomize", "usercustomize", "struct", "tempfile",
         "threading", "signal", "multiprocessing", "concurrent", "clie_blocks", "pymatreader",
         "scipy", "matplotlibrc", "logging", "resource", "importlib")
WORKERS = """
import sys
if __name__ == "__main__":
    from clie_blocks.analysis.workers import workers
    with workers(2) as pool:
        print(sorted(pool.map(abs, [-1, -2])), "here" in sys.path)
"""


@pytest.fixture
def folder(tmp_path):
    """Folder of data in which every module that a program may look for leaves a mark when run."""
    data = tmp_path / "data"
    data.mkdir()
    for name in NAMES:
        text = f"open({str(tmp_path / 'ran')!r}, 'a').write({name!r} + ' ')\n"
        if name in ("clie_blocks", "numpy", "scipy", "multiprocessing", "concurrent"):
            (data / name).mkdir()
            (data / name / "__init__.py").write_text(text)
        else:
            (data / f"{name}.py").write_text(text)
    time = np.arange(600) / 100
    rows = np.column_stack([time, np.sin(time), np.cos(time)])
    (data / "log.csv").write_text("time,q1,u1\n" + "".join(f"{a},{b},{c}\n" for a, b, c in rows))
    return data


def ran(folder):
    """Names of the modules of the folder that were run."""
    mark = folder.parent / "ran"
    return mark.read_text().split() if mark.exists() else []


def console(folder, *arguments):
    """Run the command as it is installed, from the folder of data."""
    script = Path(sys.executable).with_name("clie")
    start = [str(script)] if script.exists() else [sys.executable, "-P", "-c", CONSOLE]
    surroundings = {name: value for name, value in os.environ.items()
                    if name not in ("PYTHONSAFEPATH", "PYTHONPATH")}
    return subprocess.run([*start, *map(str, arguments)], cwd=folder, env=surroundings,
                          capture_output=True, text=True, check=False)


def test_the_marks_work(folder):
    subprocess.run([sys.executable, "-c", "import json, pickle"], cwd=folder, check=False,
                   capture_output=True, env={**os.environ, "PYTHONSAFEPATH": ""})
    assert "json" in ran(folder)


def test_the_reader_of_matlab_files_runs_nothing_of_the_folder(folder):
    scipy_io = pytest.importorskip("scipy.io")
    pytest.importorskip("pymatreader")
    time = np.arange(600) / 100
    scipy_io.savemat(folder / "log.mat", {"time": time, "q": np.sin(time), "u": np.cos(time)})
    done = console(folder, "check", "log.mat")
    assert "600 samples" in done.stdout, done.stderr
    assert ran(folder) == []


def test_a_fault_of_the_child_names_the_file_as_it_was_given(folder):
    pytest.importorskip("pymatreader")
    (folder / "log.mat").write_bytes(b"MATLAB 5.0 MAT-file" + b"\xff" * 400)
    done = console(folder, "check", "log.mat")
    assert done.returncode == 3
    assert done.stderr.startswith("error: log.mat cannot be read as a MATLAB file")
    assert ran(folder) == []


def test_processes_that_work_side_by_side_run_nothing_of_the_folder(folder):
    script = folder.parent / "elsewhere" / "program.py"
    script.parent.mkdir()
    script.write_text(WORKERS)
    surroundings = {name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"}
    done = subprocess.run([sys.executable, str(script)], cwd=folder, capture_output=True,
                          text=True, check=False, env=surroundings)
    assert done.stdout.startswith("[1, 2]"), done.stderr
    assert ran(folder) == []


def test_the_surroundings_of_other_children_stay_as_they_were(monkeypatch):
    from clie_blocks.analysis.workers import workers

    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    with workers(1) as pool:
        assert pool.submit(os.getenv, "PYTHONSAFEPATH").result() == "1"
        assert "PYTHONSAFEPATH" not in os.environ
    assert "PYTHONSAFEPATH" not in os.environ


@pytest.mark.slow
def test_a_diagnosis_in_two_processes_runs_nothing_of_the_folder(folder, shared):
    source = shared / "blind" / "practice"
    for name in ("trial-000", "trial-001"):
        shutil.copytree(source / name, folder / name)
    done = console(folder, "diagnose", "trial-000", "trial-001", "--effects", "coulomb,spring",
                   "--jobs", "2", "-o", "out")  # two names load what all of them do
    assert done.returncode == 0, done.stderr
    assert {"trial-000.html", "trial-001.html"} <= {path.name
                                                    for path in (folder / "out").iterdir()}
    assert ran(folder) == []


@pytest.mark.slow
def test_a_blind_study_runs_nothing_of_the_folder(folder):
    pytest.importorskip("mujoco")
    done = console(folder, "blind", "--trials", "2", "--jobs", "2", "-o", "study")
    assert done.returncode == 0, done.stderr
    assert ran(folder) == []
