import numpy as np
import pytest

from clie_blocks.compiled import METHODS, compile_diagram
from clie_blocks.errors import ClieError


@pytest.mark.parametrize("method", METHODS.values(), ids=lambda method: method.title)
def test_tables_are_consistent(method):
    for weights, c in zip(method.a, method.c):
        assert sum(weights) == pytest.approx(c, abs=1e-15)
    assert sum(method.b) == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize("engine", ["llvm", "python"])
@pytest.mark.parametrize("method", METHODS.values(), ids=lambda method: method.title)
def test_slope_of_the_error_is_the_order(make_block, method, engine):
    # dx/dt = -x^2 cos t has the solution 1 / (1 + sin t)
    block = make_block("ode", lambda t, x, u, params: -x**2 * np.cos(t) + 0 * u,
                       lambda t, x, u, params: x, x=1)
    program = compile_diagram(block, engine)
    steps = np.array([40, 80, 160, 320]) * (8 if method.order < 3 else 1)
    runs = [program.run(4.0, step=4.0 / n, method=method.name, inputs={"u": 0.0},
                        initial_state=[1.0]) for n in steps]
    errors = [np.mean(np.abs(run.states[0] - 1 / (1 + np.sin(run.time))))
              for run in runs]
    slope = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(method.order, abs=0.35)


def test_unknown_method_names_the_nearest(make_block):
    block = make_block("ode", lambda t, x, u, params: -x, lambda t, x, u, params: x, x=1)
    with pytest.raises(ClieError, match=r"no method 'ode45'; did you mean 'ode5'\?"):
        compile_diagram(block).run(1.0, method="ode45", inputs={"u": 0.0})
