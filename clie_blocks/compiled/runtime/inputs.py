"""What can drive a diagram input: held rows, held noise, constants, functions of time.

A fixed-step method with stages evaluates a step at several instants.  Rows, noise and constants
are *held*: every stage of a step sees the same row, as in Simulink with a zero-order hold.
python-control interpolates between rows instead, so its later stages see part of the next sample;
with noise that is another signal.  A function of time is evaluated at every stage.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.compiled.frontend.symbol_arrays import flat_scalars
from clie_blocks.compiled.frontend.symbolic_numpy import twin
from clie_blocks.compiled.ir.symbols import Expression, Graph
from clie_blocks.errors import ClieError, nearest
from clie_blocks.labels import ports

Inputs = Mapping[str, Any] | np.ndarray | None  # as in `Program.run`, or one table
Rows = Callable[[int], np.ndarray]  # the next input rows, shape (count, number of inputs)


class InputError(ClieError, ValueError):
    """An input of a run is missing, unknown or of the wrong shape."""


class HeldNormal:
    """Normal noise, one draw per period, held over it; see `held_normal`."""

    def __init__(self, variance: ArrayLike, seed: int, period: float | None) -> None:
        self.variance, self.seed, self.period = variance, seed, period

    def rows(self, width: int, step: float) -> Rows:
        """Return ``next_rows(count)``, which continues where the last call ended."""
        hold = 1 if self.period is None else round(self.period / step)
        if self.period is not None and (hold < 1 or abs(hold * step - self.period) > 1e-6 * step):
            raise InputError(f"held_normal: period {self.period:g} s is not a multiple of the "
                             f"step {step:g} s; choose one that is")
        scale = np.sqrt(np.broadcast_to(np.asarray(self.variance, float), (width,)))
        generator = np.random.default_rng(self.seed)
        spare = np.zeros((0, width))

        def next_rows(count: int) -> np.ndarray:
            nonlocal spare
            draws = max(0, -(-(count - len(spare)) // hold))
            fresh = generator.standard_normal((draws, width)) * scale
            spare = np.concatenate([spare, np.repeat(fresh, hold, axis=0)])
            rows, spare = spare[:count], spare[count:]
            return rows
        return next_rows


def held_normal(variance: ArrayLike, seed: int, period: float | None = None) -> HeldNormal:
    """White Gaussian noise as an input: one draw per period, held in between.

    Parameters
    ----------
    variance : float or array_like, shape (n,)
        Variance of each draw, in the square of the unit of the input.
    seed : int
        The same seed draws the same noise, whatever the length of the run.
    period : float, optional
        Time between draws [s], a multiple of the step; by default the step.

    Returns
    -------
    HeldNormal
        For ``inputs={'noise': held_normal(1e-6, seed=0)}``.

    Raises
    ------
    InputError
        If the variance is negative or not finite.

    """
    values = np.asarray(variance, float)
    if not (np.all(np.isfinite(values)) and np.all(values >= 0)):
        raise InputError(f"held_normal: the variance must be finite and not negative, "
                         f"got {variance!r}")
    return HeldNormal(variance, seed, period)


def bind_inputs(graph: Graph, labels: Sequence[str], inputs: Inputs, steps: int,
                step: float) -> tuple[Rows, dict[int, Expression]]:
    """Return the rows of a run, and an expression by index for inputs that are functions of time.

    Raises
    ------
    InputError
        For a missing or unknown input or a wrong shape; names it and what would be right.

    """
    if isinstance(inputs, np.ndarray):
        return _reader("of the diagram", inputs, len(labels), steps, step), {}
    readers: list[tuple[list[int], Rows]] = []
    driven: dict[int, Expression] = {}
    open_labels = dict.fromkeys(range(len(labels)))
    for name, value in (inputs or {}).items():
        where = _find(name, labels)
        for k in where:
            if k not in open_labels:
                raise InputError(f"input {labels[k]!r} is given twice")
            del open_labels[k]
        if callable(value):
            driven |= dict(zip(where, _trace(graph, name, value, len(where))))
        else:
            readers.append((where, _reader(name, value, len(where), steps, step)))
    if open_labels:
        base = next(iter(ports([labels[next(iter(open_labels))]])))
        raise InputError(
            f"nothing drives the diagram input {base!r}; give inputs={{{base!r}: ...}} as a "
            "constant per signal, one row per step, held_normal(...) or a function of time")

    def rows(count: int) -> np.ndarray:
        table = np.zeros((count, len(labels)))
        for where, read in readers:
            table[:, where] = read(count)
        return table
    return rows, driven


def _find(name: str, labels: Sequence[str]) -> list[int]:
    groups = ports(labels)
    if name in labels:
        return [labels.index(name)]
    if name not in groups:
        raise InputError(f"the diagram has no input {name!r}; {nearest(name, groups)}")
    return groups[name]


def _reader(name: str, value: Any, width: int, steps: int, step: float) -> Rows:
    if isinstance(value, HeldNormal):
        return value.rows(width, step)
    try:
        array = np.asarray(value, float)
    except (TypeError, ValueError):
        raise InputError(f"input {name!r} must be numbers, held_normal(...) or a function of "
                         f"time, got {type(value).__name__}") from None
    if width == 1 and array.ndim == 1 and array.size != 1:
        array = array[:, None]
    if array.ndim < 2 and array.size in (1, width):
        return lambda count: np.broadcast_to(array, (count, width))
    if array.ndim != 2 or array.shape[1] != width or len(array) < max(1, steps):
        hint = "; it seems transposed" if array.ndim == 2 and array.shape[0] == width else ""
        raise InputError(
            f"input {name!r} has shape {array.shape} but needs ({width},) for a constant or "
            f"({steps}, {width}) for one row per step, {steps} steps of {step:g} s{hint}")
    return _table(array)


def _table(array: np.ndarray) -> Rows:
    position = 0

    def next_rows(count: int) -> np.ndarray:
        nonlocal position
        rows = array[min(position, len(array) - 1):position + count]
        position += count
        return rows
    return next_rows


def _trace(graph: Graph, name: str, function: Callable[..., Any], width: int) -> list[Expression]:
    try:
        values = flat_scalars(twin(function)(graph.variable("t")))
    except Exception as error:
        raise InputError(
            f"the function of time of input {name!r} cannot be traced ({error}); write it with "
            "numpy functions of t, or sample it and give one row per step: "
            "np.array([f(k * step) for k in range(steps)])") from error
    if len(values) not in (1, width):
        raise InputError(f"the function of time of input {name!r} returns {len(values)} values "
                         f"for {width} signals")
    return values * width if len(values) == 1 else values
