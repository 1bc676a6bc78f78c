"""Blocks as people write them: each traced form must compute what numpy computes."""

import datetime
import functools
import math
import random
import time
from math import tanh as hyperbolic
from time import perf_counter

import control as ct
import numpy as np
import pytest
from numpy import sin as sine
from numpy import zeros as blank

from clie_blocks import controllers
from clie_blocks.compiled import TraceError, compile_diagram
from clie_blocks.compiled.frontend.tracing import trace
from clie_blocks.controllers import pd_torque
from clie_blocks.signals import DiagramError, interconnect, signals

MATRIX = np.array([[3.0, 0.5, 0.0], [0.5, 2.0, -0.3], [0.0, -0.3, 1.0]])


def in_place(u):
    y = np.zeros(3)
    y[0] = u[1]
    y[1:] += u[:2] * 2
    return y


def by_loop(u):
    total = 0.0
    for k in range(3):
        total += (k + 1) * u[k]
    return [total, total**2, total**3]


def signal_matrix(u):
    return np.diag(np.abs(u) + 1) + MATRIX


def swapped_pivot(u):
    return np.array([[0 * u[0], u[0], 1.0], [u[1], 2.0, u[2]], [1.0, u[2], u[0]]])


def local_import(u):
    import numpy
    return numpy.array([numpy.exp(-u[0]), *u[1:]])


def imported_names(u):
    y = blank(3)
    y[:2] = sine(u[:2])
    y[2] = hyperbolic(u[2])
    return y


def power(a, k):
    return 1.0 if k == 0 else a * other_power(a, k - 1)


def other_power(a, k):
    return 1.0 if k == 0 else np.array(a) * power(a, k - 1)


def closure(scale):
    def scaled(u, offset=0.3):
        return helper(u) + offset

    def helper(u):
        return np.asarray([scale * u[0], np.exp(u[1]), u[2]])
    return scaled


FORMS = {
    "arithmetic": lambda u: 2 * u - u / 3 + u**2 - (-u) + abs(u),
    "powers": lambda u: np.array([u[0]**3, 2.0**u[1], abs(u[2])**1.5]),
    "scalars": lambda u: np.array([np.sin(u[0]), np.exp(-u[1]**2), np.hypot(u[0], u[2])]),
    "math module": lambda u: [math.sin(u[0]), math.atan2(u[1], u[2]), math.fabs(u[1])],
    "in place": in_place,
    "python loop": by_loop,
    "tuple of arrays": lambda u: (u[:1], u[1:]),
    "list of scalars": lambda u: [u[0], 1.0, u[2] > 0],
    "concatenate": lambda u: np.concatenate((u[:2], [u[2]])),
    "concatenate lists": lambda u: np.concatenate(([u[0]], [u[1], 1.0])),
    "stack": lambda u: np.stack([u, 2 * u])[1],
    "stack scalars": lambda u: np.stack([u[0], u[1], u[2]]),
    "hstack": lambda u: np.hstack((u[0], u[1:])),
    "vstack": lambda u: np.vstack((np.diag(u), np.eye(3)))[2:5].sum(axis=0),
    "split": lambda u: np.split(u, [1])[1],
    "reshape": lambda u: np.outer(u, u).reshape(-1)[:4],
    "sums": lambda u: [np.sum(u), np.sum([u[0], u[1]]), u.sum() + np.mean(u)],
    "products": lambda u: [np.dot(u, u), u @ MATRIX @ u, np.prod(u)],
    "matrix product": lambda u: MATRIX @ u,
    "matmul with diag": lambda u: np.diag(u) @ MATRIX @ np.ones(3),
    "einsum": lambda u: np.einsum("ij,j->i", MATRIX, u),
    "cross": lambda u: np.cross(u, [1.0, 2.0, 3.0]),
    "solve": lambda u: np.linalg.solve(signal_matrix(u), u),
    "solve with exchange": lambda u: np.linalg.solve(swapped_pivot(u), u),
    "inverse": lambda u: np.linalg.inv(signal_matrix(u)) @ u,
    "determinant": lambda u: [np.linalg.det(swapped_pivot(u)), np.linalg.norm(u)],
    "where": lambda u: np.where(u > 0, u, -2 * u),
    "where scalar": lambda u: [np.where(u[0] > u[1], 1.0, u[2]), np.where(True, u[1], 0.0)],
    "logic": lambda u: np.where((u > -1) & ~(u > 1) | (u == 3), 1.0, 0.0),
    "logical functions": lambda u: np.logical_and(u > 0, np.logical_not(u > 1)) * 2.0,
    "clip": lambda u: np.clip(u, -0.5, 0.7),
    "clip per entry": lambda u: np.clip(u, -np.array([0.1, 0.2, 0.3]), np.ones(3)),
    "clip method": lambda u: u.clip(-0.5, 0.7),
    "sign": lambda u: np.sign(u),
    "extremes": lambda u: [np.maximum(u[0], u[1]), np.min(u), u.max()],
    "builtin extremes": lambda u: [max(0, u[0]), min(u[1], 0.5), max(u)],
    "rounding": lambda u: [np.floor(u[0]), np.rint(3 * u[1]), round(u[2], 1)],
    "round": lambda u: np.round(u, 2),
    "modulo": lambda u: np.mod(u, 0.7) + u % -0.3,
    "floor division": lambda u: u // 0.3,
    "mixed constants": lambda u: np.array([1, 2, 3]) * u + np.arange(3),
    "zeros like": lambda u: np.zeros_like(u) + np.ones_like(u) * u,
    "full": lambda u: np.full(3, u[0]),
    "roll and reverse": lambda u: np.roll(u[::-1], 1),
    "cumulative sum": lambda u: np.cumsum(u),
    "interpolation": lambda u: np.interp(u, [-1.0, 0.0, 2.0], [0.0, 1.0, -1.0]),
    "heaviside": lambda u: np.heaviside(u, 0.5),
    "degrees": lambda u: np.degrees(u) + np.radians(u),
    "finite": lambda u: np.where(np.isfinite(u) & ~np.isnan(u), u, 0.0),
    "array of arrays": lambda u: np.array([[u[0], u[1]], [u[1], u[2]]]) @ u[:2],
    "atleast": lambda u: np.atleast_1d(u[0]),
    "asarray": lambda u: np.asarray([u[0], 2.0]) * np.asarray(u)[:2],
    "function of another module": lambda u: pd_torque(1.0, u, 2 * u, 0.1, 3.0, 4.0),
    "function through its module": lambda u: controllers.pd_torque(1.0, u, u, 0.0, 3.0, 4.0),
    "local import": local_import,
    "imported names": imported_names,
    "functions that call each other": lambda u: power(u, 3),
    "closures and defaults": closure(2.5),
    "partial": functools.partial(lambda gain, u: gain * np.sin(u), 2.0),
}


