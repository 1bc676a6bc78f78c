"""The ports by which any python-control diagram replaces the paper's joint."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection
from typing import TYPE_CHECKING

from clie_blocks.errors import ClieError, nearest
from clie_blocks.labels import ports

if TYPE_CHECKING:
    from control import InputOutputSystem, NonlinearIOSystem

REFERENCE, EXCITATION, TORQUE, SENSOR = "q_d", "pe", "torque", "sensor"
POSITION, COMMAND, DELIVERED = "q", "u", "u_in"


@dataclasses.dataclass(frozen=True, eq=False)
class Ports:
    """What of a loop the diagnosis uses.

    Parameters
    ----------
    n : int
        Joints.
    torque : str
        Input at which a missing torque enters, ``torque`` or ``pe``.
    has_pe, has_sensor : bool
        Whether the loop takes an excitation, and an error of the measured position.
    other : tuple of str
        Further inputs; they are held at zero.

    """

    n: int
    torque: str
    has_pe: bool
    has_sensor: bool
    other: tuple[str, ...]


def loop_ports(loop: InputOutputSystem) -> Ports:
    """Find the ports of a loop.

    Inputs: q_d[k] [rad], torque[k] [N m] that acts on the joint like a motor's, and optionally
    pe[k] [N m] and sensor[k] [rad], which adds to the measured position.  Outputs: q[k] [rad] as
    measured, and u[k] [N m], the command to the drive.  Instead of ``torque`` a loop may be cut at
    the motor: the torque that leaves the drive is then its input u_in[k] [N m], see
    `as_closed_loop`.  With neither, a missing torque enters at ``pe``.

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
             "summing('u', 'torque', output='both', n=n, name='motor') before the plant and feed "
             "inputs={'torque': 'motor.torque', ...}; or cut the loop at the motor: "
             "inputs={'u_in': 'plant.u', ...}")
    n = len(outputs[POSITION])
    sized = [(REFERENCE, inputs), (torque, inputs), (COMMAND, outputs)]
    sized += [(name, inputs) for name in (EXCITATION, SENSOR) if name in inputs]
    for name, group in sized:
        if len(group[name]) != n:
            raise ClieError(f"{loop.name}: {name} has {len(group[name])} signals and q has {n}; "
                            "every joint needs one of each")
    used = (REFERENCE, torque, EXCITATION, SENSOR)
    return Ports(n, torque, EXCITATION in inputs, SENSOR in inputs,
                 tuple(name for name in inputs if name not in used))


def _require(loop: InputOutputSystem, name: str, existing: Collection[str], kind: str,
             remedy: str) -> None:
    if name not in existing:
        raise ClieError(
            f"{loop.name}: the loop has no {kind} {name!r}, and without it the diagnosis cannot "
            f"compare it with a log; {nearest(name, existing)}. Add it with {remedy} of "
            "interconnect")


def as_closed_loop(loop: InputOutputSystem) -> NonlinearIOSystem:
    """Loop as a closed system with a port for torque; a transfer function becomes a realisation.

    A loop with an input u_in is cut at the motor.  It is closed here, so that what enters the
    plant is its output u and the missing torque.

    Raises
    ------
    ClieError
        If it is not a python-control system, or u_in does not fit u.

    """
    import control as ct

    if isinstance(loop, ct.TransferFunction):
        loop = ct.ss(loop, inputs=loop.input_labels, outputs=loop.output_labels, name=loop.name)
    if not isinstance(loop, (ct.NonlinearIOSystem, ct.StateSpace)):
        raise ClieError(f"loop= takes a python-control system, not {type(loop).__name__}; build "
                        "one with ct.nlsys, ct.ss or ct.interconnect")
    return _closed_at_motor(loop) if DELIVERED in ports(loop.input_labels) else loop


def _closed_at_motor(loop: NonlinearIOSystem) -> NonlinearIOSystem:
    """Loop with u_in driven by u, and by a torque that it takes at an input `torque`."""
    from clie_blocks.signals import interconnect, summing

    inputs, outputs = ports(loop.input_labels), ports(loop.output_labels)
    _require(loop, COMMAND, outputs, "output", f"outputs={{'{COMMAND}': 'pd.{COMMAND}', ...}}")
    n = len(inputs[DELIVERED])
    if len(outputs[COMMAND]) != n or TORQUE in inputs:
        raise ClieError(f"{loop.name}: a loop with {n} inputs u_in needs as many outputs u and no "
                        "input torque, since the missing torque enters at u_in")
    inner, motor = f"{loop.name}_open", "motor"
    opened = loop.copy(name=inner)
    return interconnect(
        [opened, summing(COMMAND, TORQUE, output="both", n=n, name=motor)],
        [(f"{inner}.{DELIVERED}", f"{motor}.both"), (f"{motor}.{COMMAND}", f"{inner}.{COMMAND}")],
        inputs={**{name: f"{inner}.{name}" for name in inputs if name != DELIVERED},
                TORQUE: f"{motor}.{TORQUE}"},
        outputs={name: f"{inner}.{name}" for name in outputs}, name=loop.name)
