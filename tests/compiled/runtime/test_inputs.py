import numpy as np
import pytest

from clie_blocks.compiled import METHODS, InputError, compile_diagram, held_normal
from clie_blocks.compiled import program as program_module
from clie_blocks.compiled.ir.layout import layout
from clie_blocks.compiled.runtime import simulate

STEP = 1e-2
TIMES = np.arange(50) * STEP


@pytest.fixture(params=["llvm", "python"])
def program(loop, request):
    return compile_diagram(loop, request.param)


def test_rows_are_held_over_the_stages(loop, program, plain_loop):
    rows = np.random.default_rng(0).standard_normal((50, 2))
    run = program.run(0.5, step=STEP, inputs={"q_d": rows})
    expected = plain_loop(loop, METHODS["ode5"], rows, STEP)
    np.testing.assert_allclose(run.states.T, expected, rtol=0, atol=1e-13)
    np.testing.assert_array_equal(run.inputs[:, :-1].T, rows)


def test_holding_is_not_interpolating(loop, program):
    """What python-control does between rows gives another motion, by far more than round-off."""
    import control as ct
    rows = np.random.default_rng(0).standard_normal((51, 2))
    held = program.run(0.5, step=STEP, inputs={"q_d": rows})
    other = ct.input_output_response(loop, np.arange(51) * STEP, rows.T,
                                     solve_ivp_kwargs={"rtol": 1e-9, "atol": 1e-9})
    assert np.max(np.abs(held.states - other.states)) > 1e-3


def test_functions_of_time_are_evaluated_at_every_stage(loop, program, plain_loop):
    def reference(t):
        return np.array([np.sin(3 * t), np.cos(t) ** 2])

    run = program.run(0.5, step=STEP, inputs={"q_d": reference})
    x = np.zeros(4)
    method = METHODS["ode5"]
    for t in TIMES:
        k = []
        for weights, c in zip(method.a, method.c):
            y = x + STEP * sum((w * rate for w, rate in zip(weights, k)), np.zeros(4))
            k.append(loop.dynamics(t + c * STEP, y, reference(t + c * STEP)))
        x = x + STEP * sum(w * rate for w, rate in zip(method.b, k))
    np.testing.assert_allclose(run.states[:, -1], x, rtol=0, atol=1e-13)
    np.testing.assert_allclose(run.inputs, np.array([reference(t) for t in run.time]).T,
                               atol=1e-15)


def test_constants_by_port_and_by_label(program):
    one = program.run(0.1, step=STEP, inputs={"q_d": [0.5, 0.2]})
    two = program.run(0.1, step=STEP, inputs={"q_d[1]": 0.2, "q_d[0]": 0.5})
    rows = program.run(0.1, step=STEP, inputs={"q_d": np.tile([0.5, 0.2], (10, 1))})
    np.testing.assert_array_equal(one.states, two.states)
    np.testing.assert_array_equal(one.states, rows.states)


def test_one_number_and_one_function_serve_all_signals(program):
    np.testing.assert_array_equal(
        program.run(0.1, step=STEP, inputs={"q_d": 0.5}).inputs, np.full((2, 11), 0.5))
    run = program.run(0.1, step=STEP, inputs={"q_d": lambda t: np.sin(t)})
    np.testing.assert_allclose(run.inputs, np.tile(np.sin(run.time), (2, 1)), rtol=1e-15)


def test_noise_has_its_variance_and_its_seed(program):
    source = held_normal([4.0, 1e-4], seed=7)
    one, two = (program.run(40.0, step=STEP, inputs={"q_d": source}) for _ in range(2))
    np.testing.assert_array_equal(one.inputs, two.inputs)
    np.testing.assert_allclose(np.var(one.inputs, axis=1), [4.0, 1e-4], rtol=0.1)
    other = program.run(1.0, step=STEP, inputs={"q_d": held_normal([4.0, 1e-4], seed=8)})
    assert np.all(other.inputs[0] != one.inputs[0, :101])


def test_noise_is_held_over_its_period(program):
    run = program.run(1.0, step=STEP, inputs={"q_d": held_normal(1.0, 0, period=0.05)})
    held = run.inputs[:, :100].reshape(2, 20, 5)
    assert np.all(held == held[:, :, :1])
    assert np.all(np.diff(held[:, :, 0]) != 0)


def test_chunks_do_not_show(loop, monkeypatch):
    program = compile_diagram(loop)
    job = {"inputs": {"q_d": held_normal(1.0, 3, period=3 * STEP)}, "every": 7, "step": STEP}
    whole = program.run(10.0, **job)
    for size in (1, 13, 999, 1000):
        monkeypatch.setattr(simulate, "CHUNK", size)
        parts = program.run(10.0, **job)
        np.testing.assert_array_equal(parts.states, whole.states)
        np.testing.assert_array_equal(parts.inputs, whole.inputs)
        np.testing.assert_array_equal(parts.outputs, whole.outputs)


def branching(t):
    return 1.0 if t > 0.5 else 0.0


@pytest.mark.parametrize(("inputs", "text"), [
    (None, r"nothing drives the diagram input 'q_d'; give inputs=\{'q_d': \.\.\.\}"),
    ({"q_d[0]": 1.0}, "nothing drives the diagram input 'q_d'"),
    ({"qd": 1.0}, r"no input 'qd'; did you mean 'q_d'\?"),
    ({"q_d": 0.0, "q_d[1]": 1.0}, r"'q_d\[1\]' is given twice"),
    ({"q_d": np.zeros(3)}, r"shape \(3,\) but needs \(2,\) .* or \(10, 2\)"),
    ({"q_d": np.zeros((2, 10))}, "transposed"),
    ({"q_d": np.zeros((9, 2))}, r"\(10, 2\) for one row per step"),
    ({"q_d": "fast"}, "must be numbers"),
    ({"q_d": branching}, r"function of time of input 'q_d' cannot be traced.*one row per step"),
    ({"q_d": lambda t: np.zeros(3)}, "returns 3 values for 2 signals"),
    ({"q_d": held_normal(1.0, 0, period=0.015)}, "not a multiple of the step"),
])
def test_wrong_inputs_are_refused(program, inputs, text):
    with pytest.raises(InputError, match=text):
        program.run(0.1, step=STEP, inputs=inputs)


@pytest.mark.parametrize("variance", [-1.0, np.nan, [1.0, -1e-9]])
def test_impossible_variance_is_refused(variance):
    with pytest.raises(InputError, match="variance must be finite and not negative"):
        held_normal(variance, seed=0)


def test_a_program_is_arranged_once_for_inputs_that_are_alike(loop, monkeypatch):
    """Thousands of runs with one excitation, as `clie bounds` makes, wait for the first only."""
    arranged = []

    def counted(trace, driven=None):
        arranged.append(driven)
        return layout(trace, driven)

    monkeypatch.setattr(program_module, "layout", counted)
    program = compile_diagram(loop)
    arranged.clear()

    def last(amplitude, offset=0.0):
        run = program.run(0.5, step=STEP, inputs={
            "q_d": lambda t: [amplitude * np.sin(t), offset]})
        return run.states[:, -1]

    first, other = last(1.0), last(2.0)
    assert len(arranged) == 2 and np.max(np.abs(first - other)) > 1e-6
    np.testing.assert_array_equal(last(1.0), first)
    assert len(arranged) == 2
    last(0.0, -0.0)
    assert len(arranged) == 3
    last(0.0, 0.0)
    assert len(arranged) == 4  # zeros of two signs are two inputs