def block_of(form, n=3):
    size = len(np.ravel(np.hstack([np.ravel(part) for part in as_parts(form(np.ones(n)))])))
    return ct.nlsys(None, lambda t, x, u, params: flat(form(u)), name="block",
                    inputs=signals("u", n=n), outputs=signals("y", n=size))


def as_parts(value):
    return value if isinstance(value, (tuple, list)) else [value]


def flat(value):
    return value if not isinstance(value, (tuple, list)) else np.hstack(value)


@pytest.mark.parametrize("form", FORMS.values(), ids=FORMS)
def test_traced_form_equals_numpy(form):
    block = block_of(form)
    program = compile_diagram(block, "python")
    generator = np.random.default_rng(1)
    for _ in range(20):
        u = generator.standard_normal(3) * 1.5
        np.testing.assert_allclose(program.output(0.0, [], u), block.output(0.0, [], u),
                                   rtol=1e-11, atol=1e-13)


class Saturation:
    def __init__(self, limit):
        self.limit = limit

    def __call__(self, t, x, u, params):
        return np.clip(u, -self.limit, self.limit)

    def output(self, t, x, u, params):
        return np.tanh(u / self.limit)


@pytest.mark.parametrize("function", [Saturation(0.5), Saturation(0.5).output,
                                      functools.partial(Saturation.output, Saturation(2.0))])
def test_callable_objects_and_methods_are_traced(function):
    block = ct.nlsys(None, function, name="sat", inputs=1, outputs=1)
    program = compile_diagram(block, "python")
    for u in (-1.0, 0.2, 3.0):
        np.testing.assert_allclose(program.output(0.0, [], [u]), block.output(0.0, [], [u]))


def branch(t, x, u, params):
    return u if u[0] > 0 else -u


def boolean_word(t, x, u, params):
    return np.where(u > 0 and u < 1, u, 0.0)


def to_float(t, x, u, params):
    return float(u[0])


@pytest.mark.parametrize(("function", "text"), [
    (branch, r"block 'relay'.*branch on a signal.*np\.where"),
    (to_float, r"block 'relay'.*cannot become a float"),
    (boolean_word, r"block 'relay'.*branch on a signal"),
    (lambda t, x, u, params: np.fft.fft(u), r"block 'relay', output function"),
    (lambda t, x, u, params: np.where(u > 0)[0], r"use np\.where\(condition, a, b\)"),
    (lambda t, x, u, params: np.spacing(u), r"np\.spacing cannot be traced"),
])
def test_what_cannot_be_traced_is_refused_with_a_remedy(function, text):
    relay = ct.nlsys(None, function, name="relay", inputs=1, outputs=1)
    source = ct.nlsys(None, lambda t, x, u, params: u, name="source", inputs=1, outputs=1)
    diagram = interconnect([relay, source], [("relay.u[0]", "source.y[0]")],
                           inputs={"r": "source.u[0]"}, outputs={"y": "relay.y[0]"}, name="top")
    with pytest.raises(TraceError, match=text):
        compile_diagram(diagram)


