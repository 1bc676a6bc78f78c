"""The built wheel and sdist hold what an installed package needs, and nothing at the top level."""

import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dist")
    subprocess.run([sys.executable, "-m", "build", "--no-isolation", "--outdir", str(folder)],
                   cwd=ROOT, check=True, capture_output=True)
    return folder


@pytest.mark.slow
def test_wheel_and_sdist_hold_the_three_folders(built):
    names = zipfile.ZipFile(next(built.glob("*.whl"))).namelist()
    for expected in ("clie_blocks/joints.py", "clie_blocks/diagrams/clie_loop.py",
                     "clie_blocks/analysis/cli.py", "clie_blocks/__init__.pyi",
                     "clie_blocks/effects/__init__.pyi",
                     "clie_blocks/analysis/records/__init__.pyi", "clie_blocks/py.typed",
                     "clie_blocks/analysis/examples/friction-arm/robot.toml",
                     "clie_blocks/analysis/examples/friction-arm/log-3.csv.gz",
                     "clie_blocks/analysis/examples/leg-without-torque/go2-leg.urdf",
                     "clie_blocks/analysis/records/gallery/emps.toml",
                     "clie_blocks/analysis/records/gallery/ur5e.urdf"):
        assert expected in names
    assert {name.split("/")[0] for name in names if ".dist-info" not in name} == {"clie_blocks"}
    sdist = tarfile.open(next(built.glob("*.tar.gz"))).getnames()
    assert any(name.endswith("/diagrams/clie_loop.py") for name in sdist)
    inside = {name.partition("/")[2] for name in sdist}
    assert {"LICENSE", "CITATION.cff", "CONTRIBUTING.md", "CHANGELOG.md", "docs/robot_file.md",
            "docs/figures/gap.svg", "notebooks/1_the_loop.ipynb", "docs/conf.py",
            "docs/index.md", "docs/tutorials/log.md", "docs/reference/command_line.rst",
            "docs/site/static/site.css"} <= inside
    assert not any("docs/course/" in name for name in inside)  # copies that a build makes
    assert not any(name.endswith(".pyc") or "/.venv/" in name for name in sdist)


@pytest.mark.slow
def test_installed_wheel_runs_outside_the_checkout(built, tmp_path):
    site = tmp_path / "site"
    subprocess.run([sys.executable, "-m", "pip", "install", "--no-deps", "--quiet", "--target",
                    str(site), str(next(built.glob("*.whl")))], check=True)
    code = ("import clie_blocks, clie_blocks.diagrams.clie_loop as loop\n"
            f"assert clie_blocks.__file__.startswith({str(site)!r}), clie_blocks.__file__\n"
            f"assert loop.__file__.startswith({str(site)!r}), loop.__file__\n"
            "raise SystemExit(loop.main(['--duration', '25', '--json', '-o', 'plots']))")
    run = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True,
                         text=True, env={"PYTHONPATH": str(site), "PATH": "/usr/bin:/bin",
                                         "HOME": str(tmp_path)})
    assert run.returncode == 0, run.stderr
    assert (tmp_path / "plots" / "case_1_estimates.png").exists()
    code = ("from clie_blocks.analysis.cli import main\n"
            "raise SystemExit(main(['example', 'friction-arm', 'arm'])"
            " or main(['check', 'arm']))")
    run = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True,
                         text=True, env={"PYTHONPATH": str(site), "PATH": "/usr/bin:/bin",
                                         "HOME": str(tmp_path)})
    assert run.returncode == 0, run.stderr
    assert "Next: clie diagnose arm" in run.stdout and "elbow" in run.stdout
