"""A python-control diagram in PathSim: block for block, with the blocks' own functions."""

import functools
from collections.abc import Callable

import control as ct
import loop
import numpy as np
from pathsim import Connection, Simulation
from pathsim.blocks import DynamicalFunction, DynamicalSystem, Source
from pathsim.solvers import RKDP54

from clie_blocks.compiled.frontend.flatten import Leaf, flatten


def simulator(diagram: ct.NonlinearIOSystem) -> Callable[[int], np.ndarray]:
    """Return ``run(steps)``, which takes steps of the loop without noise, and gives the states."""
    flat = flatten(diagram)
    blocks = [_block(leaf) for leaf in flat.leaves]
    sources = [Source(functools.partial(loop.still, label)) for label in diagram.input_labels]
    outputs = [(k, j) for k, leaf in enumerate(flat.leaves) for j in range(leaf.system.noutputs)]
    inputs = [(k, j) for k, leaf in enumerate(flat.leaves) for j in range(leaf.system.ninputs)]
    wires = []
    for (k, j), wire in zip(inputs, flat.wires):
        (kind, index), = wire
        start = sources[index][0] if kind == "u" else blocks[outputs[index][0]][outputs[index][1]]
        wires.append(Connection(start, blocks[k][j]))
    simulation = Simulation([*sources, *blocks], wires, dt=loop.STEP, Solver=RKDP54, log=False)

    def run(steps: int) -> np.ndarray:
        simulation.run((steps - 0.5) * loop.STEP, reset=True, adaptive=False)  # round-off
        return np.concatenate([np.atleast_1d(block.engine.state) for block, leaf
                               in zip(blocks, flat.leaves) if leaf.system.nstates])
    return run


def _block(leaf: Leaf) -> DynamicalFunction | DynamicalSystem:
    system = leaf.system
    system._update_params(leaf.params)  # a block keeps the values that it was last called with
    if not system.nstates:
        return DynamicalFunction(lambda u, t: system._out(t, np.zeros(0), u))
    return DynamicalSystem(lambda x, u, t: system._rhs(t, x, u),
                           lambda x, u, t: system._out(t, x, u), np.zeros(system.nstates))