class Counter:
    calls = 0

    def __call__(self, t, x, u, params):
        self.calls += 1
        return u * self.calls


class NoisyGain:
    def __init__(self):
        self.generator = np.random.default_rng(0)

    def output(self, t, x, u, params):
        return u * self.generator.normal()


def local_clock(t, x, u, params):
    import time as clock
    return u + clock.monotonic()


GENERATOR = np.random.default_rng(0)


@pytest.mark.parametrize(("function", "text"), [
    (lambda t, x, u, params: u + time.time(), "reads the clock: .* the argument t"),
    (lambda t, x, u, params: u + perf_counter(), "reads the clock"),
    (local_clock, "reads the clock"),
    (lambda t, x, u, params: u + random.random(), "draws random numbers: .* an input"),
    (lambda t, x, u, params: u + np.random.rand(1),  # noqa: NPY002
     "draws random numbers"),
    (lambda t, x, u, params: u + GENERATOR.normal(size=1), "draws random numbers"),
    (NoisyGain().output, "changes from call to call"),
    (lambda t, x, u, params: u + datetime.datetime.now().timestamp(), "changes from call to call"),
    (Counter(), "changes from call to call"),
])
def test_what_a_program_would_freeze_is_refused(function, text):
    block = ct.nlsys(None, function, name="clock", inputs=1, outputs=1)
    with pytest.raises(TraceError, match=f"block 'clock', output function: .*{text}"):
        compile_diagram(block)


@pytest.mark.parametrize("engine", ["llvm", "python"])
def test_sign_of_zero_is_that_of_python_control(engine):
    def output(t, x, u, params):
        return np.array([np.arctan2(0 - u[0], 0 - u[1]), np.arctan2(0.0 + u[0], -1.0),
                         np.arctan2(0.0 * u[1], -1.0), np.copysign(1.0, u[0] - 0.0)])

    block = ct.nlsys(None, output, name="angle", inputs=2, outputs=4)
    loop = interconnect([block], [], inputs={"a": "angle.u[0]", "b": "angle.u[1]"},
                        outputs={f"y{k}": f"angle.y[{k}]" for k in range(4)}, name="loop")
    for diagram in (block, loop):
        program = compile_diagram(diagram, engine)
        with np.errstate(all="ignore"):
            for u in ([0.0, 0.0], [-0.0, 0.0], [0.0, -0.0], [-0.0, -1.0], [0.0, 1e300]):
                traced, expected = program.output(0.0, [], u), diagram.output(0.0, [], u)
                np.testing.assert_array_equal(traced, expected)


def test_wrong_number_of_outputs_is_refused():
    block = ct.nlsys(None, lambda t, x, u, params: np.array([u[0], u[0]]), name="two", inputs=1,
                     outputs=1)
    with pytest.raises(DiagramError, match="'two': its output function returns 2 values where 1"):
        compile_diagram(block)


def test_parameter_that_decides_is_part_of_the_program(make_block):
    def output(t, x, u, params):
        return u * params["block.gain"] if params["block.mode"] > 1 else -u

    for mode, sign in ((2.0, 3.0), (0.0, -1.0)):
        block = make_block("block", None, output, mode=mode, gain=3.0)
        program = compile_diagram(block, "python")
        assert program.output(0.0, [], [2.0]) == [2.0 * sign]
        with pytest.raises(DiagramError, match="'block.mode' is part of the program"):
            program.output(0.0, [], [2.0], {"block.mode": 1.0})


def test_each_function_runs_twice_to_see_that_it_repeats_itself(make_block):
    calls = []

    def update(t, x, u, params):
        calls.append("update")
        return -x + u

    def output(t, x, u, params):
        calls.append("output")
        return x

    blocks = [make_block(name, update, output, x=1) for name in ("one", "two")]
    chain = interconnect(blocks, [("two.u", "one.y")], inputs={"u": "one.u"},
                         outputs={"y": "two.y"}, name="chain")
    trace(chain)
    assert sorted(calls) == ["output"] * 4 + ["update"] * 4


def test_equal_expressions_are_one_object(loop):
    signals_of = trace(loop).signals
    assert signals_of["plant.u[0]"] is signals_of["pd.u[0]"] is signals_of["u[0]"]
    assert signals_of["pd.q[1]"] is signals_of["q[1]"]


def test_blocks_are_left_as_they_were(loop):
    before = loop.dynamics(0.3, np.arange(4.0), [1.0, -1.0])
    trace(loop)
    np.testing.assert_array_equal(loop.dynamics(0.3, np.arange(4.0), [1.0, -1.0]), before)


def test_nan_to_num_counts_as_in_numpy(make_block):
    block = make_block("clean", None, lambda t, x, u, params: np.nan_to_num(u, nan=7.0))
    program = compile_diagram(block)
    for value in (np.nan, np.inf, -np.inf, 1.5):
        assert program.output(0, [], [value])[0] == np.nan_to_num(value, nan=7.0)
