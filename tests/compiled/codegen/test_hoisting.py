"""What a run computes once: constants of its parameters, and no angle that has lost its digits."""

import control as ct
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clie_blocks.compiled import compile_diagram
from clie_blocks.compiled.cache.cached_program import cached_program, source_digest
from clie_blocks.compiled.codegen.hoisting import LOST, hoisted
from clie_blocks.compiled.ir.symbols import topological, variables

pytest.importorskip("llvmlite")


def update(t, x, u, params):
    """A pendulum with a gear, whose damping has two regimes chosen by a parameter."""
    inertia, rate, ratio = params["inertia"], params["rate"], params["ratio"]
    damping = np.where(rate > 1.0, np.exp(-rate), rate / inertia)
    return np.array([
        x[0] + 0.01 * x[1],
        x[1] + 0.01 * (u[0] - damping * x[1] - np.sin(ratio * x[0]) / ratio) / inertia
        - 0.01 * x[1] * abs(x[1]) / inertia])


def pendulum():
    return ct.nlsys(update, None, inputs=["u"], outputs=["q", "w"], states=2, dt=0.01,
                    params={"inertia": 2.0, "rate": 0.5, "ratio": 3.0}, name="pendulum")


def step_of(program):
    return hoisted(program._layout)


def test_a_step_divides_by_no_parameter():
    apart = step_of(compile_diagram(pendulum()))
    operations = [node.op for node in topological(apart.layout.derivatives)]
    assert not {"div", "exp"} & set(operations)
    assert {kind for kind, _ in variables(apart.constants)} == {"p"}
    assert {("x", 0), ("x", 1), ("u", 0)} <= variables(apart.layout.derivatives)
    assert variables(apart.layout.derivatives) & {("c", k) for k in range(len(apart.constants))}


def test_a_constant_differs_between_lanes_where_one_of_its_parameters_does():
    apart = step_of(compile_diagram(pendulum()))
    of_parameters = [{index for _, index in variables([one])} for one in apart.constants]
    for own in ([True, False, False], [False, True, False], [False, False, True]):
        expected = tuple(own.index(True) in used for used in of_parameters)
        assert apart.varying(own) == expected


@given(st.lists(st.tuples(st.floats(0.1, 10.0), st.floats(0.0, 3.0), st.floats(0.2, 9.0)),
                min_size=1, max_size=19))
def test_runs_follow_those_of_the_optimised_program(programs, sets):
    inertia, rate, ratio = map(np.array, zip(*sets))
    params = {"inertia": inertia, "rate": rate, "ratio": ratio}
    brief, full = (program.batch(0.3, inputs={"u": 0.7}, params=params, threads=1)
                   for program in programs)
    np.testing.assert_allclose(brief.outputs, full.outputs, rtol=1e-12, atol=1e-13)


@pytest.fixture(scope="module")
def programs():
    identity = source_digest("clie_blocks.compiled") + __name__
    return cached_program(identity, pendulum), compile_diagram(pendulum())


def test_a_run_that_has_diverged_ends_in_nan_and_leaves_the_others_alone(programs):
    starts = np.array([[0.1, 0.0], [2 * LOST, 0.0], [0.4, 0.0]])
    done = programs[0].batch(0.2, inputs={"u": 0.0}, initial_state=starts, threads=1)
    np.testing.assert_array_equal(done.diverged, [False, True, False])
    alone = programs[0].batch(0.2, inputs={"u": 0.0}, initial_state=starts[::2], threads=1)
    np.testing.assert_array_equal(done.outputs[::2], alone.outputs)
