"""Robots of another engine under a law that their owner has in C, as in the firmware."""

import dataclasses
import re
import shutil

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from law_robots import KD, KP, PERIOD, RIGHT, STATED_PD, STEP, Robot, pd, pid  # noqa: E402

from clie_blocks import gap  # noqa: E402
from clie_blocks.analysis.gap.command import main  # noqa: E402
from clie_blocks.analysis.gap.controller.check import check_controller  # noqa: E402

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler called cc")

PROGRAM = f"""/* PID on the joint's velocity, with the present error in the sum. */
void controller(const double q_d[1], const double q[1], double kp, double ki, double kd,
                double integral[1], double last[1], double u[1])
{{
    double error = q_d[0] - q[0];
    integral[0] += {PERIOD} * error;
    u[0] = kp * error + ki * integral[0] - kd * (q[0] - last[0]) / {PERIOD};
    last[0] = q[0];
}}
"""


def in_c(law, ki, kp=KP):
    """Robot under a law of the engine, stated as the function in C."""
    return Robot(law, f'law = "my_law.c:controller"\nparameters = {{ kp = {kp}, ki = {ki}, '
                      f"kd = {KD} }}\ncommand_resolution_nm = {STEP}\n", program=PROGRAM)


@pytest.mark.parametrize(("law", "ki", "stated"), [
    (pd, 0.0, STATED_PD), (lambda: pid(60.0), 60.0, RIGHT["pid"])], ids=["pd", "pid"])
def test_it_replays_as_the_law_of_the_library(tmp_path, law, ki, stated):
    in_c(law, ki).write(tmp_path / "c", seconds=3.0)
    Robot(law, stated).write(tmp_path / "stated", seconds=3.0)
    own = gap.read(tmp_path / "c", run_law=True)
    library = gap.read(tmp_path / "stated")
    one, other = (problem.law.commands(problem.logs[0]) for problem in (own, library))
    np.testing.assert_allclose(one[5:], other[5:], rtol=0, atol=1e-3 * STEP)  # first states differ
    assert check_controller(own).as_stated


def test_a_gain_that_is_not_the_one_that_ran_is_found(tmp_path):
    in_c(lambda: pid(60.0), 60.0, kp=1.3 * KP).write(tmp_path, seconds=3.0)
    check = check_controller(gap.read(tmp_path, run_law=True))
    assert [one.name for one in check.parameters] == ["kp"]
    assert check.parameters[0].value == pytest.approx(KP, rel=1e-4)


def test_a_program_in_c_is_not_compiled_unless_the_user_says_so(tmp_path, capsys):
    dataclasses.replace(in_c(pd, 0.0), program="#error this file was compiled\n").write(
        tmp_path, seconds=3.0)
    assert main([str(tmp_path), "--quiet"]) == 4
    assert re.search(r"my_law.c:controller.*--run-law", capsys.readouterr().err, re.DOTALL)
    assert main([str(tmp_path), "--quiet", "--run-law"]) == 2
    assert "my_law.c:1:2: error: #error this file was compiled" in capsys.readouterr().err


@pytest.mark.slow
def test_friction_is_named_under_a_law_in_c(tmp_path):
    in_c(lambda: pid(60.0), 60.0).write(tmp_path, "coulomb", logs=3)
    diagnosis = gap.diagnose(gap.read(tmp_path, run_law=True))
    assert diagnosis.controller.as_stated
    assert {"coulomb", "asymmetric_coulomb"} & set(diagnosis.ranking[0].names)
