"""Fixtures of this folder; its tests may import `c_engine` and `foreign_diagrams`."""

import sys
from pathlib import Path

import control as ct
import numpy as np
import pytest

from clie_blocks.signals import interconnect, signals

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory, monkeypatch):
    """A cache folder of the tests' own, shared by them."""
    folder = tmp_path_factory.getbasetemp() / "programs"
    monkeypatch.setenv("CLIE_BLOCKS_CACHE", str(folder))
    return folder


@pytest.fixture
def make_block():
    """Make a block from functions: ``make_block('plant', update, output, x=2, u=1, y=1)``."""
    def make(name, update, output, *, x=0, u=1, y=1, **params):
        return ct.nlsys(update, output, name=name, states=signals("x", n=x) if x else None,
                        inputs=signals("u", n=u), outputs=signals("y", n=y),
                        params={f"{name}.{key}": value for key, value in params.items()})
    return make


@pytest.fixture
def loop(make_block):
    """A damped two-joint plant under PD control with saturation, kp shared."""
    def plant(t, x, u, params):
        q, dq = x.reshape(2, 2)
        return np.concatenate((dq, u - params["plant.damping"] * dq))

    def law(t, x, u, params):
        error = u.reshape(2, 2)
        return np.clip(params["pd.gain"] * (error[0] - error[1]), -2.0, 2.0)

    robot = ct.nlsys(plant, lambda t, x, u, params: x, name="plant",
                     states=signals("q", "dq", n=2), inputs=signals("u", n=2),
                     outputs=signals("q", "dq", n=2),
                     params={"plant.damping": np.array([1.0, 2.0])})
    control = ct.nlsys(None, law, name="pd", inputs=signals("q_d", "q", n=2),
                       outputs=signals("u", n=2), params={"pd.gain": 5.0})
    return interconnect(
        [robot, control], [("plant.u", "pd.u"), ("pd.q", "plant.q")],
        inputs={"q_d": "pd.q_d"}, outputs={"q": "plant.q", "u": "pd.u"}, name="loop",
        unused=["plant.dq"])


@pytest.fixture
def plain_loop():
    """The slow truth: a Butcher table around ``diagram.dynamics``, one input row per step."""
    def simulate(diagram, method, rows, step, x=None, params=None):
        x = np.zeros(diagram.nstates) if x is None else np.array(x, float)
        states = [x]
        for s, u in enumerate(rows):
            k = []
            for weights, c in zip(method.a, method.c):
                y = x + step * sum((w * rate for w, rate in zip(weights, k)), np.zeros_like(x))
                k.append(diagram.dynamics((s + c) * step, y, u, params=params))
            x = x + step * sum(w * rate for w, rate in zip(method.b, k))
            states.append(x)
        return np.array(states)
    return simulate
