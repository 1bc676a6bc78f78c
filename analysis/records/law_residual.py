"""Did the stated law run?  What it leaves of the logged commands, and what rounding explains.

Replayed on the measured positions, a law that ran gives the logged commands up to their rounding.
"""

import numpy as np

from clie_blocks.analysis.records.control_law import ControlLaw

ROUNDED_STEPS = 0.5  # RMS in steps of the command; rounding alone leaves 0.29
ROUNDED_SHARE = 1e-3  # RMS over that of the command, where no step of the command is stated
MOST_OF_POSITION = 0.01  # of the command's RMS that rounding of the position may explain


def law_residual(law: ControlLaw, u: np.ndarray, q_err: np.ndarray, dq: np.ndarray,
                 pe: np.ndarray | float, delay: int = 0) -> np.ndarray:
    """Logged commands less those of the law `delay` rows before them, shape (N - delay, n).

    Control error, velocity estimate and excitation have the shape (N, n) of the commands.
    """
    return u[delay:] - law.command(q_err, dq, pe)[:len(u) - delay]


def rounding_limit(u: np.ndarray, command_step: np.ndarray,
                   position_step: np.ndarray | float = 0.0) -> np.ndarray:
    """Largest RMS of the residual that rounding explains, shape (n,) [unit of u].

    Parameters
    ----------
    u : ndarray, shape (N, n)
        Logged commands.
    command_step : ndarray, shape (n,)
        Stated rounding step of the command, which alone decides; 0 where none is stated.
    position_step : ndarray, shape (n,), optional
        What one rounding step of the logged position makes of the command, for a log whose
        position the controller may have read finer.

    """
    size = np.sqrt(np.mean(u**2, axis=0))
    of_position = np.minimum(ROUNDED_STEPS * position_step, MOST_OF_POSITION * size)
    return np.where(command_step > 0, ROUNDED_STEPS * command_step,
                    np.maximum(ROUNDED_SHARE * size, of_position))
