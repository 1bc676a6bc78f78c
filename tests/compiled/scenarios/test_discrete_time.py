"""Diagrams in discrete time: the program is the difference equation, sample by sample."""

import control as ct
import numpy as np
import pytest

from clie_blocks.compiled import compile_diagram
from clie_blocks.errors import ClieError
from clie_blocks.signals import interconnect


def counter_and_filter():
    counter = ct.nlsys(lambda t, x, u, params: x + u, lambda t, x, u, params: np.floor(x),
                       states=1, inputs=["u"], outputs=["y"], dt=0.01, name="counter")
    smooth = ct.ss([[0.9]], [[0.1]], [[1.0]], [[0.0]], 0.01, name="smooth", inputs=["u"],
                   outputs=["y"])
    return interconnect([counter, smooth], [("smooth.u", "counter.y")],
                        inputs={"u": "counter.u"}, outputs={"y": "smooth.y"}, name="sampled")


@pytest.mark.parametrize("engine", ["llvm", "python"])
def test_equals_python_control_bit_for_bit(engine):
    diagram = counter_and_filter()
    u = np.random.default_rng(0).normal(size=201)
    theirs = ct.input_output_response(diagram, np.arange(201) * 0.01, u[None], [0.3, 0.0])
    ours = compile_diagram(diagram, engine).run(2.0, inputs={"u": u[:, None]},
                                                initial_state=[0.3, 0.0])
    np.testing.assert_array_equal(ours.states, theirs.states)
    np.testing.assert_allclose(ours.outputs.squeeze(), theirs.outputs.squeeze(), rtol=1e-15)


def test_another_step_is_refused():
    with pytest.raises(ClieError, match="sample time 0.01 s"):
        compile_diagram(counter_and_filter()).run(1.0, step=1e-3, inputs={"u": 0.0})
