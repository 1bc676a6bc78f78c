"""Stop conditions: a run ends at the first step at which a signal is out of its bounds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from clie_blocks.compiled.ir.scalars import F, number
from clie_blocks.compiled.ir.symbols import Expression, Graph
from clie_blocks.compiled.runtime.arguments import select
from clie_blocks.errors import ClieError

StopBounds = Mapping[str, tuple[float | None, float | None]]  # (low, high) by signal


@dataclass(frozen=True)
class Stop:
    """When, where and why a run stopped; ``str`` puts it in words.

    Parameters
    ----------
    time : float
        Time of the step [s].
    signal : str
        The signal; the first in the order of the bounds, if several leave them at once.
    value, bound : float
        Its value there, and the bound that it has passed.

    """

    time: float
    signal: str
    value: float
    bound: float

    def __str__(self) -> str:
        side = "above" if self.value > self.bound else "below"
        reason = "is not a number" if np.isnan(self.value) else f"is {side} {self.bound:g}"
        return (f"stopped at t = {self.time:.6g} s, because {self.signal} = {self.value:.6g} "
                f"{reason}")


class Bounds:
    """The bounds of some signals.

    Parameters
    ----------
    stop : dict
        ``(low, high)`` by label, base name or pattern; None leaves a side open.
    signals : list of str
        All signals of the program.
    owner : str
        Name of the diagram, for messages.

    Raises
    ------
    ClieError
        For an unknown signal, with the nearest valid one, or bounds that make no sense.

    """

    def __init__(self, stop: StopBounds, signals: Sequence[str], owner: str) -> None:
        pairs = {label: _pair(name, bounds, owner) for name, bounds in stop.items()
                 for label in select(signals, name, owner)}
        self.labels = list(pairs)
        self.low, self.high = np.array(list(pairs.values())).reshape(-1, 2).T

    @property
    def values(self) -> np.ndarray:
        """What a program with these bounds reads behind its parameters: low, then high."""
        return np.concatenate([self.low, self.high])

    def watch(self, graph: Graph, expressions: Sequence[Expression],
              first: int) -> list[Expression]:
        """Return the expressions of a layout's `watch`."""
        inside = True
        for k, expression in enumerate(expressions):
            low = graph.variable("p", first + k)
            high = graph.variable("p", first + len(self.labels) + k)
            inside = F.and_(inside, F.and_(F.ge(expression, low), F.le(expression, high)))
        return [number(F.not_(inside))] if self.labels else []

    def stop(self, time: float, values: np.ndarray) -> Stop | None:
        """Return the `Stop` that these values of `labels` mean, or None."""
        outside = np.flatnonzero(~((values >= self.low) & (values <= self.high)))
        if not outside.size:
            return None
        k = outside[0]
        bound = self.high[k] if values[k] > self.high[k] else self.low[k]
        return Stop(float(time), self.labels[k], float(values[k]), float(bound))


def _pair(name: str, bounds: tuple[float | None, float | None], owner: str) -> tuple[float, float]:
    try:
        low, high = (side if value is None else float(value)
                     for value, side in zip(bounds, (-np.inf, np.inf), strict=True))
    except (TypeError, ValueError):
        low, high = np.nan, np.nan
    if not low < high:
        raise ClieError(f"{owner}: stop[{name!r}] must be a pair (low, high) with low < high, "
                        f"None for an open side, got {bounds!r}")
    return low, high
