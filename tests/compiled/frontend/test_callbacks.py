"""Blocks that cannot be traced: refused with a remedy, or called back when declared opaque."""

import control as ct
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from clie_blocks.compiled import METHODS, OpaqueBlockWarning, TraceError, compile_diagram
from clie_blocks.errors import ClieError
from clie_blocks.signals import DiagramError

SPLINE = CubicSpline([-3.0, 0.0, 1.0, 3.0], [1.0, 0.0, 0.5, -1.0])
RATIOS = np.array([40.0, 25.0, 16.0])


def geared(t, x, u, params):
    return -RATIOS[int(abs(u[0])) % 3] * x


def one_sided(t, x, u, params):
    return [-params["rate"] * (x[0] if x[0] > 0 else 0.0) + u[0]]


def halved(t, x, u, params):
    value = x[0]
    while value > 1:
        value = value / 2
    return [-value]


def tabled(t, x, u, params):
    return [float(SPLINE(np.clip(x[0], -3, 3))) - params["rate"] * x[0] + u[0]]


def untraceable(update, output=lambda t, x, u, params: x[:1]):
    return ct.nlsys(update, output, states=["x"], inputs=["u"], outputs=["y"], name="block",
                    params={"rate": 2.0})


@pytest.mark.parametrize(("update", "remedy"), [
    (geared, "look up a table by a parameter or with np.interp"),
    (one_sided, r"use np.where\(condition, a, b\)"),
    (halved, r"use np.where\(condition, a, b\)"),
    (tabled, "build arrays with np.array"),
])
def test_what_cannot_be_traced_is_refused_with_block_function_and_remedy(update, remedy):
    with pytest.raises(TraceError, match=rf"block 'block', update function: .*{remedy}.*"
                                         r"slowly: opaque=\['block'\]"):
        compile_diagram(untraceable(update))


@pytest.mark.parametrize("engine", ["llvm", "python"])
@pytest.mark.parametrize("update", [geared, one_sided, halved, tabled])
def test_opaque_blocks_are_called_back(update, engine, plain_loop):
    diagram = untraceable(update)
    with pytest.warns(OpaqueBlockWarning, match=r"calls back block 'block', update function \("
                                                r"\d+ us\) at every evaluation"):
        program = compile_diagram(diagram, engine, opaque=["block"])
    params = {"rate": 3.0} if update in (one_sided, tabled) else {}
    run = program.run(0.2, step=1e-2, inputs={"u": 0.4}, initial_state=[1.5], params={
        key: value for key, value in params.items()})
    expected = plain_loop(diagram, METHODS["ode5"], np.full((20, 1), 0.4), 1e-2, [1.5], params)
    np.testing.assert_allclose(run.states.T, expected, rtol=1e-13, atol=1e-13)


def watched_loop(output, **settings):
    block = ct.nlsys(tabled, output, states=["x"], inputs=["u"], outputs=["y"], name="block",
                     params={"rate": 2.0})
    for key, value in settings.items():
        setattr(block, key, value)
    gain = ct.nlsys(None, lambda t, x, u, params: -0.5 * u, inputs=["y"], outputs=["u"],
                    name="gain")
    return ct.interconnect([block, gain], name="loop", inputs=[], outputs=["y", "u"])


@pytest.mark.filterwarnings("ignore::clie_blocks.compiled.OpaqueBlockWarning")
def test_an_opaque_output_without_feedthrough_closes_no_algebraic_loop():
    diagram = watched_loop(lambda t, x, u, params: [SPLINE(float(x[0]))], opaque=True)
    program = compile_diagram(diagram)
    assert len(program.callbacks) == 2
    np.testing.assert_allclose(program.output(0, [0.7], []), diagram.output(0, [0.7], []))
    with pytest.raises(DiagramError, match="algebraic loop"):
        compile_diagram(watched_loop(lambda t, x, u, params: [SPLINE(float(x[0])) + 0 * u[0]],
                                     opaque=True))


def test_an_opaque_block_that_can_be_traced_is(recwarn):
    block = ct.nlsys(None, lambda t, x, u, params: np.sin(u), inputs=1, outputs=1, name="block")
    assert compile_diagram(block, opaque=["block"]).callbacks == []
    assert not recwarn


def test_an_unknown_opaque_block_is_refused():
    with pytest.raises(DiagramError, match="no block 'blok' to be opaque; did you mean 'block'"):
        compile_diagram(untraceable(tabled), opaque=["blok"])


@pytest.mark.filterwarnings("ignore::clie_blocks.compiled.OpaqueBlockWarning")
@pytest.mark.parametrize("engine", ["llvm", "python"])
def test_what_fails_in_an_opaque_block_is_reported(engine):
    def fails(t, x, u, params):
        return [1.0 / [1.0, 0.0][int(t > 0.5)] + float(x[0]) * 0]

    program = compile_diagram(untraceable(fails), engine, opaque=["block"])
    with pytest.raises(ClieError, match=r"block 'block', update function: it failed when called "
                                        r"back with x = \[.*ZeroDivisionError"):
        program.run(1.0, step=0.1, inputs={"u": 0.0})


@pytest.mark.filterwarnings("ignore::clie_blocks.compiled.OpaqueBlockWarning")
def test_opaque_blocks_run_in_batches_but_are_neither_exported_nor_differentiated():
    program = compile_diagram(untraceable(tabled), opaque=["block"])
    rates = np.linspace(0.5, 3.0, 5)
    done = program.batch(0.2, step=1e-2, inputs={"u": 0.4}, params={"rate": rates})
    for k, rate in enumerate(rates):
        one = program.run(0.2, step=1e-2, inputs={"u": 0.4}, params={"rate": rate})
        np.testing.assert_array_equal(done.outputs[k], one.outputs)
    with pytest.raises(ClieError, match="no source in C"):
        program.source("c")
    with pytest.raises(ClieError, match="an opaque block is not differentiated"):
        program.sensitivities(["rate"], 0.2, step=1e-2, inputs={"u": 0.4})
    assert program.as_nlsys().dynamics(0, [0.7], [0.4]) == pytest.approx(
        untraceable(tabled).dynamics(0, [0.7], [0.4]))


@pytest.mark.filterwarnings("ignore::clie_blocks.compiled.OpaqueBlockWarning")
def test_a_program_with_an_opaque_block_comes_back_from_the_disk():
    first, second = (compile_diagram(untraceable(tabled), opaque=["block"]) for _ in range(2))
    assert second.cached
    np.testing.assert_array_equal(*(
        program.run(0.1, step=1e-2, inputs={"u": 0.4}).states for program in (first, second)))
