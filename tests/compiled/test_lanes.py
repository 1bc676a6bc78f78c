"""The loop over steps for several parameter sets at once: each lane is the single run."""

import ctypes

import numpy as np
import pytest

from clie_blocks.compiled import METHODS, compile_diagram
from clie_blocks.compiled.emit_llvm import function
from clie_blocks.compiled.layout import layout
from clie_blocks.compiled.machine import Machine
from clie_blocks.compiled.stepper import run_function
from clie_blocks.compiled.tracing import trace


@pytest.mark.parametrize("width", [2, 8])
def test_each_lane_is_its_own_run(loop, width):
    traced = trace(loop)
    arranged = layout(traced)
    parts = [function("derivative", arranged.derivatives, width=width),
             function("observe", arranged.record, width=width)]
    text = "\n".join([*sorted(parts[0][1] | parts[1][1]), parts[0][0], parts[1][0],
                      run_function(METHODS["ode5"], arranged.nx, arranged.nu,
                                   len(arranged.record), width)])
    machine = Machine(text, ["run"])
    gains = np.linspace(1.0, 8.0, width)
    single = compile_diagram(loop)
    rows = np.random.default_rng(0).standard_normal((40, 2))
    runs = [single.run(0.4, step=0.01, inputs={"q_d": rows}, params={"pd.gain": gain}, every=4)
            for gain in gains]

    p = np.repeat(traced.parameters.defaults[:, None], width, axis=1)
    p[traced.parameters.offset["pd.gain"]] = gains
    x, count = np.zeros((arranged.nx, width)), 2 * width
    slots = (np.array([[arranged.slots["u[0]"]], [0]]) * width + np.arange(width)).ravel()
    log = np.zeros((10, 2, width))
    real, whole, array = ctypes.c_double, ctypes.c_int64, ctypes.c_void_p
    run = machine.function("run", whole, real, real, whole, *[array] * 3, whole, whole,
                           *[array] * 2)
    run(40, 0.01, 0.0, 0, x.ctypes.data, rows.ctypes.data, p.ctypes.data, 4, count,
        slots.ctypes.data, log.ctypes.data)
    for lane, one in enumerate(runs):
        np.testing.assert_allclose(x[:, lane], one.states[:, -1], rtol=1e-13, atol=1e-14)
        np.testing.assert_allclose(log[:, 0, lane], one.outputs[2, :-1], rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose(log[:, 1, lane], one.states[0, :-1], rtol=1e-12, atol=1e-13)
