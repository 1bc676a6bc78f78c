"""One step of any loop, as a function of arrays or of the symbols that become machine code.

The loop is moved by Runge-Kutta of fourth order (or by its own map, in discrete time), once
without an added torque and once per joint with one N m.  The difference is what a torque does to
the state, so that dry friction can stop a joint of a loop of which nothing else is known.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from clie_blocks.analysis.gap.problem.user_loop.law import VELOCITY_STEP
from clie_blocks.analysis.gap.problem.user_loop.ports import COMMAND, POSITION, Ports
from clie_blocks.compiled.frontend.symbol_arrays import array_of
from clie_blocks.labels import ports

if TYPE_CHECKING:
    from control import InputOutputSystem

StepFunction = Callable[[float, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclasses.dataclass(frozen=True, eq=False)
class LoopStep:
    """Steps of a loop.

    Parameters
    ----------
    function : callable
        See `step_function`.
    inputs, outputs : mapping
        Indices of the signals of each port.
    torque : str
        Input at which an added torque enters.
    step : float
        Length of a step [s].
    discrete : bool
        Whether the loop is a map.

    """

    function: StepFunction
    inputs: Mapping[str, Sequence[int]]
    outputs: Mapping[str, Sequence[int]]
    torque: str
    step: float
    discrete: bool

    @classmethod
    def of(cls, loop: InputOutputSystem, loop_ports: Ports, step: float) -> LoopStep:
        """Steps of a loop with some ports."""
        from clie_blocks.compiled.frontend.step_function import step_function

        return cls(step_function(loop), ports(loop.input_labels), ports(loop.output_labels),
                   loop_ports.torque, step, bool(loop.dt))

    def measured(self, t: float, x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions and commands, without an added torque."""
        outputs = self.function(t, x, u)[1]
        return outputs[self.outputs[POSITION]], outputs[self.outputs[COMMAND]]

    def rate(self, t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Velocities, from the positions that the loop is about to show [rad/s]."""
        rates, outputs = self.function(t, x, u)
        h = self.step if self.discrete else VELOCITY_STEP
        later = self.function(t, rates if self.discrete else x + VELOCITY_STEP * rates, u)[1]
        position = self.outputs[POSITION]
        return (later[position] - outputs[position]) / h

    def free(self, t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        """State one step later; the inputs are held."""
        if self.discrete:
            return self.function(t, x, u)[0]
        h = self.step
        a = self.function(t, x, u)[0]
        b = self.function(t + h / 2, x + h / 2 * a, u)[0]
        c = self.function(t + h / 2, x + h / 2 * b, u)[0]
        d = self.function(t + h, x + h * c, u)[0]
        return x + h / 6 * (a + 2 * b + 2 * c + d)

    def pushed(self, t: float, x: np.ndarray, u: np.ndarray, after: np.ndarray,
               ) -> list[np.ndarray]:
        """Change of the state after a step by one N m at each joint."""
        return [self.free(t, x, _with_added_input(u, k, 1.0)) - after
                for k in self.inputs[self.torque]]

    def with_input(self, u: np.ndarray, name: str, added: np.ndarray) -> np.ndarray:
        """Inputs with a signal added at a port."""
        for k, value in zip(self.inputs[name], added):
            u = _with_added_input(u, k, value)
        return u


def _with_added_input(u: np.ndarray, k: int, added: Any) -> np.ndarray:
    return array_of([value + added if i == k else value for i, value in enumerate(u)])
