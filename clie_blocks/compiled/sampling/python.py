"""A sampled loop as plain Python: the plant steps, the parts run at their ticks."""

import numpy as np

from clie_blocks.compiled.codegen.methods import SAMPLED, Method
from clie_blocks.compiled.codegen.python import PythonEngine
from clie_blocks.compiled.ir.layout import Layout
from clie_blocks.compiled.sampling.tracing import Sampling, Tick


def steps_per_tick(period: float, step: float) -> int:
    """Return how many steps lie between two ticks."""
    return max(1, round(period / step))


def steps_delayed(jitter: float, step: float, between: int) -> int:
    """Return by how many steps a tick is delayed, at most to the one before the next tick."""
    return int(np.clip(np.rint(np.nan_to_num(jitter / step)), 0, between - 1))


class SampledPythonEngine(PythonEngine):
    """A sampled loop as plain Python functions.

    Parameters
    ----------
    layout : Layout
        What to compute, with maps.
    method : Method
        The Butcher table of the plant.
    sampling : Sampling
        When the maps run.

    """

    def __init__(self, layout: Layout, method: Method, sampling: Sampling) -> None:
        super().__init__(layout, method)
        self._ticks = sampling.ticks
        self._maps = [(list(stored), PythonEngine(
            Layout(list(stored.values()), [], {}, layout.nu, opaque=layout.opaque), SAMPLED))
            for stored in layout.maps]

    def run(self, n: int, h: float, t0: float, first: int, x: np.ndarray, inputs: np.ndarray,
            p: np.ndarray, every: int, slots: np.ndarray, log: np.ndarray) -> int:
        """Take n steps in place, every part at its ticks; return their number."""
        row = 0
        for s in range(n):
            count, u = first + s, inputs[s:s + 1]
            for tick, (states, stored) in zip(self._ticks, self._maps):
                if _is_due(tick, count, h, x, u[0]):
                    x[states] = stored.derivative(t0 + count * h, x, u[0], p)
            if not super().run(1, h, t0, count, x, u, p, every, slots, log[row:]):
                return s
            row += count % every == 0
        return n


def _is_due(tick: Tick, count: int, h: float, x: np.ndarray, u: np.ndarray) -> bool:
    between = steps_per_tick(tick.period, h)
    phase = count % between
    if tick.jitter is None:
        return phase == 0
    if phase == 0:
        x[tick.wait] = steps_delayed(u[tick.jitter], h, between)
    return phase == x[tick.wait]
