"""What the blocks that are called back cost, measured and said."""

import time
import warnings

import numpy as np

CALLS = 20


class OpaqueBlockWarning(UserWarning):
    """Part of a compiled program runs in Python."""


def warn_of_callbacks(program):
    """Warn of what the opaque blocks of a program cost, if it has any.

    Parameters
    ----------
    program : Program
        The compiled diagram.

    """
    callbacks = program.callbacks
    if not callbacks:
        return
    times = [1e6 * _seconds(callback) for callback in callbacks]
    parts = [f"{callback.name} ({time:.0f} us)" for callback, time in zip(callbacks, times)]
    warnings.warn(
        f"{program.name}: the program calls back {' and '.join(parts)} at every evaluation: about "
        f"{6 * sum(times):.0f} us per step of ode5, where a traced block takes less than 1 us",
        OpaqueBlockWarning, stacklevel=3)


def _seconds(callback):
    """Median time of a call, at numbers that a block is likely to take."""
    numbers, times = np.full(callback.width, 0.5), []
    for _ in range(CALLS):
        begun = time.perf_counter()
        try:
            callback(numbers)
        except Exception:  # such numbers may be none of the block's
            break
        times.append(time.perf_counter() - begun)
    return np.median(times) if times else np.nan
