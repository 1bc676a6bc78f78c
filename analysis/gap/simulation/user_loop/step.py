"""One step of any loop, as a function of numbers or of the symbols that become machine code.

The loop is moved by Runge-Kutta of fourth order (or by its own map, in discrete time), once
without a missing torque and once per joint with one N m.  The difference is what a torque does to
the state, so that dry friction can stop a joint of a loop of which nothing else is known.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from clie_blocks.analysis.gap.problem.user_loop.law import GLANCE
from clie_blocks.analysis.gap.problem.user_loop.ports import Ports
from clie_blocks.labels import ports

if TYPE_CHECKING:
    from control import InputOutputSystem

    from clie_blocks.compiled.ir.symbols import Symbol

StepFunction = Callable[[float, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


def trace_step(loop: InputOutputSystem) -> StepFunction:
    """Return ``f(t, x, u) -> (rate or next state, outputs)`` of a loop.

    Raises
    ------
    TraceError
        If a block of it branches on a signal; names the block and the remedy.

    """
    from clie_blocks.compiled.frontend.tracing import trace
    from clie_blocks.compiled.ir.scalars import F
    from clie_blocks.compiled.ir.symbols import Symbol, topological

    found = trace(loop)
    roots = [*found.derivatives, *(found.signals[label] for label in found.outputs)]
    order, n = topological(roots), len(found.derivatives)
    numbers = found.parameters.defaults

    def value(node: Symbol, given: Mapping[str, Any], known: Mapping[Symbol, Any]) -> Any:
        if node.op == "variable":
            kind, index = node.args
            return given[kind][index]
        return getattr(F, node.op)(*(known.get(a, a) if isinstance(a, Symbol) else a
                                     for a in node.args))

    def function(t: float, x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        given, known = {"t": [t], "x": x, "u": u, "p": numbers}, {}
        for node in order:
            known[node] = value(node, given, known)
        values = _array([known[root] if isinstance(root, Symbol) else root for root in roots])
        return values[:n], values[n:]

    return function


def _array(values: Sequence[Any]) -> np.ndarray:
    from clie_blocks.compiled.frontend.symbol_arrays import has_symbols, symbol_array

    return symbol_array(values) if has_symbols(values) else np.array(values, float)


@dataclasses.dataclass(frozen=True, eq=False)
class LoopStep:
    """Steps of a loop.

    Parameters
    ----------
    function : callable
        See `traced`.
    where : dict
        Indices of the inputs, and of the outputs q and u.
    torque : str
        Input at which a missing torque enters.
    step : float
        Length of a step [s].
    discrete : bool
        Whether the loop is a map.

    """

    function: StepFunction
    where: dict[str, Sequence[int]]
    torque: str
    step: float
    discrete: bool

    @classmethod
    def of(cls, loop: InputOutputSystem, found: Ports, step: float) -> LoopStep:
        """Steps of a loop with given ports."""
        outputs = ports(loop.output_labels)
        where = {**ports(loop.input_labels), **{f"shown {key}": outputs[key] for key in "qu"}}
        return cls(trace_step(loop), where, found.torque, step, bool(loop.dt))

    def seen(self, t: float, x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions and commands, without a missing torque."""
        shown = self.function(t, x, u)[1]
        return shown[self.where["shown q"]], shown[self.where["shown u"]]

    def rate(self, t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Velocities, from the positions that the loop is about to show [rad/s]."""
        moved, shown = self.function(t, x, u)
        reach = self.step if self.discrete else GLANCE
        later = self.function(t, moved if self.discrete else x + GLANCE * moved, u)[1]
        at = self.where["shown q"]
        return (later[at] - shown[at]) / reach

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
        return [self.free(t, x, _with_inputs(u, at, 1.0)) - after
                for at in self.where[self.torque]]

    def with_input(self, u: np.ndarray, name: str, added: np.ndarray) -> np.ndarray:
        """Inputs with something added at a port."""
        for at, more in zip(self.where[name], added):
            u = _with_inputs(u, at, more)
        return u


def _with_inputs(u: np.ndarray, at: int, more: Any) -> np.ndarray:
    return _array([value + more if k == at else value for k, value in enumerate(u)])
