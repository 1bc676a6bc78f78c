"""Equations of the catalogue as formulas: what is set is what is written."""

import re

import pytest

from clie_blocks.analysis.catalogue.formula import SIGNS, as_latex
from clie_blocks.effects import LIBRARY


@pytest.mark.parametrize(("equation", "latex"), [
    ("tau = level tanh(dq / width)", r"\tau = \mathrm{level}\,\tanh ( \dot{q} / \mathrm{width} )"),
    ("u_motor(t) = u(t - delay)", r"u_{\mathrm{motor}} ( t ) = u ( t - \mathrm{delay} )"),
    ("q_link_k = q_k + ratio_k q_(k-1)",
     r"q_{\mathrm{link},k} = q_{k} + \mathrm{ratio}_{k}\,q_{k-1}"),
    ("tau = drag dq |dq|", r"\tau = \mathrm{drag}\,\dot{q} \lvert \dot{q} \rvert"),
    ("z_i' = 0, tau = z", r"\begin{align*}\dot{z}_{i} &= 0 \\ \tau &= z\end{align*}"),
    ("y = sum over j >= k of w_j", r"y = \sum_{ j \ge k }\,w_{j}"),
    ("y = x^exponent", r"y = x ^ {\mathrm{exponent}}")])
def test_an_equation_is_set(equation, latex):
    assert as_latex(equation) == latex


@pytest.mark.parametrize("name", LIBRARY)
def test_every_equation_is_a_formula_of_all_its_parameters(name):
    convert = pytest.importorskip("latex2mathml.converter").convert
    effect = LIBRARY[name]
    latex = as_latex(effect.equation)
    assert "<math" in convert(latex) and latex.count("{") == latex.count("}")
    words = re.sub(r"[^a-z]", " ", latex).split()
    for parameter in effect.parameters:
        if parameter.name not in SIGNS and re.search(
                rf"\b{parameter.name}\b", effect.equation):
            assert set(parameter.name.split("_")) <= set(words), parameter.name
