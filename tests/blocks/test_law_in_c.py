"""A control law in C: beside the same law in Python, inside programs, and what can be wrong."""

import ctypes
import runpy
import shutil
from pathlib import Path

import control as ct
import numpy as np
import pytest

from clie_blocks.compiled import compile_diagram, system_compiler
from clie_blocks.compiled.cache.cached_program import cached_program
from clie_blocks.controllers import law_in_c, sampled_pid
from clie_blocks.errors import ClieError
from clie_blocks.robot_loop import robot_loop

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler called cc")

LAWS = Path(__file__).parents[2] / "docs" / "laws"
PD = """#include <math.h>
#define N (2 * 1)
/* PD law: void other(int x) { */
void controller(const double q_d[], const double *q, const double kp[], double kd,
                double last[N], double u[])
{
    %s
    for (int k = 0; k < 2; k++) {
        u[k] = kp[k] * (q_d[k] - q[k]) - kd * (q[k] - last[k]) / 0.01;
        last[k] = q[k];
    }
    %s
}
"""
GAINS = {"kp": [30.0, 20.0], "kd": 1.5}


def law_of(folder, text, gains=GAINS, n=2):
    (folder / "law.c").write_text(text)
    return law_in_c(folder / "law.c", "controller", n, 0.01, parameters=gains)


@pytest.fixture(scope="module")
def both():
    """The law of the page in Python and in C."""
    defined = runpy.run_path(str(LAWS / "my_law.py"))
    own = law_in_c(LAWS / "my_law.c", "controller", 2, defined["PERIOD"],
                   parameters={**defined["GAINS"], "limit": defined["LIMIT"]})
    return defined["controller"], own


def test_the_law_in_c_is_the_law_in_python_to_the_last_digit(both):
    python, own = both
    rng = np.random.default_rng(0)
    for scale in (0.01, 1.0):
        x, u = scale * rng.normal(size=4), scale * rng.normal(size=6)
        np.testing.assert_array_equal(own.output(0.0, x, u), python.output(0.0, x, u))
        np.testing.assert_array_equal(own.dynamics(0.0, x, u), python.dynamics(0.0, x, u))
    assert own.state_labels == ["integral[0]", "integral[1]", "last[0]", "last[1]"]


@pytest.mark.parametrize("engine", ["llvm", "python"])
def test_a_robot_runs_under_the_law_in_c_as_under_the_one_in_python(both, engine):
    time = np.arange(500) * 1e-3
    q_d = 0.8 * np.sin(9.0 * time)[:, None] * [1.0, -0.7]
    inputs = np.hstack([q_d, 0.0 * q_d, 0.0 * q_d])
    runs = [compile_diagram(robot_loop([2e-3, 8e-4], [5e-3, 2e-3], 0.0, 0.0, law.dt, law=law),
                            engine).run(0.5, inputs=inputs).outputs for law in both]
    np.testing.assert_array_equal(runs[0], runs[1])
    assert np.ptp(runs[0][0]) > 0.3 and np.abs(runs[0][2:4]).max() == 0.8  # the limit is met


def test_lanes_have_parameters_of_their_own(both):
    _, law = both
    program = cached_program("law in C of a test", lambda: law)
    inputs = np.random.default_rng(1).normal(size=(20, 6))
    gains = np.linspace(0.5, 2.0, 11)[:, None] * law.params["ki"]
    batch = program.batch(0.02, inputs=inputs, params={"ki": gains}).outputs
    for row, ki in zip(batch, gains):
        x, commands = np.zeros(4), []
        for u in inputs:
            commands.append(law.output(0.0, x, u, params={"ki": ki}))
            x = law.dynamics(0.0, x, u, params={"ki": ki})
        np.testing.assert_allclose(row[:, :20].T, commands, rtol=1e-13)


def test_it_is_the_pd_law_of_the_library(tmp_path):
    own, library = law_of(tmp_path, PD % ("", "")), sampled_pid(
        [30.0, 20.0], [0.0, 0.0], [1.5, 1.5], 0.01)
    rng, x, other = np.random.default_rng(2), np.zeros(2), np.zeros(library.nstates)
    for _ in range(50):
        signals = rng.normal(size=4)
        with_pe = np.append(signals, [0.0, 0.0])
        np.testing.assert_allclose(own.output(0.0, x, signals),
                                   library.output(0.0, other, with_pe), rtol=1e-12, atol=1e-11)
        x = own.dynamics(0.0, x, signals)
        other = library.dynamics(0.0, other, with_pe)


