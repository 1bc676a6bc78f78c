"""Modelica: models are well formed, and the C that they call gives the numbers of the block."""

import ctypes
import re
import subprocess

import numpy as np

from clie_blocks.analysis.export.core import core
from clie_blocks.analysis.export.correction import Correction
from clie_blocks.analysis.export.export import export
from clie_blocks.analysis.export.joint_block import joint_block
from tests.export import robots
from tests.export.test_cores import COMPILER, STEP, expected, needs_compiler, signals

EFFECTS = ("stribeck", "actuator_lag", "encoder_eccentricity")
FOLDER = "CorrectedJoints"
RESERVED = set("""algorithm and annotation block break class connect connector constant der
discrete each else elseif elsewhen end enumeration equation expandable extends external false
final flow for function if import impure in initial inner input loop model not operator or outer
output package parameter partial protected public pure record redeclare replaceable return stream
then true type when while within""".split())


@needs_compiler
def test_the_functions_of_a_model_give_the_numbers_of_the_block(tmp_path):
    correction = robots.correction(*map(robots.setting, EFFECTS))
    export(correction, "modelica", step=STEP).save(tmp_path)
    twice = '#include "j1_modelica.h"\n#include "j1_modelica.h"\n'  # as tools include it
    called = ("void *make(void) { return j1_modelica_new(); }\n"
              "void end(void *j) { j1_modelica_free(j); }\n"
              "void go(void *j, double a, double b, double c, double d, double *e, double *f)\n"
              "{ j1_modelica_advance(j, a, b, c, d, e, f); }\n")
    (tmp_path / "one.c").write_text(twice + called)
    (tmp_path / "two.c").write_text(re.sub("make|end|go", r"other_\g<0>", twice + called))
    subprocess.run([COMPILER, "-std=c99", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared",
                    "-ffp-contract=off", f"-I{FOLDER}/Resources/Include", "-o", "called.so",
                    "one.c", "two.c", "-lm"], cwd=tmp_path, check=True)
    code = ctypes.CDLL(str(tmp_path / "called.so"))
    code.make.restype = ctypes.c_void_p
    code.go.argtypes = [ctypes.c_void_p, *[ctypes.c_double] * 4,
                        *[ctypes.POINTER(ctypes.c_double)] * 2]
    code.end.argtypes = [ctypes.c_void_p]
    block, other = code.make(), code.make()  # two of one model have their own memory
    torque, measured, rows = ctypes.c_double(), ctypes.c_double(), signals(60)
    wanted = expected(core(joint_block(correction, 0, STEP)), rows)
    for row, (expected_torque, *_, expected_measured) in zip(rows, wanted, strict=True):
        code.go(other, 9.0, 9.0, 9.0, 9.0, torque, measured)
        code.go(block, *row, torque, measured)
        np.testing.assert_allclose([torque.value, measured.value],
                                   [expected_torque, expected_measured], rtol=1e-12, atol=1e-12)
    code.end(block)
    code.end(other)


def blocks(text):
    """Classes of a Modelica text that are opened and closed, in the order of their ends."""
    text = re.sub(r'"(?:[^"\\]|\\.)*"', '""', text)
    declared = re.findall(r"^ *(?:input|output|constant|discrete)? ?[A-Z][\w.]* (\w+)", text,
                          re.MULTILINE)
    assert not RESERVED & set(declared)
    opened, closed = [], []
    for word, name in re.findall(
            r"^ *((?:impure )?(?:package|model|class|function)|end) (\w+)", text, re.MULTILINE):
        if word != "end":
            opened.append(name)
        elif name != "when":
            assert opened.pop() == name
            closed.append(name)
    assert not opened and text.count("(") == text.count(")") and text.count("{") == text.count("}")
    return closed


def test_the_package_has_a_model_per_joint_with_its_flange():
    both = Correction((robots.joint(), robots.joint(name='2nd "axis"', kind="slide", unit_q="m")),
                      1e-3, (robots.setting("coulomb"),))
    files = export(both, "modelica").files
    assert {name for name in files if name.endswith(".mo")} == {
        f"{FOLDER}/{name}.mo" for name in ("package", "Internal", "J1", "Joint2ndAxis")}
    assert blocks(files[f"{FOLDER}/Internal.mo"]) == [
        "constructor", "destructor", "J1Block", "advanceJ1", "constructor", "destructor",
        "Joint2ndAxisBlock", "advanceJoint2ndAxis", "Internal"]
    turning, sliding = files[f"{FOLDER}/J1.mo"], files[f"{FOLDER}/Joint2ndAxis.mo"]
    assert blocks(turning) == ["J1"] and blocks(sliding) == ["Joint2ndAxis"]
    assert "Rotational.Interfaces.Flange_b" in turning and "flange.tau = -torque" in turning
    assert "Translational.Interfaces.Flange_b" in sliding and "flange.f = -torque" in sliding
    assert "when sample(0, step) then" in turning and "= 0.000125 " in turning
