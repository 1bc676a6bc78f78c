"""The example of docs/export.md on the real axis: its files, and the figures that it states."""

import re
from pathlib import Path

import pytest

from clie_blocks.analysis.export.replay import replay
from clie_blocks.analysis.gap import read
from clie_blocks.analysis.gap.diagnosis import diagnose

PAGE = (Path(__file__).parents[2] / "docs" / "export.md").read_text()


@pytest.mark.slow
def test_the_axis_of_the_page_closes_its_gap_in_mujoco(shared, tmp_path):
    pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
    own = tmp_path / "emps.xml"
    own.write_text(re.search(r"```xml\n(.*?)```", PAGE, re.S)[1])
    problem = read(shared / "data" / "emps")
    diagnose(problem, effects=("coulomb", "actuator_lag")).export("mujoco", tmp_path / "out", own)
    stated = re.search(r"```diff\n(.*?)```", PAGE, re.S)[1].replace("...\n", "").splitlines()
    written = (tmp_path / "out" / "emps.diff").read_text().splitlines()
    assert [re.sub(r"[\d.]+", "", line) for line in stated] == [
        re.sub(r"[\d.]+", "", line) for line in written if line in stated or line[0] in "+-"
        and not line.startswith(("+++", "---"))]
    (gap,) = replay(problem, tmp_path / "out" / "emps.corrected.xml", own).gaps
    nominal, corrected, floor = map(float, re.search(
        r"\naxis +(\S+) +(\S+) +(\S+) +m ", PAGE).groups())
    assert gap.nominal == pytest.approx(nominal, rel=0.02)
    assert gap.corrected == pytest.approx(corrected, rel=0.02)
    assert gap.floor == pytest.approx(floor, rel=0.02)
