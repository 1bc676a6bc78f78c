"""The page on arms runs as printed."""

import re
from pathlib import Path

import numpy as np
import pytest

from clie_blocks.analysis.records import read_robot

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "arms.md"


def test_the_page_runs_as_printed(tmp_path, monkeypatch, capsys):
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    monkeypatch.chdir(tmp_path)
    (code,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.S)
    names = {}
    exec(compile(code, str(PAGE), "exec"), names)
    printed = capsys.readouterr().out
    assert "shoulder_lift" in printed and (tmp_path / "arm_loop.svg").is_file()
    weight = names["gravity_torque"](names["links"], names["stretched"])
    by_hand = 9.81 * (8.393 * 0.2125 + 2.33 * 0.69732 + 2.6259 * 0.81725)  # stretched to one side
    assert weight[1] == pytest.approx(-by_hand, rel=1e-9)
    hanging = names["goal"] - names["response"].outputs[:6, -1]
    held = names["gravity_torque"](names["links"], names["goal"] - hanging) / (101.0 * 40.0)
    np.testing.assert_allclose(hanging, held, atol=1e-4)  # the law has no integral


def test_the_robot_file_of_the_page_is_read_as_printed(tmp_path):
    (block,) = re.findall(r"```toml\n(.*?)```", PAGE.read_text(), re.S)
    (tmp_path / "arm.urdf").write_text((ROOT / "docs" / "arms" / "six_axis.urdf").read_text())
    (tmp_path / "robot.toml").write_text(f"joints = 6\n{block}")
    robot = read_robot(tmp_path / "robot.toml")
    assert robot.tree.names == robot.joints and robot.links.mass_tolerance == 0.05
