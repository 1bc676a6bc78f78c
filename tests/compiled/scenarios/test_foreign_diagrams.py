"""Diagrams written for python-control alone are traced."""

import control as ct
import numpy as np
import pytest
from foreign_diagrams import TRACED

from clie_blocks.compiled import compile_diagram
from clie_blocks.signals import ports

CONTINUOUS = [name for name, build in TRACED.items() if name != "state_estimator"]


def program_of(name):
    diagram = TRACED[name]()
    return diagram, compile_diagram(diagram)


@pytest.mark.parametrize("name", TRACED)
def test_equals_python_control_at_random_points(name):
    diagram, program = program_of(name)
    random = np.random.default_rng(8)
    for _ in range(20):
        t, x, u = random.uniform(0, 5), random.normal(size=diagram.nstates), random.normal(
            size=diagram.ninputs)
        np.testing.assert_allclose(program.dynamics(t, x, u), diagram.dynamics(t, x, u),
                                   rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(program.output(t, x, u), diagram.output(t, x, u),
                                   rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", TRACED)
def test_operations_one_by_one_give_the_same(name):
    diagram, program = program_of(name)
    random = np.random.default_rng(9)
    one_by_one = program.interpreted()
    for _ in range(5):
        t, x, u = random.uniform(0, 5), random.normal(size=diagram.nstates), random.normal(
            size=diagram.ninputs)
        for kind in ("dynamics", "output"):
            np.testing.assert_allclose(getattr(one_by_one, kind)(t, x, u),
                                       getattr(program, kind)(t, x, u), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", CONTINUOUS)
def test_runs_as_input_output_response(name):
    diagram, program = program_of(name)
    x, u = np.linspace(0.2, 0.6, diagram.nstates), np.full(diagram.ninputs, 0.3)
    if name == "cruise_control":
        x, u = np.array([20.0, 0.1]), np.array([21.0, 0.05])
    if name == "predator_prey":
        x = np.array([25.0, 20.0])
    time = np.linspace(0, 2, 21)
    theirs = ct.input_output_response(
        diagram, time, np.tile(u[:, None], 21), x,
        solve_ivp_kwargs={"rtol": 1e-9, "atol": 1e-9, "max_step": 0.05})
    inputs = {base: u[where] for base, where in ports(diagram.input_labels).items()}
    ours = program.run(2.0, step=1e-3, inputs=inputs, initial_state=x, every=100)
    np.testing.assert_allclose(ours.outputs, theirs.outputs.reshape(ours.outputs.shape),
                               rtol=1e-5, atol=1e-6)


def test_the_adaptive_controller_learns():
    _, program = program_of("model_reference_adaptive_control")
    run = program.run(60.0, step=1e-2, inputs={"r": lambda t: np.sign(np.sin(2 * np.pi * t / 10))})
    error = np.abs(run.outputs[0] - run.outputs[1])
    assert np.max(error[run.time > 50]) < 0.5 * np.max(error[run.time < 10])
