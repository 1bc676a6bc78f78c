"""The page on control laws of the user's own, used as it says."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "howto" / "own_law.md").read_text()
LAW = (ROOT / "docs" / "laws" / "my_law.py").read_text()


def commands(folder):
    """Commands of the page, with a folder in the place of its own."""
    (block,) = re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL)
    for line in block.replace("out/pid_arm", str(folder)).splitlines():
        first, *rest = shlex.split(line)
        yield [str(Path(sys.executable).with_name(first)), *rest]


def test_the_page_shows_the_law_as_it_is():
    (shown,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    for part in shown.split("\n\n\n"):
        assert part.strip() in LAW
    assert 'law = "my_law.py:controller"' in PAGE


@pytest.mark.slow
def test_the_arm_to_try_has_friction_and_its_law_is_found(tmp_path):
    said = ""
    for command in commands(tmp_path / "pid_arm"):
        run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
        assert run.returncode == 0, run.stderr
        said = run.stdout
    (wanted,) = re.findall(r"```text\n(pid_arm.*?)```", PAGE, re.DOTALL)
    name, number = r"missing coulomb at joint1", r"removes (\d+) %"
    assert re.search(name, wanted) and re.search(name, said)
    gained = [int(re.search(number, text)[1]) for text in (wanted, said)]
    assert abs(gained[0] - gained[1]) <= 1


@pytest.mark.slow
def test_a_log_from_the_middle_of_a_run_and_a_wrong_gain(tmp_path):
    from clie_blocks.analysis.gap.batch import read
    from clie_blocks.analysis.gap.diagnosis import diagnose

    folder = tmp_path / "pid_arm"
    subprocess.run(next(commands(folder)), cwd=ROOT, check=True, timeout=300)
    for log in folder.glob("*.csv"):
        rows = np.loadtxt(log, delimiter=",", skiprows=1)[3333:]
        np.savetxt(log, rows, "%.9g", ",", header=log.read_text().split("\n")[0], comments="")
    (folder / "my_law.py").write_text(LAW.replace('"ki": np.array([9.0', '"ki": np.array([12.0'))
    found = diagnose(read(folder, run_law=True))
    (changed,) = found.controller.parameters
    assert (changed.name, changed.joint) == ("ki", 0) and changed.value == pytest.approx(9, 1e-3)
    assert found.to_dict()["effects"][0]["effect"] in ("coulomb", "asymmetric_coulomb")
    assert found.reduction.percent > 95.0
