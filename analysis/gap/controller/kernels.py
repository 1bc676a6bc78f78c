"""The kernels of the catalogue, run on the signals of a log in the place of a diagram.

A log holds every signal that an effect of the controller or of the recorder reads, so that its
own kernel says what the command would be.  The signals of a joint are columns of shape (N, 1).
"""

import functools
from collections.abc import Mapping
from typing import Any

import numpy as np

from clie_blocks.analysis.records.velocity_filter import SETTLED
from clie_blocks.effects.blocks import Dynamic, Static, filled_in
from clie_blocks.effects.delay import DelayLine, tap_weights
from clie_blocks.effects.effect import Effect
from clie_blocks.linear_filters import lfilter

Signals = dict[str, np.ndarray]
"""Signal -> column (N, 1)."""
Values = Mapping[str, float]
"""Parameter of an effect -> value."""
SAME = 1e-9  # of a state: two recursions that differ by no more are one
SMALL = 1e-9  # state and signals at which a step is looked at


def with_effect(effect: Effect, values: Values, signals: Signals, period: float,
                start: float = 0.0, fresh: bool = False) -> Signals:
    """Signals behind an effect of a sampled controller.

    Its state begins at `start`.  A `fresh` output is that of the state behind the step of its own
    sample: a sum or a filter may take the present sample in before or after it is read.
    """
    build = effect.sampled or effect.build
    return {**signals, **_behind(build, values, signals, period, start, fresh)}


def memory(effect: Effect, values: Values, period: float) -> float:
    """Samples after which an effect no longer knows how its run began; infinite for a sum."""
    build = effect.sampled or effect.build
    if isinstance(build, DelayLine):
        return np.ceil(_samples_late(build, values, period)) + 1
    if not isinstance(build, Dynamic):
        return 0.0
    pole = _linear_step(_step(build, values, period), len(build.inputs))[0]
    if pole >= 1.0:
        return np.inf
    return np.ceil(np.log(SETTLED) / np.log(pole)) if pole > 0.0 else 0.0


@functools.singledispatch
def _behind(build: Any, values: Values, signals: Signals, period: float, start: float,
            fresh: bool) -> Signals:
    raise TypeError(f"a block of {type(build).__name__} cannot be replayed on a log")


@_behind.register
def _behind_static(build: Static, values: Values, signals: Signals, period: float,
                   start: float, fresh: bool) -> Signals:
    outputs = filled_in(build.kernel, values)(*(signals[name] for name in build.inputs))
    return _named(build.outputs, outputs)


@_behind.register
def _behind_delay(build: DelayLine, values: Values, signals: Signals, period: float,
                  start: float, fresh: bool) -> Signals:
    late = _samples_late(build, values, period)
    first = int(np.floor(late))
    return {name: sum(tap_weights(late, age) * _shifted(signals[name], age)
                      for age in (first, first + 1)) for name in build.ports}


@_behind.register
def _behind_dynamic(build: Dynamic, values: Values, signals: Signals, period: float,
                    start: float, fresh: bool) -> Signals:
    read = [signals[name] for name in build.inputs]
    z = states(build, values, read, period, start)
    z = z[1:] if fresh else z[:-1]
    kernel = filled_in(build.kernel, {**values, "period": period})
    return _named(build.outputs, kernel(z, *read))


def states(build: Dynamic, values: Values, read: list[np.ndarray], period: float,
           start: float) -> np.ndarray:
    """State of a kernel at every sample and behind the last one, shape (N + 1, 1).

    A step that is linear wherever it was looked at is run as a filter, and sample by sample where
    the states of the filter are not what the step itself makes of them.
    """
    step = _step(build, values, period)
    pole, gains = _linear_step(step, len(read))
    driven = sum(gain * signal for gain, signal in zip(gains, read))
    z = lfilter([1.0], [1.0, -pole], np.concatenate([[[start]], driven]))
    if np.allclose(step(z[:-1], *read), z[1:], rtol=SAME, atol=SAME * np.abs(z).max()):
        return z
    z[0] = start
    state = start
    for k, row in enumerate(np.concatenate(read, axis=1).tolist()):
        state = float(step(state, *row))
        z[k + 1] = state
    return z


def _step(build: Dynamic, values: Values, period: float) -> Any:
    return filled_in(build.rate, {**values, "period": period})


def _linear_step(step: Any, inputs: int) -> tuple[float, list[float]]:
    """Slopes of a step from zero: by its state, and by each of its signals."""
    slopes = [float(step(*row)) for row in SMALL * np.eye(1 + inputs)]
    return slopes[0] / SMALL, [slope / SMALL for slope in slopes[1:]]


def _samples_late(build: DelayLine, values: Values, period: float) -> float:
    return float(filled_in(build.delay, values)(0.0)) / period


def _shifted(x: np.ndarray, rows: int) -> np.ndarray:
    """Column some rows later, behind its first value."""
    return x if not rows else np.concatenate([np.repeat(x[:1], rows, axis=0), x])[:len(x)]


def _named(names: tuple[str, ...], outputs: Any) -> Signals:
    parts = outputs if isinstance(outputs, tuple) else (outputs,)
    return dict(zip(names, parts, strict=True))
