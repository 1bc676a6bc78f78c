"""Parameter sets side by side: every lane is the single run, whatever happens in the others."""

import contextlib
import os
import threading
import tracemalloc

import control as ct
import numpy as np
import pytest

from clie_blocks.compiled import compile_diagram, held_normal, reduce
from clie_blocks.compiled.codegen import vector_math
from clie_blocks.compiled.codegen.machine import lane_width, register_width
from clie_blocks.compiled.runtime import api, recorder, simulate
from clie_blocks.compiled.runtime.batch import lanes_and_threads
from clie_blocks.errors import ClieError
from clie_blocks.signals import DiagramError

ROWS = np.random.default_rng(0).standard_normal((61, 2))
CALL = {"duration": 0.6, "step": 0.01, "inputs": {"q_d": ROWS}}
GAINS = np.linspace(1.0, 8.0, 21)
DAMPING = np.random.default_rng(1).uniform(0.1, 2.0, (21, 2))


@pytest.fixture
def program(loop):
    return compile_diagram(loop)


def single(program, k, **call):
    return program.run(**CALL, **call, params={"pd.gain": GAINS[k], "plant.damping": DAMPING[k]})


@pytest.mark.parametrize("engine", ["llvm", "python"])
@pytest.mark.parametrize("every", [1, 7])
def test_batch_equals_single_runs(loop, engine, every):
    program = compile_diagram(loop, engine)
    batch = program.batch(**CALL, params={"pd.gain": GAINS, "plant.damping": DAMPING},
                          log=["u", "plant.dq[1]"], every=every)
    assert len(batch) == 21 and batch.outputs.shape == (21, 3, 60 // every + 1)
    assert batch.output_labels == ["u[0]", "u[1]", "plant.dq[1]"]
    for k in range(21):
        run = single(program, k, log=["u", "plant.dq[1]"], every=every)
        np.testing.assert_allclose(batch.outputs[k], run.outputs, rtol=1e-12, atol=1e-13)
        np.testing.assert_array_equal(batch.time, run.time)
    last = single(program, 20).states[:, -1]
    np.testing.assert_allclose(batch.final_state[20], last, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("runs", [1, 2, 3, 8, 17])
@pytest.mark.parametrize("threads", [1, 2, 5])
def test_any_number_of_runs_and_threads(program, runs, threads):
    batch = program.batch(**CALL, params={"pd.gain": GAINS[:runs]}, threads=threads)
    for k in (0, runs - 1):
        run = program.run(**CALL, params={"pd.gain": GAINS[k]})
        np.testing.assert_allclose(batch.outputs[k], run.outputs, rtol=1e-12, atol=1e-13)


def test_only_the_end_may_be_kept(program):
    batch = program.batch(**CALL, params={"pd.gain": GAINS}, log=[], every=100)
    assert batch.outputs.shape == (21, 0, 1) and batch.reduced == {}
    last = program.run(**CALL, params={"pd.gain": GAINS[4]}).states[:, -1]
    np.testing.assert_allclose(batch.final_state[4], last, rtol=1e-12, atol=1e-13)


def test_initial_states_run_by_run(program):
    starts = np.random.default_rng(2).standard_normal((5, 4))
    both = (program.batch(**CALL, initial_state=starts),
            program.batch(**CALL, initial_state={"plant": starts}))
    common = program.batch(**CALL, initial_state=starts[3], params={"pd.gain": [5.0, 5.0]})
    run = program.run(**CALL, initial_state=starts[3])
    for outputs in (both[0].outputs[3], both[1].outputs[3], *common.outputs):
        np.testing.assert_allclose(outputs, run.outputs, rtol=1e-12, atol=1e-13)


def test_noise_is_the_same_for_all_runs_and_as_in_a_single_one(program):
    call = {"duration": 5.0, "step": 1e-3, "inputs": {"q_d": held_normal(1.0, 3)}, "every": 100}
    batch = program.batch(**call, params={"pd.gain": [2.0, 2.0, 4.0]})
    np.testing.assert_array_equal(batch.outputs[0], batch.outputs[1])
    run = program.run(**call, params={"pd.gain": 4.0})
    np.testing.assert_allclose(batch.outputs[2], run.outputs, rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize("buffer", [1 << 20, 1])
def test_reductions_equal_those_of_the_whole_run(program, monkeypatch, buffer):
    monkeypatch.setattr("clie_blocks.compiled.runtime.batch.BUFFER", buffer)

    def power(state, time, values):
        assert values.shape[1:] == (2, lane_width()) or len(time) == 1
        return (0.0 if state is None else state) + (values**2).sum(axis=(0, 1))

    window = {"start": 0.1, "end": 0.5}
    batch = program.batch(**CALL, params={"pd.gain": GAINS, "plant.damping": DAMPING}, reduce={
        "mean": reduce.mean("q", **window),
        "mse": reduce.mean_square("plant.q", minus="pd.q_d", **window),
        "low": reduce.minimum("u", **window), "high": reduce.maximum("u[1]", **window),
        "area": reduce.integral("q", **window), "last": reduce.final("q"),
        "then": reduce.final("q", end=0.3), "power": reduce.fold("u", power)}, threads=1)
    assert batch.outputs.shape == (21, 0, 61)
    for k in (0, 7, 20):
        run = single(program, k, log=["q", "u", "pd.q_d"])
        inside = (run.time > 0.095) & (run.time < 0.505)
        q, u, q_d = run.outputs.reshape(3, 2, -1)
        expected = {
            "mean": q[:, inside].mean(axis=1), "mse": ((q - q_d)[:, inside]**2).mean(axis=1),
            "low": u[:, inside].min(axis=1), "high": u[1, inside].max(), "last": q[:, -1],
            "area": np.trapezoid(q[:, inside], run.time[inside]), "then": q[:, 30],
            "power": (u**2).sum()}
        for name, value in expected.items():
            np.testing.assert_allclose(batch[name][k], value, rtol=1e-12, atol=1e-13,
                                       err_msg=name)


def test_a_run_that_diverges_disturbs_no_other(make_block):
    block = make_block("runaway", lambda t, x, u, params: params["runaway.rate"] * x**2 - x,
                       lambda t, x, u, params: 1 * x, x=1, rate=0.0)
    program = compile_diagram(block)
    call = {"duration": 3.0, "step": 1e-3, "inputs": {"u": 0.0}, "initial_state": [1.0]}
    rates = np.array([0.1, 50.0, -1.0, np.nan, 0.5, np.inf, 0.0])
    batch = program.batch(**call, params={"runaway.rate": rates},
                          reduce={"last": reduce.final("y[0]"), "mean": reduce.mean("y[0]")})
    np.testing.assert_array_equal(batch.diverged, [False, True, False, True, False, True, False])
    for k in np.flatnonzero(~batch.diverged):
        run = program.run(**call, params={"runaway.rate": rates[k]})
        np.testing.assert_allclose(batch["last"][k], run.outputs[0, -1], rtol=1e-13)
        np.testing.assert_allclose(batch["mean"][k], run.outputs[0].mean(), rtol=1e-12)


def test_two_programs_in_two_threads_do_not_disturb_each_other(loop, make_block):
    other = compile_diagram(make_block("lag", lambda t, x, u, params: params["lag.rate"] * (u - x),
                                       lambda t, x, u, params: 1 * x, x=1, rate=1.0))
    program, found = compile_diagram(loop), {}

    def first():
        return program.batch(20.0, 1e-3, inputs={"q_d": 1.0}, params={"pd.gain": GAINS},
                             every=1000).outputs

    def second():
        return other.batch(20.0, 1e-3, inputs={"u": np.sin}, params={"lag.rate": GAINS},
                           every=1000).outputs

    alone = {"first": first(), "second": second()}
    threads = [threading.Thread(target=lambda job=job: found.update({job.__name__: job()}))
               for job in (first, second)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for name, expected in alone.items():
        np.testing.assert_array_equal(found[name], expected)


@pytest.mark.parametrize(("call", "text"), [
    ({"params": {"pd.gian": GAINS}}, "did you mean 'pd.gain'"),
    ({"params": {"pd.gain": GAINS, "plant.damping": DAMPING[:4]}},
     r"parameter 'plant.damping' has 4 values for 21 runs; .* \[\[\.\.\.\]\]"),
    ({"params": {"plant.damping": np.ones((21, 3))}}, r"needs shape \(21,\) or \(21, 2\)"),
    ({"params": {"pd.gain": "high"}}, "must be numbers, got 'high'"),
    ({"params": {"pd.gain": []}}, "a batch of no runs"),
    ({"initial_state": np.ones((3, 5))}, "needs 4 numbers per run"),
    ({"initial_state": {"plnt": [1.0]}}, "did you mean 'plant'"),
    ({"reduce": {"a": reduce.mean("q_e")}}, "no signal 'q_e'"),
    ({"reduce": {"a": reduce.mean("q", minus="u[0]")}}, "has 2 signals and 'u"),
    ({"reduce": {"a": reduce.mean("q", start=0.605)}}, "no row lies between 0.605 s and inf s"),
    ({"reduce": {"a": np.mean}}, r"must come from clie_blocks.compiled.reduce"),
    ({"reduce": {"a": reduce.fold("q", lambda state, time, values: 1.0)}}, "last axis must be"),
    ({"threads": 0}, "threads must be a whole number"),
])
def test_mistakes_are_named(program, call, text):
    with pytest.raises(DiagramError if "reduce" not in call and "threads" not in call
                       else ClieError, match=text):
        program.batch(**CALL, **call)


def test_a_result_that_is_not_there_is_named(program):
    batch = program.batch(**CALL, reduce={"error": reduce.mean("q")})
    with pytest.raises(ClieError, match="no reduction 'eror'; did you mean 'error'"):
        batch["eror"]
    derivatives = program.sensitivities("pd.gain", **CALL)[1]
    with pytest.raises(ClieError, match="'pd.gian'; did you mean 'pd.gain'"):
        derivatives["pd.gian"]


def test_rows_that_fit_no_memory_are_refused_before_the_run(program, monkeypatch):
    monkeypatch.setattr(recorder, "ROOM", 1000)
    with pytest.raises(ClieError, match="keep fewer with log= or every=, or use reduce="):
        program.batch(**CALL, params={"pd.gain": GAINS})


def test_widths_leave_no_thread_idle():
    assert lanes_and_threads(1000, 2, 16) == (16, 2)
    assert lanes_and_threads(16, 2, 16) == (8, 2)
    assert lanes_and_threads(3, 8, 16) == (1, 3)
    assert lanes_and_threads(1, None, 16) == (1, 1)
    assert 1 <= lanes_and_threads(10**6, None, 8)[1] <= os.cpu_count()


def test_a_large_program_takes_one_register_of_lanes_and_runs_as_before(program, monkeypatch):
    wide = program.batch(**CALL, params={"pd.gain": GAINS}, log="plant.q")
    assert program.lanes == lane_width()
    monkeypatch.setattr(api, "MANY", program.operations - 1)
    assert program.lanes == register_width()
    narrow = program.batch(**CALL, params={"pd.gain": GAINS}, log="plant.q")
    np.testing.assert_allclose(narrow.outputs, wide.outputs, rtol=1e-12)


def test_a_reduced_batch_keeps_nothing_long(program):
    call = {"step": 1e-3, "inputs": {"q_d": held_normal(1.0, 0)}, "params": {"pd.gain": GAINS},
            "reduce": {"error": reduce.mean_square("q", minus="pd.q_d")}, "threads": 1}
    program.batch(1.0, **call)
    tracemalloc.start()
    batch = program.batch(100.0, **call)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert batch["error"].shape == (21, 2)
    assert peak < 10e6  # the rows of all runs would fill 67e6 bytes


def test_a_long_batch_reports_its_progress(program, monkeypatch):
    reported, labels = [], []

    @contextlib.contextmanager
    def recorder(label, total):
        labels.append((label, total))
        yield reported.append

    monkeypatch.setattr(simulate, "progress", recorder)
    monkeypatch.setattr(simulate, "PATIENCE", -1.0)
    program.batch(10.0, 1e-4, inputs={"q_d": 1.0}, params={"pd.gain": GAINS}, every=1000)
    assert labels == [("running loop 21 times", 100_000)]
    assert sum(reported) == 100_000 and len(reported) > 3


FUNCTIONS = (np.sin, np.cos, np.exp, np.tanh, np.arctan)
ANGLES = np.array([0.0, -0.0, 0.7, -3.0, 1e5, -800.0, np.inf, -np.inf, np.nan, 1e-300, 30.0, 2.0,
                   -1e-8, 1.0, 5.0, -0.5])


@pytest.mark.parametrize("runs", [2, 3, 4, 8, 13, 16])
@pytest.mark.parametrize("library", [True, False])
def test_elementary_functions_of_lanes_are_those_of_numpy(monkeypatch, runs, library):
    if not library:
        monkeypatch.setattr(vector_math, "_library", lambda: None)
    block = ct.nlsys(None, lambda t, x, u, params: np.stack(
        [function(params["angle"]) for function in FUNCTIONS]), inputs=["u"], name="functions",
        outputs=[f"y[{k}]" for k in range(len(FUNCTIONS))], params={"angle": 1.0})
    angle = ANGLES[-runs:]
    batch = compile_diagram(block).batch(
        1e-3, step=1e-3, inputs={"u": 0.0}, params={"angle": angle}, threads=1)
    with np.errstate(all="ignore"):
        expected = np.stack([function(angle) for function in FUNCTIONS], axis=1)
    np.testing.assert_allclose(batch.outputs[:, :, 0], expected, rtol=2e-15)
