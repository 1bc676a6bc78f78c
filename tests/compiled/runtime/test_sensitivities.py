"""Derivatives of runs: against closed forms and central differences."""

import control as ct
import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from clie_blocks import paper
from clie_blocks.compiled import METHODS, compile_diagram
from clie_blocks.compiled.codegen.native import NativeEngine
from clie_blocks.compiled.ir.layout import Layout
from clie_blocks.compiled.ir.operations import OPERATIONS
from clie_blocks.compiled.ir.scalars import F, apply
from clie_blocks.compiled.ir.symbols import Graph
from clie_blocks.compiled.runtime import sensitivities
from clie_blocks.diagrams.clie_loop import CASES
from clie_blocks.diagrams.scripts.paper_experiment import Experiment
from clie_blocks.errors import ClieError, DivergedError

START = np.array([0.1, 0.1, -0.3, 0.4])  # far from the limits of the drive
CALL = {"duration": 1.0, "step": 0.02, "inputs": {"q_d": [0.3, -0.2]}, "every": 5}


def differences(run, value, step):
    """Fourth-order central differences of ``run(value)``."""
    ahead, behind, far, back = (run(value + k * step) for k in (1, -1, 2, -2))
    return (8 * (ahead - behind) - (far - back)) / (12 * step)


def entry(value, k, changed):
    value = np.array(value, float)
    value[k] = changed
    return value


@pytest.mark.parametrize("engine", ["llvm", "python"])
@pytest.mark.parametrize("method", ["ode1", "ode3", "ode5"])
def test_equals_central_differences(loop, engine, method):
    program = compile_diagram(loop, engine)
    call = {**CALL, "method": method, "initial_state": START, "log": ["u", "plant.dq"]}
    response, derivatives = program.sensitivities(["pd.gain", "plant.damping"], **call,
                                                  states="plant.*")
    run = program.run(**call)
    np.testing.assert_array_equal(response.outputs, run.outputs)
    np.testing.assert_array_equal(response.states, run.states)
    assert derivatives.columns == ["pd.gain", "plant.damping[0]", "plant.damping[1]",
                                   "plant.q[0]", "plant.q[1]", "plant.dq[0]", "plant.dq[1]"]
    assert derivatives.outputs.shape == (4, 7, 11) and derivatives.states.shape == (4, 7, 11)

    def outputs(**change):
        return program.run(**{**call, **change}).outputs

    expected = [differences(lambda gain: outputs(params={"pd.gain": gain}), 5.0, 1e-3)]
    damping = program.params["plant.damping"]
    expected += [differences(lambda one, k=k: outputs(
        params={"plant.damping": entry(damping, k, one)}), damping[k], 1e-3) for k in range(2)]
    expected += [differences(lambda one, k=k: outputs(initial_state=entry(START, k, one)),
                             START[k], 1e-3) for k in range(4)]
    for column, wanted in zip(derivatives.columns, expected):
        np.testing.assert_allclose(derivatives[column], wanted, rtol=1e-6, atol=1e-8,
                                   err_msg=column)


def test_thirteen_parameters_of_the_composite_loop():
    diagram = Experiment(CASES, case=2, plant="linear", velocity="measured").diagram()
    program = compile_diagram(diagram)
    noise = np.random.default_rng(0).normal(0, 1e-3, (2001, 2))
    call = {"duration": 0.2, "step": 1e-4, "every": 500, "initial_state": {
        "plant": np.full(4, 0.1)}, "inputs": {"q_d": paper.SET_POINT, "noise": noise,
                                             "pe": lambda t: 0.5 * np.sin(6.0 * t)}}
    derivatives = program.sensitivities("*", **call)[1]
    assert len(derivatives.columns) == 13
    column = 0
    for key, value in program.params.items():
        for k in range(np.size(value)):
            def run(changed, key=key, value=value, k=k):
                new = changed if np.ndim(value) == 0 else entry(value, k, changed)
                return program.run(**call, params={key: new}).states
            at = float(np.ravel(value)[k])
            wanted = differences(run, at, 3e-3 * max(abs(at), 1e-2))
            got = derivatives.states[:, column]
            scale = np.max(np.abs(wanted), axis=1, keepdims=True)
            error = np.abs(got - wanted) / np.where(scale > 0, scale, 1.0)
            assert np.max(error) < 1e-6, (derivatives.columns[column], np.max(error))
            column += 1


