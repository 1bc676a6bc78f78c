"""Answer in time of an effect's block alone: what stands for the characteristic of a memory."""

from collections.abc import Callable
from typing import Any

import numpy as np

from clie_blocks.compiled import compile_diagram
from clie_blocks.effects import LIBRARY

STEP, ROWS = 5e-4, 600


def _one(t: np.ndarray) -> np.ndarray:
    return 1.0 + 0.0 * t


# Effects whose characteristic is an answer in time: signals that go in, and for how long [s].
ANSWERS: dict[str, tuple[dict[str, Callable], float]] = {
    "actuator_lag": ({"u": _one}, 0.03),
    "velocity_estimate_lag": ({"dq": _one}, 0.03),
    "time_delay": ({"u": _one}, 0.03),
    "setpoint_delay": ({"q_d": _one}, 0.1),
    "channel_skew": ({"u": _one}, 0.03),
    "in_loop_delay": ({"q": lambda t: t, "dq": _one}, 0.03),
    "velocity_filter_mismatch": ({"dq": _one}, 0.03),
    "control_law_form": ({"q_d": lambda t: t}, 0.05),
    "setpoint_slew": ({"q_d": _one}, 2.0),
    "torque_slew": ({"u": _one}, 0.03),
    "hidden_integral": ({"q_d": _one}, 2.0),
    "motor_heating": ({"u": lambda t: 10.0 * _one(t)}, 1800.0),
    "tick_jitter": ({"u": lambda t: np.sin(60.0 * t)}, 0.4),
    "packet_hold": ({"u": lambda t: np.sin(20.0 * t)}, 1.2),
    "rest_time_breakaway": ({"dq": lambda t: np.where(t < 60.0, 0.0, 0.02)}, 80.0)}


def answer(name: str) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """Run the block of an effect alone, at its typical parameters.

    Parameters
    ----------
    name : str
        One of `ANSWERS`.

    Returns
    -------
    t, y : ndarray, shape (k,)
        Time [s] and the first output.
    inputs : dict of str to ndarray
        The signals that went in; all others are zero.

    """
    signals, duration = ANSWERS[name]
    block = LIBRARY[name].typical().block(1)
    inputs: dict[str, Any] = {label.partition("[")[0]: [0.0] for label in block.input_labels}
    inputs |= {signal: (lambda t, f=f: np.array([f(t)])) for signal, f in signals.items()}
    steps = max(2 * ROWS, round(duration / STEP))
    run = compile_diagram(block).run(duration, duration / steps, "ode4", inputs,
                                     every=steps // ROWS)
    t = np.asarray(run.time)
    return t, np.atleast_2d(run.outputs)[0], {signal: f(t) for signal, f in signals.items()}
