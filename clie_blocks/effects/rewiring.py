"""A diagram with some of its blocks replaced by blocks of the same ports."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.signals import Diagram, DiagramError, interconnect, ports

if TYPE_CHECKING:
    import control as ct


def with_blocks(diagram: Diagram, replaced: Mapping[str, ct.NonlinearIOSystem]) -> Diagram:
    """Return the diagram with some blocks replaced, by name, by blocks of the same ports."""
    blocks = [replaced.get(block.name, block) for block in diagram.syslist]
    into = [f"{b.name}.{label}" for b in diagram.syslist for label in b.input_labels]
    out = [f"{b.name}.{label}" for b in diagram.syslist for label in b.output_labels]
    connections = [(into[i], *(_signed(out[k], row[k], diagram.name) for k in np.flatnonzero(row)))
                   for i, row in enumerate(diagram.connect_map) if np.any(row)]
    inputs = {label: [into[i] for i in np.flatnonzero(diagram.input_map[:, k])]
              for k, label in enumerate(diagram.input_labels)}
    outputs = {label: out[int(np.flatnonzero(diagram.output_map[k])[0])]
               for k, label in enumerate(diagram.output_labels)}
    read = diagram.connect_map.any(axis=0) | diagram.output_map[:, :len(out)].any(axis=0)
    return interconnect(blocks, connections, inputs=inputs, outputs=outputs, name=diagram.name,
                        unused=[port for port, used in zip(out, read) if not used])


def controller_of(diagram: Diagram, plant: str) -> str:
    """Name of the block that drives the input `u` of the plant."""
    names = [block.name for block in diagram.syslist]
    k = names.index(plant)
    start = diagram.input_offset[k]
    rows = diagram.connect_map[start:start + diagram.syslist[k].ninputs]
    for block, offset in zip(diagram.syslist, diagram.output_offset):
        if rows[:, offset:offset + block.noutputs].any() and "u" in ports(block.output_labels):
            return block.name
    raise DiagramError(f"{diagram.name}: no block with the output 'u' drives {plant}.u directly; "
                       "effects on the controller need one")


def _signed(port: str, gain: float, name: str) -> str:
    if abs(gain) != 1.0:
        raise DiagramError(f"{name}: the wire from {port} has the gain {gain:g}; "
                           "make it a block so that effects can be inserted")
    return port if gain > 0 else f"-{port}"
