"""A compiled diagram handed back to python-control as one flat block."""

from collections.abc import Callable, Mapping
from typing import Any

import control as ct
import numpy as np

from clie_blocks.compiled.codegen.engine import Engine
from clie_blocks.compiled.runtime.api import Batches

Vector = Callable[[Mapping[str, Any] | None], np.ndarray]  # all parameter slots


def flat_system(program: Batches, params: dict[str, Any], engine: Engine, shown: list[int],
                vector: Vector) -> ct.NonlinearIOSystem:
    """Return a program as one `control.NonlinearIOSystem`."""
    values = _LastValues(vector)

    def update(t: float, x: np.ndarray, u: np.ndarray, params: Mapping[str, Any]) -> np.ndarray:
        return engine.derivative(t, x, u, values.of(params))

    def output(t: float, x: np.ndarray, u: np.ndarray, params: Mapping[str, Any]) -> np.ndarray:
        return engine.observe(t, x, u, values.of(params))[shown]

    return ct.nlsys(
        update, output, name=program.name, params=params, dt=program.period or 0,
        inputs=program.inputs or 0, outputs=program.outputs,
        states=[f"{block}_{label}" for block, label in program.states] or 0)


class _LastValues:
    """The parameter values of the dictionary that python-control passed last."""

    def __init__(self, vector: Vector) -> None:
        self._vector = vector
        self._params: Mapping[str, Any] | None = None
        self._values = np.zeros(0)

    def of(self, params: Mapping[str, Any]) -> np.ndarray:
        # python-control makes one dictionary per simulation and passes it at every call
        if self._params is None or params is not self._params:
            self._params, self._values = params, self._vector(params)
        return self._values
