"""A diagram cut open at a port, so that loop transfers come from the diagram itself."""

import copy

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.signals import Diagram, DiagramError, nearest, ports

STRUCTURAL_ZERO = 1e-7  # ct.linearize differentiates numerically


def cut_open(diagram: Diagram, port: str) -> Diagram:
    """Diagram with the wires into a port cut.

    Parameters
    ----------
    diagram : clie_blocks.signals.Diagram
        A closed loop.
    port : str
        Input port of a block, such as ``'plant.u'``, or one signal of it, ``'plant.u[0]'``.

    Returns
    -------
    clie_blocks.signals.Diagram
        After its own inputs it has one per cut wire, ``'cut[0]'``, and after its own outputs what
        drove the port, ``'driver[0]'``.  Signs are those of the diagram.

    Raises
    ------
    DiagramError
        If there is no such port.

    """
    rows = _input_rows(diagram, port)
    cut = copy.deepcopy(diagram)
    wires, feed, out = diagram.connect_map.copy(), diagram.input_map.copy(), diagram.output_map
    driver = np.zeros((len(rows), out.shape[1]))
    driver[:, :wires.shape[1]] = wires[rows]
    wires[rows], feed[rows] = 0, 0
    entry = np.zeros((len(feed), len(rows)))
    entry[rows, range(len(rows))] = 1
    cut.set_connect_map(wires)
    cut.set_input_map(np.hstack((feed, entry)))
    cut.set_output_map(np.vstack((out, driver)))
    cut.set_inputs([*diagram.input_labels, *(f"cut[{k}]" for k in range(len(rows)))])
    cut.set_outputs([*diagram.output_labels, *(f"driver[{k}]" for k in range(len(rows)))])
    return cut


def transfer(diagram: Diagram, port: str, x: ArrayLike = 0.0, cut: ArrayLike = 0.0,
             output: str = "driver") -> ct.StateSpace:
    """Linear transfer from a cut port to what drove it, or to an output of the diagram.

    Parameters
    ----------
    diagram : clie_blocks.signals.Diagram
        A closed loop.
    port : str
        Where it is cut, see `opened`.
    x : array_like, shape (states,)
        Operating point; the diagram's own inputs are zero there.
    cut : array_like
        Operating point of the signals at the cut.
    output : str
        Base name of the output.

    Returns
    -------
    control.StateSpace
        Only the states on a path from the cut to the output.

    """
    loop = cut_open(diagram, port)
    width = loop.ninputs - diagram.ninputs
    u = np.concatenate((np.zeros(diagram.ninputs), np.broadcast_to(cut, width)))
    system = ct.linearize(loop, np.broadcast_to(x, loop.nstates).astype(float), u)
    return on_path(system[ports(loop.output_labels)[output], diagram.ninputs:])


def on_path(system: ct.StateSpace) -> ct.StateSpace:
    """System without the states that no wire joins to both its inputs and its outputs.

    Parameters
    ----------
    system : control.StateSpace
        A linearised diagram.

    Returns
    -------
    control.StateSpace
        The same transfer with fewer states.

    """
    wired = np.abs(system.A) > STRUCTURAL_ZERO
    driven = _spread(wired, np.any(np.abs(system.B) > STRUCTURAL_ZERO, axis=1))
    seen = _spread(wired.T, np.any(np.abs(system.C) > STRUCTURAL_ZERO, axis=0))
    keep = np.flatnonzero(driven & seen)
    return ct.ss(system.A[np.ix_(keep, keep)], system.B[keep], system.C[:, keep], system.D,
                 inputs=system.input_labels, outputs=system.output_labels)


def _spread(wired: np.ndarray, reached: np.ndarray) -> np.ndarray:
    for _ in range(len(wired)):
        reached = reached | (wired @ reached)
    return reached


def _input_rows(diagram: Diagram, port: str) -> list[int]:
    block, _, base = port.rpartition(".")
    names = [system.name for system in diagram.syslist]
    if block not in names:
        raise DiagramError(f"{diagram.name}: no block {block!r} to cut before; "
                           f"{nearest(block, names)}")
    k = names.index(block)
    labels = diagram.syslist[k].input_labels
    rows = {**ports(labels), **{label: [row] for row, label in enumerate(labels)}}
    if base not in rows:
        raise DiagramError(f"{diagram.name}: block {block!r} has no input {base!r}; "
                           f"{nearest(base, ports(labels))}")
    return [diagram.input_offset[k] + row for row in rows[base]]
