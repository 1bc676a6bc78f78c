"""The built wheel and sdist hold what an installed package needs, and nothing at the top level."""

import importlib.util
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


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
def test_the_description_has_no_link_that_leads_nowhere(built):
    wheel = zipfile.ZipFile(next(built.glob("*.whl")))
    (name,) = (name for name in wheel.namelist() if name.endswith("/METADATA"))
    head, _, text = wheel.read(name).decode().partition("\n\n")
    assert "Description-Content-Type: text/markdown" in head
    assert "# clie_blocks" in text and "clie example friction-arm" in text
    targets = re.findall(r"\]\(([^)]*)\)", text)
    assert targets and all(target.startswith("https://") for target in targets)


def test_links_of_the_description_are_absolute_where_the_project_has_an_address():
    spec = importlib.util.spec_from_file_location("setup_script", ROOT / "setup.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    text = "![A gap](docs/gap.svg) [logs](docs/logs.md) [DOI](https://doi.org/x) [up](#top)"
    assert script.description(text, "https://host/us/it/") == (
        "![A gap](https://host/us/it/raw/HEAD/docs/gap.svg) "
        "[logs](https://host/us/it/blob/HEAD/docs/logs.md) [DOI](https://doi.org/x) [up](#top)")
    assert script.description(text, None) == (
        "*A gap.* logs [DOI](https://doi.org/x) [up](#top)")


@pytest.mark.slow
def test_installed_wheel_runs_outside_the_checkout(fresh_environment, tmp_path):
    code = ("import clie_blocks, clie_blocks.diagrams.clie_loop as loop\n"
            f"root = {str(ROOT)!r}\n"
            "assert not clie_blocks.__file__.startswith(root), clie_blocks.__file__\n"
            "assert not loop.__file__.startswith(root), loop.__file__\n"
            "raise SystemExit(loop.main(['--duration', '25', '--json', '-o', 'plots']))")
    run = subprocess.run([fresh_environment / "python", "-c", code], cwd=tmp_path,
                         capture_output=True, text=True,
                         env={"PATH": "/usr/bin:/bin", "HOME": str(tmp_path)})
    assert run.returncode == 0, run.stderr
    assert (tmp_path / "plots" / "case_1_estimates.png").exists()


@pytest.mark.slow
@pytest.mark.parametrize("version", ["3.11", "3.12", "3.13", "3.14"])
def test_the_wheel_serves_every_python_that_is_there(version, built, tmp_path):
    python = shutil.which(f"python{version}")
    if python is None or subprocess.run([python, "-c", ""], capture_output=True).returncode:
        pytest.skip(f"no python{version} that runs")  # a shim of pyenv may be there and not run
    if sys.version_info[:2] == tuple(map(int, version.split("."))):
        pytest.skip("the Python of the tests")
    subprocess.run([python, "-m", "venv", "venv"], cwd=tmp_path, check=True)
    install = subprocess.run(["venv/bin/python", "-m", "pip", "install", "--quiet",
                              next(built.glob("*.whl"))], cwd=tmp_path, capture_output=True)
    if install.returncode:
        pytest.skip(f"no packages for Python {version} at hand")
    run = subprocess.run(
        ["bash", "-euc", "clie example friction-arm arm; clie check arm; clie identify arm; "
         "clie diagnose arm --effects coulomb -o out"],
        cwd=tmp_path, capture_output=True, text=True,
        env={"PATH": f"{tmp_path}/venv/bin:/usr/bin:/bin", "HOME": str(tmp_path),
             "PYTHONWARNINGS": "error,ignore:Setting the shape on a NumPy array"})
    assert run.returncode == 0, run.stderr
    assert "missing coulomb at elbow" in " ".join(run.stdout.split())