def test_closed_form(make_block):
    block = make_block("decay", lambda t, x, u, params: -params["decay.rate"] * x + 0 * u,
                       lambda t, x, u, params: x**2, x=1, rate=0.7)
    response, derivatives = compile_diagram(block).sensitivities(
        "decay.rate", 2.0, 1e-2, inputs={"u": 0.0}, initial_state=[3.0], states="decay.x[0]")
    t, x = response.time, 3.0 * np.exp(-0.7 * response.time)
    np.testing.assert_allclose(derivatives.states[0, 0], -t * x, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(derivatives["decay.rate"][0], -2 * t * x**2, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(derivatives["decay.x[0]"][0], 2 * x * x / 3.0, rtol=1e-9)


def test_discrete_time():
    block = ct.nlsys(lambda t, x, u, params: params["map.a"] * x * (1 - x),
                     lambda t, x, u, params: x, name="map", states=1, inputs=0, outputs=1,
                     dt=1.0, params={"map.a": 2.5})
    program = compile_diagram(block)
    call = {"duration": 6.0, "initial_state": [0.2]}
    derivatives = program.sensitivities("map.a", **call)[1]
    wanted = differences(lambda a: program.run(**call, params={"map.a": a}).outputs, 2.5, 1e-3)
    np.testing.assert_allclose(derivatives["map.a"], wanted, rtol=1e-8, atol=1e-12)


def test_the_branch_that_is_taken_counts_and_the_other_does_not(make_block):
    def law(t, x, u, params):
        k = params["law.k"]
        return np.array([
            np.where(u[0] > 0, k * u[0], np.sqrt(-k) * u[0]),  # the other branch is NaN
            np.clip(k * u[0], -1.0, 1.0), np.clip(k * u[0], -9.0, 9.0),
            np.sign(k * u[0]), np.floor(k), np.abs(-k), np.maximum(k, 2 * k), np.minimum(k, 7.0)])

    program = compile_diagram(make_block("law", None, law, y=8, k=1.5))
    derivatives = program.sensitivities("law.k", 0.1, 0.1, inputs={"u": 2.0})[1]
    np.testing.assert_array_equal(derivatives["law.k"][:, 0], [2, 0, 2, 0, 0, 1, 2, 1])


def test_more_columns_than_one_pass_takes(loop, monkeypatch):
    program = compile_diagram(loop)
    call = {"names": ["pd.gain", "plant.damping"], "states": "plant.*", **CALL}
    whole = program.sensitivities(**call)[1]
    monkeypatch.setattr(sensitivities, "WIDEST", 2)
    parts = program.sensitivities(**call)[1]
    np.testing.assert_allclose(parts.outputs, whole.outputs, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(parts.states, whole.states, rtol=1e-12, atol=1e-14)


def test_no_derivative_is_said(make_block):
    block = make_block("root", lambda t, x, u, params: np.sqrt(np.abs(x)) * params["root.k"] * u,
                       lambda t, x, u, params: 1 * x, x=1, k=1.0)
    program = compile_diagram(block)
    with pytest.raises(DivergedError, match="with respect to root.x.0. is no longer finite"):
        program.sensitivities([], 0.1, 0.01, inputs={"u": 0.0}, states="root.x")
    fast = compile_diagram(make_block("fast", lambda t, x, u, params: params["fast.k"] * x**2 + u,
                                      lambda t, x, u, params: 1 * x, x=1, k=1.0))
    with pytest.raises(DivergedError) as stop:
        fast.sensitivities("fast.k", 5.0, 0.01, inputs={"u": 0.0}, initial_state=[1.0])
    assert np.all(np.isfinite(stop.value.response.states)) and 0.9 < stop.value.time < 1.5


@pytest.mark.parametrize(("names", "states", "text"), [
    ("pd.gian", (), "no parameter 'pd.gian'; did you mean 'pd.gain'"),
    ("pd.gain", "plant.qq", "no state 'plant.qq'; did you mean 'plant.q'"),
    ((), (), "name at least one parameter or initial state")])
def test_mistakes_are_named(loop, names, states, text):
    with pytest.raises(ClieError, match=text):
        compile_diagram(loop).sensitivities(names, **CALL, states=states)


def test_a_parameter_that_decides_is_refused(make_block):
    block = make_block("law", None, lambda t, x, u, params: u if params["law.k"] > 0 else -u, k=1)
    with pytest.raises(ClieError, match="part of the program"):
        compile_diagram(block).sensitivities("law.k", 0.1, inputs={"u": 0.0})


SMOOTH = {
    "add": lambda a, b, c: (a, b), "sub": lambda a, b, c: (a, b), "mul": lambda a, b, c: (a, b),
    "div": lambda a, b, c: (a, apply("add", apply("mul", b, b), 0.5)),
    "sqrt": lambda a, b, c: (apply("add", apply("mul", a, a), 0.3),),
    "log": lambda a, b, c: (apply("add", apply("mul", a, a), 0.3),),
    "exp": lambda a, b, c: (apply("sin", a),),
    "pow": lambda a, b, c: (apply("add", apply("abs", a), 0.7), apply("tanh", b)),
    "arctan2": lambda a, b, c: (a, apply("add", apply("mul", b, b), 0.5)),
    "hypot": lambda a, b, c: (a, apply("add", b, 3.0)),
    "where": lambda a, b, c: (apply("lt", a, b), b, c),
    **{name: lambda a, b, c: (a, b) for name in ("maximum", "minimum")},
    **{name: lambda a, b, c: (a,) for name in ("abs", "neg", "sin", "cos", "tanh", "arctan",
                                               "arcsinh", "cbrt", "sign", "floor")}}
PROGRAMS = st.lists(st.tuples(st.sampled_from(sorted(SMOOTH)), *[st.integers(0, 10**6)] * 3),
                    min_size=5, max_size=25)


def symbolic(instructions, x):
    results = list(x)
    for name, *indices in instructions:
        a, b, c = (results[-1 - index % min(len(results), 8)] for index in indices)
        results.append(apply(name, *SMOOTH[name](a, b, c)))
    return results[3:]


def test_random_programs_against_differences():
    points = np.random.default_rng(4).uniform(-2, 2, (6, 3))
    compared = []

    @settings(max_examples=25, deadline=None, database=None, derandomize=True,
              phases=[Phase.generate], suppress_health_check=list(HealthCheck))
    @given(PROGRAMS)
    def check(instructions):
        graph = Graph()
        x = [graph.variable("x", k) for k in range(3)]
        roots = symbolic(instructions, x)
        seeds = [{x[k]: 1.0} for k in range(3)]
        slopes = [slope for seed in seeds for slope in sensitivities.tangents(roots, seed)]
        engine = NativeEngine(Layout([*roots, *slopes], [], {}, 0), METHODS["ode1"])

        def values(point):
            return engine.derivative(0.0, point, [], [])[:len(roots)]

        for point in points:
            found = engine.derivative(0.0, point, [], [])[len(roots):].reshape(3, -1)
            for k in range(3):
                rough, fine = (differences(lambda one, k=k, point=point: values(
                    entry(point, k, one)), point[k], step) for step in (2e-4, 1e-4))
                size = 1.0 + np.abs(fine) + np.abs(values(point))
                smooth = (np.abs(rough - fine) < 1e-8 * size) & (size < 1e6)
                compared.append(np.mean(smooth))
                np.testing.assert_allclose((found[k] / size)[smooth], (fine / size)[smooth],
                                           rtol=0, atol=1e-6)
    check()
    assert np.mean(compared) > 0.7  # the others lie at a kink or grow too steep


def test_every_operation_that_chooses_has_its_tangent():
    assert {name for name, operation in OPERATIONS.items() if operation.tangent} == {
        "where", "maximum", "minimum"}
    taken = OPERATIONS["where"].tangent(F, None, (True, 1.0, 2.0), (0.0, 5.0, np.nan))
    assert taken == 5.0
