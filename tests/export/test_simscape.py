"""Simscape: the equations of a component compute what the block does, or it is refused."""

import math
import re

import numpy as np
import pytest

from clie_blocks.analysis.export.core import core
from clie_blocks.analysis.export.export import export
from clie_blocks.analysis.export.joint_block import OUTPUTS, joint_block
from clie_blocks.errors import ClieError
from tests.export import robots
from tests.export.test_cores import expected, signals

MIXTURES = [("stribeck", "spring", "soft_stop"), ("asymmetric_coulomb", "quadratic_drag"),
            ("coulomb", "actuator_saturation", "dead_zone", "torque_ripple", "encoder_offset"),
            ("load_dependent_friction", "periodic_disturbance", "counterbalance")]
CHANGES = {"gain": 2.0, "torque": 3.0, "command": 0.5, "zero": 0.1}
WORDS = {name: getattr(math, name) for name in ("exp", "tanh", "sin", "cos", "sqrt", "floor")} | {
    "max": max, "min": min, "abs": abs, "value": lambda number, unit: number}


def in_python(expression):
    """An expression of Simscape as Python has it."""
    part = r"((?:(?!\(if ).)*?)"
    inner = re.compile(rf"\(if {part}, {part} else {part} end\)")
    while "(if " in expression:
        expression = inner.sub(r"((\2) if (\1) else (\3))", expression, count=1)
    for theirs, ours in (("^", "**"), ("&&", " and "), ("||", " or "), ("~=", "!="),
                         ("~", " not "), ("{-1, 'N*m'}", "-1.0"), ("{-1, 'N'}", "-1.0")):
        expression = expression.replace(theirs, ours)
    return expression


def computed(text, t, q, dq, u, other):
    """Effort on the joint, and the measured position, by the equations of a component."""
    scope = dict(WORDS, position=q, speed=dq, time=t, u=u, tau_other=other)
    for name, value in re.findall(r"^    (\w+) = \{(\S+), '1'\};", text, re.MULTILINE):
        scope.setdefault(name, float(value))
    body = text[text.index("    let\n"):]
    for name, expression in re.findall(r"^      (\w+) = (.*);$", body, re.MULTILINE):
        scope[name] = eval(in_python(expression), scope)
    return [eval(in_python(expression), scope) for expression in
            re.findall(r"^      \w+ == (.*);$", body, re.MULTILINE)]


@pytest.mark.parametrize("names", MIXTURES, ids=" ".join)
def test_the_equations_compute_what_the_block_does(names):
    correction = robots.of_links(*map(robots.setting, names), **CHANGES)
    text = export(correction, "simscape").files["j1.ssc"]
    assert ("    tau_other = {0, '1'};" in text) == ("load_dependent_friction" in names)
    rows = signals(40)
    wanted = expected(core(joint_block(correction, 0, 1e-3)), rows)
    for i, ((q, dq, u, other), row) in enumerate(zip(rows, wanted, strict=True)):
        given = dict(zip(OUTPUTS, row, strict=True))
        dry = given["friction_forward" if dq > 0 else "friction_backward"] * np.tanh(dq / 1e-3)
        effort, measured = computed(text, i * 1e-3, q, dq, u, other)
        assert -effort == pytest.approx(given["tau_smooth"] - dry, rel=1e-12, abs=1e-12)
        assert measured == pytest.approx(given["q_measured"], rel=1e-12)


@pytest.mark.parametrize("name", ["time_delay", "actuator_lag", "presliding", "backlash",
                                  "rest_time_breakaway"])
def test_an_effect_with_memory_is_refused_with_the_remedy(name):
    with pytest.raises(ClieError, match=rf"no equation of Simscape holds {name} at j1.*simulink"):
        export(robots.correction(robots.setting("coulomb"), robots.setting(name)), "simscape")


def test_an_axis_that_slides_is_of_the_other_domain():
    sliding = robots.correction(robots.setting("coulomb"), kind="slide", unit_q="m")
    text = export(sliding, "simscape").files["j1.ssc"]
    assert "foundation.mechanical.translational.translational; % R" in text
    assert "effort : R.f -> C.f;" in text and "R.v - C.v" in text and "{-1, 'N'}" in text
    sections = ("nodes", "inputs", "outputs", "parameters", "variables", "branches", "equations")
    words = re.findall(r"^ *(component|let|end|" + "|".join(sections) + r")\b", text, re.MULTILINE)
    assert words.count("end") == len(words) // 2 == 9
