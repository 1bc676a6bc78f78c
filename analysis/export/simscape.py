"""The target ``simscape``: a joint without memory as equations in the language of Simscape."""

from __future__ import annotations

import re

from clie_blocks.analysis.export.c_target import notes
from clie_blocks.analysis.export.core import Core, core, fill
from clie_blocks.analysis.export.correction import Correction
from clie_blocks.analysis.export.exported import Exported
from clie_blocks.analysis.export.joint_block import joint_block
from clie_blocks.effects.effect import Setting
from clie_blocks.errors import ClieError

RAN = ("The tests of this package compute such equations by a reading of their own; the component "
       "was never built in Simscape.")
ASKED = ("tau_smooth", "friction_forward", "friction_backward", "q_measured")
_SIGNALS = {"u[0]": "q", "u[1]": "dq", "u[2]": "u", "u[3]": "tau_other", "t": "now"}
_CALLS = {  # of the listing for tensors; others have the same name
    "where": "(if {0}, {1} else {2} end)", "maximum": "max({0}, {1})",
    "minimum": "min({0}, {1})", "pow": "({0})^({1})", "logical_and": "({0} && {1})",
    "logical_or": "({0} || {1})", "logical_not": "(~{0})", "arctan": "atan({0})",
    "arcsin": "asin({0})", "arccos": "acos({0})", "arctan2": "atan2({0}, {1})",
    "trunc": "fix({0})", "rint": "round({0})"}
_SAME = ("abs", "sqrt", "floor", "ceil", "sign", "sin", "cos", "tan", "sinh", "cosh", "tanh",
         "exp", "log", "log10")
_TRUTH = re.compile(r"(<=|>=|==|!=|<|>)|^logical_")


def export_simscape(correction: Correction, step: float) -> Exported:
    """Return one component of Simscape per joint.

    Dry friction is smoothed over a speed, as a differential equation wants it: it creeps.

    Parameters
    ----------
    correction : Correction
        The corrected robot.
    step : float
        Any step; the equations have none.

    Raises
    ------
    ClieError
        If an effect has memory or works sample by sample, which no equation holds.

    """
    files: dict[str, str | bytes] = {}
    for k, joint in enumerate(correction.joints):
        refused = [one for one in joint_block(correction, k, step).effects
                   if not in_equations(correction, k, one)]
        if refused:
            raise ClieError(
                f"no equation of Simscape holds {', '.join(one.name for one in refused)} at "
                f"{joint.name}, which has memory or works sample by sample; export with --to "
                "simulink, whose S-function holds it beside your Simscape model")
        made = core(joint_block(correction, k, step))
        files[f"{made.name}.ssc"] = fill("simscape.ssc.j2", core=made, parameters=[
            (_name(key), value) for key, value in made.parameters], lines=equations(made))
    return Exported("simscape", files, notes(correction), ran=RAN)


def in_equations(correction: Correction, k: int, setting: Setting) -> bool:
    """Whether an effect of joint k is a function of position, speed, command and time alone."""
    listings = []
    for step in (1e-3, 3e-4):
        made = core(joint_block(correction, k, step, (setting,)))
        if made.states:
            return False
        try:
            listings.append(equations(made))
        except KeyError:  # a function that Simscape lacks
            return False
    return listings[0] == listings[1]


def equations(made: Core) -> list[tuple[str, str]]:
    """Return what the block computes, as names with expressions, in the order of need.

    Raises
    ------
    KeyError
        For a function that Simscape lacks.

    """
    text = made.torch_source()
    observe = text[text.index("def observe"):]
    rows = re.findall(r"^ +(.*),$", observe[observe.index("return ["):], re.MULTILINE)
    lines = re.findall(r"^ +(v\d+) = ([^#\n]*?)(?:  #.*)?$", observe, re.MULTILINE)
    lines += [(name, rows[made.rows[name]]) for name in ASKED]
    needed, kept = set(ASKED), []
    for name, code in reversed(lines):
        if name in needed:
            needed |= set(re.findall(r"v\d+", code))
            kept.append((name, code))
    names = [_name(key) for key, _ in made.parameters]
    truths: dict[str, str] = {}
    found = []
    for name, code in reversed(kept):
        written = _expression(code, names, truths)
        if _TRUTH.search(code):
            truths[name] = f"({written})"  # no value of its own: it stands in its conditions
        else:
            found.append((name, written))
    return found


def _expression(code: str, names: list[str], truths: dict[str, str]) -> str:
    """One line of the listing, which holds one operation, in the language of Simscape."""
    code = re.sub(r"number\((.*?)\)", lambda one: _number(one[1]), code)
    code = re.sub(r"p\[(\d+)\]", lambda one: names[int(one[1])], code)
    code = re.sub(r"u\[\d\]|\bt\b", lambda one: _SIGNALS[one[0]], code)
    called = re.fullmatch(r"(\w+)\((.*)\)", code)
    if called and called[1] not in _SAME:
        operands = [truths.get(one, one) for one in called[2].split(", ")]
        return _CALLS[called[1]].format(*operands)
    return re.sub(r"v\d+", lambda one: truths.get(one[0], one[0]), code).replace("!=", "~=")


def _number(text: str) -> str:
    return f"({text})" if text.startswith("-") else text


def _name(key: str) -> str:
    return re.sub(r"\W", "_", key)
