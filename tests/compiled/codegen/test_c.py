"""The exported C file: clean under a strict compiler, and the same numbers as the LLVM program."""

import ctypes

import numpy as np
import pytest
from c_engine import shared_library

from clie_blocks import paper
from clie_blocks.compiled import compile_diagram
from clie_blocks.diagrams.clie_composite import clie_composite
from clie_blocks.filters import difference_filter
from clie_blocks.measurement import encoder


@pytest.fixture
def build(tmp_path):
    def compiled(program, method="ode5"):
        return shared_library(program.source("c", method), tmp_path)
    return compiled


def pointers(*arrays):
    return [array.ctypes.data_as(ctypes.c_void_p) for array in arrays]


def run_c(library, program, x, u, steps, step):
    """Start from x, take steps, and return the state and the outputs at the end."""
    params = np.zeros(sum(np.size(value) for value in program.params.values()) + 1)
    start, y = np.empty(len(program.states)), np.zeros(len(program.outputs))
    getattr(library, f"{program.name}_init")(*pointers(start, params))
    assert not start.any()
    x = x.copy()
    for k in range(steps):
        getattr(library, f"{program.name}_step")(
            ctypes.c_double(k * step), ctypes.c_double(step), *pointers(x, u, params))
    getattr(library, f"{program.name}_output")(
        ctypes.c_double(steps * step), *pointers(x, u, params, y))
    return x, y


@pytest.mark.parametrize("method", ["ode1", "ode4", "ode5"])
def test_composite_loop_equals_the_llvm_program(build, method):
    program = compile_diagram(clie_composite(paper.paper_arm(), paper.KP, paper.KD, 20.0, 1e-3))
    x, u = np.linspace(-0.2, 0.3, 22), np.array([0.1, 0.2, 0.3, -0.1, 0.01, -0.01])
    got = run_c(build(program, method), program, x, u, 200, 1e-3)
    run = program.run(0.2, step=1e-3, method=method, initial_state=x, every=200, inputs={
        "q_d": u[:2], "pe": u[2:4], "noise": u[4:]})
    np.testing.assert_allclose(got[0], run.states[:, -1], rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(got[1], run.outputs[:, -1], rtol=1e-11, atol=1e-13)


def test_discrete_filter_steps_by_sample(build):
    program = compile_diagram(difference_filter(1, 0.5))
    x, y = run_c(build(program), program, np.array([1.0, 2.0]), np.array([3.0]), 1, 0.5)
    np.testing.assert_array_equal(x, [3.0, 1.0])


def test_static_block_with_decisions(build):
    program = compile_diagram(encoder([0.1, 0.0]))
    _, y = run_c(build(program), program, np.zeros(0), np.array([0.26, 0.26]), 1, 1.0)
    np.testing.assert_allclose(y, [0.3, 0.26])


def test_header_names_the_signals_and_parameters():
    text = compile_diagram(difference_filter(2, 0.5)).source("c")
    assert "u[1]  q[1]" in text and "y[0]  dq[0]" in text and "velocity_filter_step" in text
    loop = clie_composite(paper.paper_arm(), paper.KP, paper.KD, 20.0, 1e-3)
    assert "double update_gamma;" in compile_diagram(loop).source("c")
