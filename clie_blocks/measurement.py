"""What a sensor adds: noise as a diagram input, and the steps of an encoder."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.labels import PerJoint, signals, vector

if TYPE_CHECKING:
    import control as ct


def quantized(q: np.ndarray, resolution: PerJoint) -> np.ndarray:
    """Position rounded to the encoder's steps; resolution zero leaves it untouched."""
    step = np.where(resolution > 0, resolution, 1.0)
    return np.where(resolution > 0, step * np.floor(q / step + 0.5), q)


def noisy_measurement(n: int, *, name: str = "measured") -> ct.StateSpace:
    """Measured position with additive noise, section 5.

    Inputs: q [rad], noise [rad].  Outputs: q_measured [rad].  No state.

    Parameters
    ----------
    n : int
        Number of joints.
    name : str
        Name of the block.

    Notes
    -----
    The noise is an input of the diagram, held over each sample, so that a run is a function of
    its inputs: draw it with `clie_blocks.compiled.held_normal`.

    """
    from clie_blocks.signals import summing

    return summing("q", "noise", output="q_measured", n=n, name=name)


def encoder(resolution: ArrayLike, *, name: str = "encoder") -> ct.NonlinearIOSystem:
    """Encoder that rounds a position to its steps.

    Inputs: q [rad].  Outputs: q_measured [rad].  No state.

    Parameters
    ----------
    resolution : array_like, shape (n,)
        Step [rad], not negative; zero removes the rounding.  Key ``'{name}.resolution'``.
    name : str
        Name of the block.

    """
    import control as ct

    resolution = vector(resolution, f"{name}: resolution", unit="rad", least=0)
    n = resolution.size

    def output(t: float, x: np.ndarray, u: np.ndarray,
               params: dict[str, np.ndarray]) -> np.ndarray:
        return quantized(u, params[f"{name}.resolution"])

    return ct.nlsys(None, output, dt=None, name=name, params={f"{name}.resolution": resolution},
                    inputs=signals("q", n=n), outputs=signals("q_measured", n=n))