def test_python_control_linearises_it(tmp_path):
    law = ct.linearize(law_of(tmp_path, PD % ("", "")), np.zeros(2), np.zeros(4))
    np.testing.assert_allclose(law.D, [[30, 0, -180, 0], [0, 20, 0, -170]], rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize(("before", "after", "message"), [
    ("x = 1;", "", r"law.c does not compile: .*law.c:7:\d+: error: .x. undeclared"),
    ("gain();", "", "law.c:7:.*implicit declaration of function .gain"),
    ("extern double gain(void); u[0] = gain();", "", "does not compile: .*undefined .*gain"),
    ("static double sum; sum += q[0];", "u[0] += sum;", "keeps a memory.*turn its static"),
    ("", "last[2] = 1.0;", "writes past the end of last; state its length"),
    ("", "u[1] += kp[2];", "reads past the end of an argument"),
    ("", "if (q[0] < 0.5) *(volatile int *)0 = 1;", "ends its process .signal 11. at ordinary"),
    ("", "u[0] += kp[q[0] > 2.0 ? 1 << 28 : 0];", "signal 11. at inputs that are huge"),
    ("", "double e = q[0]; while (e > 3.14) e -= 6.28;", "does not return.*remainder"),
], ids=["syntax", "undeclared", "undefined", "static", "write", "read", "crash", "huge", "loop"])
def test_a_function_that_is_no_law(tmp_path, monkeypatch, before, after, message):
    monkeypatch.setattr("clie_blocks.compiled.c_trial.SECONDS", 0.5)
    with pytest.raises(ClieError, match=message):
        law_of(tmp_path, PD % (before, after))


@pytest.mark.parametrize(("old", "new", "message"), [
    ("controller(", "control(", "no function 'controller'; did you mean 'control'"),
    ("void controller", "int controller", "returns int.*double u"),
    ("double kd", "float kd", "takes 'float kd'.*type double"),
    ("double u[]", "double v[]", "no argument 'u'; its names say"),
    ("double u[]", "double u", "'double u' as a number.*u\\[\\]"),
    ("*q,", "q[3],", "q has 3 numbers and the robot 2 joints"),
    ("kp[],", "kp[sizeof(int)],", "its length is 'sizeof"),
    ("kp[],", "gain[],", "no parameter 'kp'; did you mean")])
def test_arguments_that_no_law_has(tmp_path, old, new, message):
    with pytest.raises(ClieError, match=message):
        law_of(tmp_path, PD.replace(old, new) % ("", ""))


@pytest.mark.parametrize(("gains", "message"), [
    ({"kp": 1.0}, "no value is stated for kd.*parameters = { kd"),
    ({"kp": [1.0, 2.0, 3.0], "kd": [1.0, 2.0]}, "kd holds 1 number, got"),
    ({"kp": [1.0, np.nan], "kd": 1.0}, "kp holds 2 numbers"),
    ({"kp": 1.0, "kd": 1.0, "ki": 1.0}, "no parameter 'ki'")])
def test_numbers_that_are_none_of_its_parameters(tmp_path, gains, message):
    with pytest.raises(ClieError, match=message):
        law_of(tmp_path, PD % ("", ""), gains)


def test_without_a_compiler_it_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setattr(system_compiler.shutil, "which", lambda name: None)
    with pytest.raises(ClieError, match="no C compiler is here.*gcc.*in Python"):
        law_of(tmp_path, PD % ("", ""))
    with pytest.raises(ClieError, match="cannot be read: .*No such file"):
        monkeypatch.undo()
        law_in_c(tmp_path / "none.c", "controller", 2, 0.01)


def test_equal_files_are_compiled_once(tmp_path, monkeypatch):
    law_of(tmp_path, PD % ("", ""))
    monkeypatch.setattr(system_compiler, "_compiled", None)
    assert law_of(tmp_path, PD % ("", "/* said otherwise */")).nstates == 2


def test_a_program_of_another_process_says_what_is_missing():
    from clie_blocks.compiled.ir.foreign import ForeignFunction, foreign_function

    with pytest.raises(ClieError, match="not loaded; build its block"):
        foreign_function(5.0)
    cosine = ForeignFunction("0" * 12, ctypes.CDLL(None), "abs", 1, 1)
    assert cosine.address and foreign_function(0.0) is cosine
