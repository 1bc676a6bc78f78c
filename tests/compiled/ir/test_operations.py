"""Every operation of the table against numpy, on every emitter; derivatives by differences."""

import ctypes
import itertools

import numpy as np
import pytest
from c_engine import CEngine

from clie_blocks.compiled.codegen.lane_layout import lanes
from clie_blocks.compiled.codegen.llvm import function
from clie_blocks.compiled.codegen.machine import Machine
from clie_blocks.compiled.codegen.methods import METHODS
from clie_blocks.compiled.codegen.native import NativeEngine
from clie_blocks.compiled.codegen.python import PythonEngine
from clie_blocks.compiled.ir.layout import Layout
from clie_blocks.compiled.ir.operations import OPERATIONS
from clie_blocks.compiled.ir.scalars import F, apply
from clie_blocks.compiled.ir.symbols import Graph

SPECIAL = [0.0, -0.0, 1.0, -1.0, 0.5, -2.5, 3.7, 1e300, -1e300, 5e-324, -2.2e-310, 1e-9,
           np.inf, -np.inf, np.nan, 710.5, -745.3, 1e17]
UNSIGNED_ZERO = {"maximum", "minimum"}  # numpy itself picks either zero, by processor


def roots():
    graph = Graph()
    x = [graph.variable("x", k) for k in range(3)]
    return [apply("where", apply(name, *x[:op.arity]), 1.0, 0.0) if op.boolean
            else apply(name, *x[:op.arity]) for name, op in OPERATIONS.items()]


def points():
    random = np.random.default_rng(0).standard_normal((40, 3)) * 3
    pairs = [(a, b, c) for (a, b), c in zip(itertools.product(SPECIAL, repeat=2),
                                            itertools.cycle(SPECIAL[::-1]))]
    return [*map(np.array, pairs), *random]


def expected(chosen):
    """One row of results per point; arrays, for numpy takes a scalar power 0.5 as a root."""
    columns = np.array(chosen).T
    with np.errstate(all="ignore"):
        return np.array([op.numpy(*columns[:op.arity]).astype(float)
                         for op in OPERATIONS.values()]).T


ENGINES = {"llvm": NativeEngine, "python": PythonEngine, "c": CEngine}


def agree(got, wanted, point):
    for name, one, two in zip(OPERATIONS, got, wanted):
        where = f"{name}{tuple(point[:OPERATIONS[name].arity])}"
        np.testing.assert_allclose(one, two, rtol=1e-15, atol=0, err_msg=where)
        if name not in UNSIGNED_ZERO and two == 0:
            assert np.signbit(one) == np.signbit(two), where


def test_the_text_of_arrays_equals_numpy():
    words = {name: operation.numpy for name, operation in OPERATIONS.items()} | {
        f"logical_{name}": OPERATIONS[name].numpy for name in ("and", "or", "not")}
    columns = np.array(points()).T
    operands = dict(zip("abc", columns, strict=True))
    for name, operation in OPERATIONS.items():
        given = operands | {"a": columns[0] > 0.0, "b": columns[1] > 0.0} if name in (
            "and", "or", "not") else operands | {"a": columns[0] > 0.0} if name == "where" else (
            operands)
        text = operation.of_arrays.format("a", "b", "c")
        with np.errstate(all="ignore"):
            np.testing.assert_array_equal(
                eval(text, words, given),
                operation.numpy(*[given[one] for one in "abc"[:operation.arity]]), err_msg=name)


@pytest.mark.parametrize("emitter", ENGINES)
def test_every_operation_equals_numpy(emitter):
    engine = ENGINES[emitter](Layout(roots(), [], {}, 0), METHODS["ode1"])
    for point, wanted in zip(points(), expected(points())):
        agree(engine.derivative(0.0, point, [], []), wanted, point)


@pytest.mark.parametrize("width", [2, 4, 8])
def test_lanes_compute_the_same_as_one_set(width):
    memory = lanes(width, len(OPERATIONS), 0, [])
    text, declarations = function("derivative", roots(), "x", memory=memory)
    machine = Machine("\n".join([*sorted(declarations), text]), ["derivative"])
    call = machine.function("derivative", ctypes.c_double, *[ctypes.c_void_p] * 4)
    chosen = points()[::7]
    wanted = expected(chosen)
    for start in range(0, len(chosen) - width + 1, width):
        side_by_side = np.array(chosen[start:start + width])
        x, result = np.ascontiguousarray(side_by_side.T), np.zeros((len(OPERATIONS), width))
        call(0.0, x.ctypes.data, 0, 0, result.ctypes.data)
        for lane, point in enumerate(side_by_side):
            agree(result[:, lane], wanted[start + lane], point)


SMOOTH = {"arcsin": 0.3, "arccos": 0.3, "arctanh": 0.3, "arccosh": 1.7}


@pytest.mark.parametrize("name", [name for name, op in OPERATIONS.items() if not op.boolean])
def test_derivative_equals_differences(name):
    operation = OPERATIONS[name]
    point = np.array([SMOOTH.get(name, 1.3), 0.7, 0.4])
    if name == "where":
        point = np.array([1.0, 0.7, 0.4])
    arity = operation.arity
    operands = [float(value) for value in point[:arity]]
    partials = operation.partials(F, apply(name, *operands), *operands)
    assert len(partials) == arity
    for k in range(1 if name == "where" else 0, arity):
        step = np.zeros(3)
        step[k] = 1e-6
        ahead, behind = (float(operation.numpy(*(point + sign * step)[:arity]))
                         for sign in (1, -1))
        np.testing.assert_allclose(partials[k], (ahead - behind) / 2e-6, rtol=1e-6, atol=1e-8)
