"""Random expression graphs: every emitter agrees with numpy in every bit.

Only operations that are rounded correctly take part, so there is nothing to tolerate; elementary
functions are compared one by one in test_operations.
"""

import numpy as np
import pytest
from c_engine import CEngine
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from clie_blocks.compiled.codegen.lane_layout import lanes
from clie_blocks.compiled.codegen.methods import METHODS
from clie_blocks.compiled.codegen.native import NativeEngine
from clie_blocks.compiled.codegen.python import PythonEngine
from clie_blocks.compiled.ir.layout import Layout
from clie_blocks.compiled.ir.operations import OPERATIONS
from clie_blocks.compiled.ir.scalars import apply, number
from clie_blocks.compiled.ir.symbols import Graph

EXACT = ("add sub mul div neg abs sqrt floor ceil trunc rint sign fmod copysign lt le gt ge eq ne "
         "and or not where").split()
VALUES = [0.0, -0.0, 1.0, -1.5, 3.0, 0.1, 1e300, -1e-300, 5e-324, np.inf, -np.inf, np.nan]
POINTS = np.array(np.meshgrid(VALUES, VALUES[::2], VALUES[::3])).reshape(3, -1)
CONSTANTS = [0.5, -2.0, 3.0, 1e-3, 0.0, -0.0, 1.0, -1.0]  # the last four invite simplifications
LOGIC = {"and": (0, 1), "or": (0, 1), "not": (0,), "where": (0,)}  # operands taken as truth
# one instruction: an operation, three earlier results, and a constant in place of one of them
INSTRUCTIONS = st.lists(
    st.tuples(st.sampled_from(EXACT), st.tuples(*[st.integers(0, 10**6)] * 3),
              st.none() | st.sampled_from(CONSTANTS)), min_size=20, max_size=50)


def operands(name, indices, constant, results):
    chosen = [results[-1 - index % min(len(results), 12)] for index in indices]
    if constant is not None and name not in LOGIC:
        chosen[indices[2] % 2 if OPERATIONS[name].arity > 1 else 1] = constant
    return chosen[:OPERATIONS[name].arity]


def symbolic(instructions, x):
    results = list(x)
    for name, indices, constant in instructions:
        results.append(apply(name, *operands(name, indices, constant, results)))
    return [number(result) for result in results]


def numeric(instructions):
    results = list(POINTS)
    with np.errstate(all="ignore"):
        for name, indices, constant in instructions:
            values = [np.full(POINTS.shape[1], value) if isinstance(value, float) else
                      value.astype(bool if k in LOGIC.get(name, ()) else float)
                      for k, value in enumerate(operands(name, indices, constant, results))]
            results.append(OPERATIONS[name].numpy(*values))
    return np.array([result.astype(float) for result in results])


class Lanes:
    """Eight points side by side; the one asked for in a lane of its own, among others."""

    def __init__(self, layout, method):
        self.engine = NativeEngine(layout, method, lanes(8, layout.nx, 0, []))
        self.lane = 0

    def derivative(self, t, x, u, p):
        self.lane = (self.lane + 3) % 8
        points = np.roll(POINTS[:, :8], self.lane, axis=1)
        points[:, self.lane] = x
        return self.engine.derivative(t, points, u, p).reshape(-1, 8)[:, self.lane]


@pytest.mark.parametrize(("engine", "examples"), [
    (NativeEngine, 20), (Lanes, 12), (PythonEngine, 30), (CEngine, 12)])
def test_random_programs_equal_numpy(engine, examples):
    @settings(max_examples=examples, deadline=None, database=None, derandomize=True,
              phases=[Phase.generate],  # shrinking would compile for minutes
              suppress_health_check=list(HealthCheck))
    @given(INSTRUCTIONS)
    def check(instructions):
        graph = Graph()
        roots = symbolic(instructions, [graph.variable("x", k) for k in range(3)])
        program = engine(Layout(roots, [], {}, 0), METHODS["ode1"])
        expected = numeric(instructions)
        for column in range(0, POINTS.shape[1], 3):
            got, wanted = program.derivative(0.0, POINTS[:, column], [], []), expected[:, column]
            np.testing.assert_array_equal(got, wanted)
            is_zero = wanted == 0
            np.testing.assert_array_equal(np.signbit(got[is_zero]), np.signbit(wanted[is_zero]))
    check()
