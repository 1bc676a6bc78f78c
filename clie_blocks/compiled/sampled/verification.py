"""A sampled loop is compared with the functions of its plant and parts at random points."""

import warnings

import numpy as np

from clie_blocks.compiled.verification import compare, reference, varied

POINTS = 8
NOTHING = np.zeros(0, np.int64)


def check_sampled(program, joined):
    """Compare the plant's motion and every part's tick with python-control's own functions.

    Parameters
    ----------
    program : SampledProgram
        The compiled loop.
    joined : clie_blocks.signals.Diagram
        Plant and parts, all wires.

    Raises
    ------
    CompiledDifferenceError
        Names the first state or output that differs, with both values.

    """
    generator = np.random.default_rng(2026)
    for point in range(POINTS):
        t, u = generator.uniform(0.0, 10.0), generator.standard_normal(joined.ninputs)
        states = [generator.standard_normal(block.nstates) for block in joined.syslist]
        held = [generator.standard_normal(block.noutputs) for block in joined.syslist]
        params = varied(program, joined, generator) if point % 2 else {}
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            expected = _tick(joined, t, u, states, held, params)
            if expected is not None:
                _compare(program, joined, expected, program.tick(t, states, held, u, params), t)


def _compare(program, joined, expected, got, t):
    for block, *pairs in zip(joined.syslist, *map(zip, expected, got)):
        for kind, labels, (theirs, ours) in zip(
                ("dynamics", "output"), (block.state_labels, block.output_labels), pairs):
            if len(ours):
                compare(kind, [f"{block.name}.{label}" for label in labels], theirs, ours, t)


def _tick(joined, t, u, states, held, params):
    """States at the next tick and outputs of every part; of the plant its rates, no outputs."""
    plant, *parts = joined.syslist
    held, moved = list(held), [None]
    for k, part in enumerate(parts, 1):
        held[0] = _plant_output(joined, t, u, states, held, params)
        if held[0] is None:
            return None
        into = _inputs(joined, k, u, held)
        held[k] = reference(part.output, t, states[k], into, params)
        moved.append(reference(part.dynamics, t, states[k], into, params))
        if held[k] is None or moved[k] is None:
            return None
    moved[0] = reference(plant.dynamics, t, states[0], _inputs(joined, 0, u, held), params)
    return None if moved[0] is None else (moved, [np.zeros(0), *held[1:]])


def _plant_output(joined, t, u, states, held, params):
    plant, found = joined.syslist[0], held[0]
    loops = np.any(joined.connect_map[:plant.ninputs, :plant.noutputs])
    for _ in range(plant.noutputs + 1 if loops else 1):
        found = reference(plant.output, t, states[0], _inputs(joined, 0, u, [found, *held[1:]]),
                          params)
        if found is None:
            break
    return found


def _inputs(joined, k, u, held):
    rows = slice(joined.input_offset[k], joined.input_offset[k] + joined.syslist[k].ninputs)
    return joined.connect_map[rows] @ np.concatenate(held) + joined.input_map[rows] @ u
