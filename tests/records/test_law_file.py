"""A control law in a file of the user's own: how a robot file names it, and what can be wrong."""

import shutil
from pathlib import Path

import pytest

from clie_blocks.analysis.records import read_robot
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.law_file import with_law_of_file
from clie_blocks.analysis.records.robot import Robot, as_checks_see, with_law
from clie_blocks.errors import ClieError, RecordError

LAWS = Path(__file__).parents[2] / "docs" / "laws"
EXAMPLE, IN_C = ((LAWS / name).read_text() for name in ("my_law.py", "my_law.c"))


def robot(folder, law="my_law.py:controller", program=EXAMPLE):
    (folder / "robot.toml").write_text(f'joints = 2\n[controller]\nlaw = "{law}"\n'
                                       "saturation_nm = 0.8\n")
    if program is not None:
        (folder / "my_law.py").write_text(program)
    return read_robot(folder / "robot.toml")


def test_reading_a_robot_file_runs_nothing(tmp_path):
    stated = robot(tmp_path, program="raise SystemExit('this file was run')")
    assert stated.controller.is_program and stated.controller.block is None


def test_the_block_of_the_file_is_the_law(tmp_path):
    known = with_law_of_file(robot(tmp_path))
    assert known.controller.block.name == "pid" and known.controller.sample_time == 1e-3
    assert known.controller.saturation.tolist() == [0.8, 0.8]


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler called cc")
def test_a_function_in_c_has_the_numbers_of_the_robot_file(tmp_path):
    (tmp_path / "my_law.c").write_text(IN_C)
    text = ('joints = 2\n[controller]\nlaw = "my_law.c:controller"\nsample_time_s = 0.001\n'
            "parameters = { kp = [1.8, 0.5], ki = 9.0, kd = 0.1, weight = 0, limit = 0.8 }\n")
    (tmp_path / "robot.toml").write_text(text)
    stated = read_robot(tmp_path / "robot.toml")
    assert stated.controller.is_program and stated.controller.block is None
    block = with_law_of_file(stated).controller.block
    assert block.params["ki"].tolist() == [9.0, 9.0] and block.dt == 1e-3
    (tmp_path / "robot.toml").write_text(text.replace("kp", "kq"))
    with pytest.raises(ClieError, match="no parameter 'kq'; did you mean 'k.'"):
        with_law_of_file(read_robot(tmp_path / "robot.toml"))
    (tmp_path / "robot.toml").write_text(text.replace("[1.8, 0.5]", '"much"'))
    with pytest.raises(RecordError, match="parameters: kp must be a number per joint"):
        read_robot(tmp_path / "robot.toml")


def test_numbers_of_a_law_in_python_stand_in_its_file(tmp_path):
    stated = robot(tmp_path)
    (tmp_path / "robot.toml").write_text(
        (tmp_path / "robot.toml").read_text() + "parameters = { kp = 1.0 }\n")
    assert stated.controller.parameters is None
    with pytest.raises(ClieError, match="is Python: write them into params"):
        with_law_of_file(read_robot(tmp_path / "robot.toml"))


def test_robots_without_a_program_stay_as_they_are():
    stated = Robot(n=1, controller=Controller(kp=[1.0], kd=[0.1]))
    assert with_law_of_file(stated) is stated and as_checks_see(stated) is stated


def test_checks_see_an_unknown_law(tmp_path):
    seen = as_checks_see(with_law_of_file(robot(tmp_path)))
    assert seen.controller.law == "unknown" and seen.controller.block is None
    assert seen.controller.saturation.tolist() == [0.8, 0.8]


def test_a_block_replaces_the_stated_gains(tmp_path):
    block = with_law_of_file(robot(tmp_path)).controller.block
    known = with_law(Robot(n=2, controller=Controller(kp=[1.0, 1.0], kd=[0.1, 0.1])), block)
    assert known.controller.law == "program" and known.controller.kp is None


@pytest.mark.parametrize(("program", "message"), [
    (None, "my_law.py: the control law cannot be read: .*No such file"),
    ("import numpy\n\nx = 1 / 0\n", "my_law.py:3: ZeroDivisionError.*control law must run"),
    ("def f(:\n", "my_law.py:1: SyntaxError"),
    ("import numpy as np\ntable = []\nwhile True:\n    table.append(np.empty(2**25))\n",
     "my_law.py:4: the control law takes more than 2 GiB of memory"),
    ("import numpy as np\ntable = np.ones(2**36)\n", "my_law.py:2: .*more than 2 GiB"),
    (EXAMPLE.replace("controller =", "controler ="), "no 'controller'.*'controler'"),
    ("controller = 5\n", "no block of python-control but int.*ct.nlsys")])
def test_a_file_that_defines_no_law(tmp_path, program, message):
    with pytest.raises(ClieError, match=message):
        with_law_of_file(robot(tmp_path, program=program))


@pytest.mark.parametrize("law", ["my_law.py", "my_law:controller", "my_law.py:", "my_law.py:2x",
                                 ":controller", "my_law.c", "my_law.cpp:controller"])
def test_what_names_no_law_of_a_file_is_refused(tmp_path, law):
    with pytest.raises(RecordError, match="FILE.py:NAME"):
        robot(tmp_path, law)


def test_a_misspelt_law_gets_the_nearest_one(tmp_path):
    with pytest.raises(RecordError, match="'cascad' is not known.*cascade"):
        robot(tmp_path, "cascad")
