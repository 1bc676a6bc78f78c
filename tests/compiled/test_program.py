import subprocess
import sys

import control as ct
import numpy as np
import pytest

from clie_blocks.compiled import METHODS, Program, compile_diagram
from clie_blocks.errors import ClieError, DivergedError
from clie_blocks.signals import DiagramError

DRIVE = {"q_d": [1.0, -0.5]}


@pytest.mark.parametrize("engine", ["llvm", "python"])
@pytest.mark.parametrize("method", METHODS)
def test_run_equals_a_plain_loop_over_dynamics(loop, plain_loop, engine, method):
    program, x = compile_diagram(loop, engine), np.array([0.1, 0.2, -0.3, 0.4])
    params = {"plant.damping": [0.3, 0.6], "pd.gain": 2.0}
    run = program.run(1.0, step=0.02, method=method, inputs=DRIVE, initial_state=x,
                      params=params)
    expected = plain_loop(loop, METHODS[method], np.tile(DRIVE["q_d"], (50, 1)), 0.02, x, params)
    np.testing.assert_allclose(run.states.T, expected, rtol=0, atol=1e-13)
    np.testing.assert_allclose(
        run.outputs[:, -1], loop.output(1.0, expected[-1], DRIVE["q_d"], params=params),
        atol=1e-12)


def test_response_is_python_controls_own(loop):
    run = compile_diagram(loop).run(1.0, step=0.01, inputs=DRIVE, every=5)
    assert isinstance(run, ct.TimeResponseData)
    np.testing.assert_allclose(run.time, np.arange(21) * 0.05, rtol=1e-15)
    assert run.output_labels == ["q[0]", "q[1]", "u[0]", "u[1]"]
    assert run.input_labels == ["q_d[0]", "q_d[1]"]
    assert run.state_labels == ["plant.q[0]", "plant.q[1]", "plant.dq[0]", "plant.dq[1]"]
    np.testing.assert_array_equal(run.outputs[:2], run.states[:2])


def test_response_plots(loop):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    lines = compile_diagram(loop).run(1.0, step=0.01, inputs=DRIVE).plot()
    assert lines.lines.size > 0
    plt.close("all")


def test_decimation_keeps_every_row(loop):
    program = compile_diagram(loop)
    full = program.run(1.0, step=0.01, inputs=DRIVE)
    for every in (1, 3, 7, 100, 1000):
        some = program.run(1.0, step=0.01, inputs=DRIVE, every=every)
        np.testing.assert_array_equal(some.outputs, full.outputs[:, ::every])
        np.testing.assert_array_equal(some.time, full.time[::every])


@pytest.mark.parametrize(("log", "labels"), [
    ("q", ["q[0]", "q[1]"]),
    ("q[1]", ["q[1]"]),
    ("plant.dq", ["plant.dq[0]", "plant.dq[1]"]),
    (["pd.u[1]", "q[0]"], ["pd.u[1]", "q[0]"]),
    ("p*.u", ["plant.u[0]", "plant.u[1]", "pd.u[0]", "pd.u[1]"]),
    ("plant.*[0]", ["plant.u[0]", "plant.q[0]", "plant.dq[0]"]),
    (["q", "q[0]"], ["q[0]", "q[1]"]),
])
def test_log_selects_by_name_and_pattern(loop, log, labels):
    program = compile_diagram(loop)
    run = program.run(0.1, step=0.01, inputs=DRIVE, log=log)
    assert run.output_labels == labels
    full = program.run(0.1, step=0.01, inputs=DRIVE, log="*")
    for row, label in zip(run.outputs, labels):
        np.testing.assert_array_equal(row, full.outputs[full.output_labels.index(label)])


def test_ports_obey_their_wires(loop):
    run = compile_diagram(loop).run(1.0, step=0.01, inputs=DRIVE,
                                    log=["pd.q_d", "pd.q", "pd.u", "plant.u"])
    q_d, q, u, plant_u = run.outputs.reshape(4, 2, -1)
    np.testing.assert_allclose(u, np.clip(5.0 * (q_d - q), -2, 2), atol=1e-15)
    np.testing.assert_array_equal(u, plant_u)


@pytest.mark.parametrize("call", [
    {"log": "plant.ddq"}, {"params": {"pd.gian": 1.0}}, {"log": ["nothing*"]},
    {"initial_state": {"plnt": [0.0]}}])
def test_unknown_names_are_refused_with_the_nearest(loop, call):
    with pytest.raises(DiagramError, match=r"known: "):
        compile_diagram(loop).run(0.1, step=0.01, inputs=DRIVE, **call)


@pytest.mark.parametrize(("call", "text"), [
    ({"params": {"pd.gain": [1.0, 2.0]}}, r"'pd.gain' needs shape \(\)"),
    ({"initial_state": [1.0, 2.0]}, "needs 4 numbers"),
    ({"step": -1.0}, "step > 0"),
    ({"step": 0.03}, r"not a multiple of the step 0.03 s; use 0.09 s"),
    ({"every": 0}, "every must be a whole number"),
    ({"every": 2.5}, "every must be a whole number"),
])
def test_wrong_numbers_are_refused(loop, call, text):
    with pytest.raises(ClieError, match=text):
        compile_diagram(loop).run(0.1, **{"step": 0.01, "inputs": DRIVE, **call})


