"""The ports by which any python-control diagram takes the place of the paper's joint."""

import dataclasses

import numpy as np

from clie_blocks.errors import ClieError, nearest
from clie_blocks.signals import ports

REFERENCE, EXCITATION, TORQUE, POSITION, COMMAND, RATE = "q_d", "pe", "torque", "q", "u", "dq"


@dataclasses.dataclass(frozen=True, eq=False)
class Ports:
    """What of a loop the diagnosis uses.

    Parameters
    ----------
    n : int
        Joints.
    torque : str
        Input at which a missing torque enters, ``torque`` or ``pe``.
    has_pe, has_rate : bool
        Whether the loop takes an excitation and shows velocities.
    other : tuple of str
        Further inputs; they are held at zero.

    """

    n: int
    torque: str
    has_pe: bool
    has_rate: bool
    other: tuple


def loop_ports(loop):
    """Find the ports of a loop.

    Inputs: q_d[k] [rad], torque[k] [N m] that acts on the joint like a motor's, and optionally
    pe[k] [N m].  Outputs: q[k] [rad], u[k] [N m], and optionally dq[k] [rad/s].  Without a port
    ``torque`` a missing torque enters at ``pe``.

    Raises
    ------
    ClieError
        Names the port that is missing, the nearest one, and how to add it.

    """
    inputs, outputs = ports(loop.input_labels), ports(loop.output_labels)
    _require(loop, REFERENCE, inputs, "input", f"inputs={{'{REFERENCE}': 'pd.{REFERENCE}', ...}}")
    for name in (POSITION, COMMAND):
        _require(loop, name, outputs, "output", f"outputs={{'{name}': 'block.{name}', ...}}")
    torque = TORQUE if TORQUE in inputs or EXCITATION not in inputs else EXCITATION
    _require(loop, torque, inputs, "input",
             "an input that adds to the motor's torque: put a summing block "
             "summing('u', 'torque', output='u', n=n, name='motor') before the plant and feed "
             "inputs={'torque': 'motor.torque', ...}")
    n = len(outputs[POSITION])
    for name, group in ((REFERENCE, inputs), (torque, inputs), (COMMAND, outputs)):
        if len(group[name]) != n:
            raise ClieError(f"{loop.name}: {name} has {len(group[name])} signals and q has {n}; "
                            "every joint needs one of each")
    known = (REFERENCE, torque, EXCITATION)
    return Ports(n, torque, EXCITATION in inputs, len(outputs.get(RATE, ())) == n,
                 tuple(name for name in inputs if name not in known))


def _require(loop, name, found, kind, remedy):
    if name not in found:
        raise ClieError(
            f"{loop.name}: the loop has no {kind} {name!r}, and without it the diagnosis cannot "
            f"run it beside a log; {nearest(name, found)}. Add it with {remedy} of interconnect")


def checked(loop):
    """Loop as a system that can be joined and compiled; a transfer function becomes a realisation.

    Raises
    ------
    ClieError
        If it is not a python-control system.

    """
    import control as ct

    if isinstance(loop, ct.TransferFunction):
        loop = ct.ss(loop, inputs=loop.input_labels, outputs=loop.output_labels, name=loop.name)
    if not isinstance(loop, (ct.NonlinearIOSystem, ct.StateSpace)):
        raise ClieError(f"loop= takes a python-control system, not {type(loop).__name__}; build "
                        "one with ct.nlsys, ct.ss or ct.interconnect")
    return loop


def rows(signal, samples, n):
    """Signal of a log as rows, shape (N, n)."""
    return np.broadcast_to(np.asarray(signal, float), (samples, n))
