"""Random block functions of numpy's arrays: traced, they compute what numpy computes."""

import math
import warnings

import control as ct
import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from clie_blocks.compiled import compile_diagram

# every line makes a vector of three from vectors of three, without rounding of its own kind
EXACT = """
{a} + {b}|{a} - {b}|{a} * {b}|{a} / {b}|-{a}|abs({a})|{a} ** 2|1.5 * {a} - 0.25
np.maximum({a}, {b})|np.minimum({a}, 0.5)|np.clip({a}, -1.0, {b} * {b})|np.clip({a}, None, 2.0)
np.where({a} > {b}, {a}, {b})|np.where(({a} > 0) & ({b} <= 0.5), 1.0, {b})|np.sign({a})
np.where(np.isnan({a}), 0.0, {b})|np.where(np.isfinite({a}), {a}, -1.0)|np.nan_to_num({a})
np.floor({a})|np.round({a})|np.rint({a} * 4) / 4|np.mod({a}, 0.75)|{a} // 0.5|np.trunc({a})
{a}[::-1]|np.roll({a}, 1)|np.concatenate(({a}[1:], {b}[:1]))|np.hstack([{a}[0], {b}[1:]])
np.array([{a}[0], {b}[1], 2.0])|np.stack(({a}, {b})).T[:, 1]|{a}.reshape(3, 1).ravel()
np.sqrt(np.abs({a}))|np.copysign({a}, {b})|np.heaviside({a}, 0.5)|np.logical_not({a} > 0) * {b}
np.cumsum({a})|np.sum({a}) * np.ones(3)|np.full(3, np.max({a}))|np.outer({a}, {b}).sum(axis=0)
np.append({a}[:2], np.prod({b}))|np.diff({a}, append=0.0)|np.array([max({a}[0], 0), *{b}[1:]])
filled({a}, {b})|np.vstack([{a}, {b}])[1]|np.array([scaled(v) for v in {a}])|{a}.copy().T
np.cross({a}, {b})|params['k'] * {a}|params['v'] + {b}|np.where(params['v'] > {a}, {a}, {b})
np.interp({a}, [-1.0, 0.0, 2.0], [0.5, 0.0, 1.0])|np.round({a} * {b}, 1)
"""
SMOOTH = """
np.sin({a}) + {b}|np.cos({a} * {b})|np.tanh({a} - {b})|np.exp(-{a} ** 2)
np.arctan2({a}, 2 + {b} ** 2)
np.hypot({a}, {b})|np.log1p({a} * {a})|MATRIX @ {a}|np.dot(MATRIX, {a}) + {b}|MATRIX.T @ {b}
np.linalg.norm({a}) * {b}|np.full(3, {a} @ {b})|np.einsum('ij,j->i', MATRIX, {a})|np.arcsinh({a})
np.array([math.sin({a}[0]), math.exp(-abs({b}[1])), math.atan({a}[2])])|np.mean({a}) - {b}
np.linalg.solve(MATRIX + np.diag({a} * {a}), {b})|np.linalg.inv(MATRIX) @ {a}|np.cbrt(2 + {a} ** 2)
np.var({a}) + {b}|np.power(1 + {a} ** 2, 0.3)|np.sqrt(1 + {a} * {a})
params['k'] * np.sinh(np.tanh({a}))
"""
MATRIX = np.array([[2.0, 0.3, -0.4], [0.1, 1.5, 0.2], [-0.3, 0.4, 1.8]])
VALUES = [0.0, -0.0, 1.0, -1.5, 0.1, 3.0, 1e300, -1e-300, 5e-324, np.inf, -np.inf, np.nan]


def filled(a, b):
    y = np.zeros(3)
    y[0] = a[2]
    y[1:] += b[:2]
    return y


def scaled(value):
    return 0.5 * value if True else value


def lines_of(table):
    return [line for row in table.strip().splitlines() for line in row.split("|")]


def block(lines, picks):
    """Build a block whose output function is these lines, each fed by earlier results."""
    text = ["def output(t, x, u, params):", "    v0, v1 = u[:3], u[3:]"]
    for k, (line, picked) in enumerate(zip(lines, picks), 2):
        a, b = (f"v{k - 1 - choice % min(k, 4)}" for choice in picked)
        text.append(f"    v{k} = {line.format(a=a, b=b)}")
    text.append(f"    return np.concatenate([v{len(text) - 2}, v{len(text) - 1}])"
                if len(lines) > 1 else "    return v2")
    scope = {"np": np, "math": math, "MATRIX": MATRIX, "filled": filled, "scaled": scaled}
    exec("\n".join(text), scope)
    return ct.nlsys(None, scope["output"], inputs=6, outputs=6 if len(lines) > 1 else 3,
                    name="block", params={"k": 0.7, "v": np.array([0.2, -0.4, 1.0])})

UNSIGNED_ZERO = ("max", "min", "clip")  # numpy itself picks either zero, by processor


def programs(table, most):
    line = st.sampled_from(lines_of(table))
    picked = st.tuples(st.integers(0, 3), st.integers(0, 3))
    return st.lists(st.tuples(line, picked), min_size=1, max_size=most)


def examples(count):
    return settings(max_examples=count, deadline=None, database=None, derandomize=True,
                    phases=[Phase.generate], suppress_health_check=list(HealthCheck))


def points(random, special):
    for _ in range(12):
        u = random.normal(size=6)
        if special:
            u[random.integers(0, 6, 3)] = random.choice(VALUES, 3)
        yield u


def check(instructions, engine, special, rtol):
    lines, picks = zip(*instructions)
    diagram = block(lines, picks)
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        program = compile_diagram(diagram, engine)
        for u in points(np.random.default_rng(0), special):
            expected = diagram.output(0.0, [], u)
            traced, case = program.output(0.0, [], u), f"{lines} {picks} {u}"
            np.testing.assert_allclose(traced, expected, rtol=rtol, atol=1e-12 * (rtol > 0),
                                       err_msg=case)
            if rtol == 0 and not any(word in "".join(lines) for word in UNSIGNED_ZERO):
                is_zero = expected == 0
                np.testing.assert_array_equal(np.signbit(traced)[is_zero],
                                              np.signbit(expected)[is_zero], err_msg=case)


@pytest.mark.parametrize(("engine", "count"), [("llvm", 25), ("python", 150)])
def test_exact_array_functions_equal_numpy_also_at_nan_infinity_and_subnormals(engine, count):
    @examples(count)
    @given(programs(EXACT, 8))
    def run(instructions):
        check(instructions, engine, special=True, rtol=0)
    run()


@pytest.mark.parametrize(("engine", "count"), [("llvm", 20), ("python", 80)])
def test_smooth_array_functions_equal_numpy(engine, count):
    @examples(count)
    @given(programs(SMOOTH, 5))
    def run(instructions):
        check(instructions, engine, special=False, rtol=1e-10)
    run()


@pytest.mark.parametrize("line", lines_of(EXACT) + lines_of(SMOOTH))
def test_every_line_equals_numpy(line):
    exact = line in lines_of(EXACT)
    check([(line, (0, 1))], "python", special=exact, rtol=0 if exact else 1e-12)