def test_parameters_need_no_new_program(loop):
    program = compile_diagram(loop)
    before = program.source("llvm")
    strong = program.run(1.0, step=0.01, inputs=DRIVE, params={"pd.gain": 9.0})
    weak = program.run(1.0, step=0.01, inputs=DRIVE, params={"pd.gain": 1.0})
    assert np.max(np.abs(strong.outputs - weak.outputs)) > 0.1
    assert program.source("llvm") == before
    assert program.params["pd.gain"] == 5.0
    scalar = program.run(1.0, step=0.01, inputs=DRIVE, params={"plant.damping": 2.0})
    vector = program.run(1.0, step=0.01, inputs=DRIVE, params={"plant.damping": [2.0, 2.0]})
    np.testing.assert_array_equal(scalar.outputs, vector.outputs)


def test_initial_state_by_block(loop):
    program = compile_diagram(loop)
    x = [1.0, 2.0, 3.0, 4.0]
    one = program.run(0.1, step=0.01, inputs=DRIVE, initial_state=x)
    two = program.run(0.1, step=0.01, inputs=DRIVE, initial_state={"plant": x})
    np.testing.assert_array_equal(one.states, two.states)
    np.testing.assert_array_equal(one.states[:, 0], x)


@pytest.mark.parametrize("engine", ["llvm", "python"])
def test_divergence_names_time_block_and_signal(make_block, engine):
    # dx/dt = x^2 from 1 leaves every bound at t = 1
    block = make_block("runaway", lambda t, x, u, params: x**2 + 0 * u,
                       lambda t, x, u, params: 1 * x, x=1)
    program = compile_diagram(block, engine)
    with pytest.raises(DivergedError, match=r"state x\[0\] of block 'runaway'") as stop:
        program.run(5.0, step=1e-3, inputs={"u": 0.0}, initial_state=[1.0], every=10)
    error = stop.value
    assert 1.0 <= error.time < 1.1 and error.block == "runaway"
    assert np.all(np.isfinite(error.response.states))
    kept = error.response.time
    assert kept[-1] == pytest.approx(error.time, abs=0.02)
    early = kept < 0.9
    np.testing.assert_allclose(error.response.states[0, early], 1 / (1 - kept[early]), rtol=1e-6)


def test_zero_steps_give_the_initial_output(loop):
    run = compile_diagram(loop).run(0.0, inputs=DRIVE, initial_state=[1.0, 2.0, 3.0, 4.0])
    np.testing.assert_allclose(run.outputs[:, 0], loop.output(0, [1.0, 2, 3, 4], DRIVE["q_d"]))


def test_static_diagram_runs(make_block):
    block = make_block("law", None, lambda t, x, u, params: np.sin(u) * np.exp(-t))
    run = compile_diagram(block).run(1.0, step=0.1, inputs={"u": 0.3})
    np.testing.assert_allclose(run.outputs[0], np.sin(0.3) * np.exp(-run.time), rtol=1e-14)


def test_nothing_to_log_is_nothing(make_block):
    source = ct.nlsys(None, lambda t, x, u, params: np.array([np.sin(t)]), name="source",
                      inputs=0, outputs=1)
    run = compile_diagram(source).run(1.0, step=0.1, log=[])
    assert run.outputs.shape == (0, 11)


def test_autonomous_diagram_runs():
    block = ct.nlsys(lambda t, x, u, params: -x, None, name="decay", states=1, inputs=0,
                     outputs=1)
    run = compile_diagram(block).run(1.0, step=0.01, initial_state=[1.0])
    np.testing.assert_allclose(run.states[0], np.exp(-run.time), rtol=1e-10)


def test_python_listing_is_the_program(loop):
    program, scope = compile_diagram(loop), {}
    text = program.source("python")
    assert "# " in text and "plant.u[0]" in text and "p[0]  plant.damping" in text
    exec(text, scope)
    x, u = [0.1, 0.2, 0.3, 0.4], [1.0, 2.0]
    p = np.concatenate([np.ravel(value) for value in program.params.values()])
    np.testing.assert_allclose(scope["derivative"](0.0, x, u, p), loop.dynamics(0.0, x, u),
                               rtol=1e-14)


def test_sources_by_name(loop):
    program = compile_diagram(loop)
    assert "define i64 @run" in program.source("llvm")
    with pytest.raises(ClieError, match=r"no source in 'pyhton'; did you mean 'python'"):
        program.source("pyhton")
    with pytest.raises(ClieError, match="no engine 'numba'"):
        compile_diagram(loop, "numba")


def test_without_llvmlite_plain_python_serves(loop, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "llvmlite.binding", None)
    program = compile_diagram(loop)
    assert "llvmlite is missing: running plain Python" in capsys.readouterr().err
    run = program.run(0.1, step=0.01, inputs=DRIVE)
    monkeypatch.undo()
    native = compile_diagram(loop).run(0.1, step=0.01, inputs=DRIVE)
    np.testing.assert_allclose(run.outputs, native.outputs, atol=1e-14)


def test_importing_the_package_is_cheap():
    code = "import sys, clie_blocks.compiled; print('control' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True,
                          check=True)
    assert done.stdout.strip() == "False"


def test_program_class_is_public(loop):
    assert isinstance(compile_diagram(loop), Program)
