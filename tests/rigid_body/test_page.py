"""The page on arms runs as printed."""

import importlib.util
import json
import re
import shlex
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


@pytest.mark.slow
def test_the_arm_to_try_is_diagnosed_as_the_page_says(tmp_path, monkeypatch, capsys):
    pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")
    from clie_blocks.analysis.cli import main as clie

    (block,) = re.findall(r"```sh\n(python docs/arms.*?)```", PAGE.read_text(), re.S)
    *runs, diagnosis = map(shlex.split, block.strip().splitlines())
    monkeypatch.chdir(tmp_path)
    for _, script, *options in runs:
        spec = importlib.util.spec_from_file_location("script", ROOT / script)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        module.main(options)
    capsys.readouterr()
    assert clie([*diagnosis[1:], "--seconds", "400"]) == 0
    said = re.sub(r"report: .*\n", "", capsys.readouterr().out)
    assert " ".join(said.split()) in " ".join(PAGE.read_text().split())
    answer = json.loads((tmp_path / "out" / "reports" / "rubs.json").read_text())
    level = answer["effects"][0]["parameters"]["level"]["value"]
    assert np.ravel(level).max() == pytest.approx(0.06, rel=5e-3)


def test_the_robot_file_of_the_page_is_read_as_printed(tmp_path):
    (block,) = re.findall(r"```toml\n(.*?)```", PAGE.read_text(), re.S)
    (tmp_path / "arm.urdf").write_text((ROOT / "docs" / "arms" / "six_axis.urdf").read_text())
    (tmp_path / "robot.toml").write_text(f"joints = 6\n{block}")
    robot = read_robot(tmp_path / "robot.toml")
    assert robot.tree.names == robot.joints and robot.links.mass_tolerance == 0.05
