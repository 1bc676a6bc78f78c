"""A sampled loop is compared with the functions of its plant and parts at random points."""

import warnings
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.compiled.verification import Comparable, compare, reference, vary_parameters
from clie_blocks.signals import Diagram

POINTS = 8
NOTHING = np.zeros(0, np.int64)

Answer = tuple[list[np.ndarray], list[np.ndarray]]  # states at the next tick, outputs


class Ticking(Comparable, Protocol):
    """What is compared of a compiled loop with sampled parts."""

    def tick(self, t: float, states: Sequence[ArrayLike], held: Sequence[ArrayLike], u: ArrayLike,
             params: Mapping[str, ArrayLike] | None = None) -> Answer:
        """States and outputs after one tick of all parts."""


def check_sampled(program: Ticking, joined: Diagram) -> None:
    """Compare the plant's motion and every part's tick with python-control's own functions.

    Raises
    ------
    CompiledDifferenceError
        Names the first state or output that differs, with both values.

    """
    generator = np.random.default_rng(2026)
    for point in range(POINTS):
        t, u = generator.uniform(0.0, 10.0), generator.standard_normal((joined.ninputs,))
        states = [generator.standard_normal(block.nstates) for block in joined.syslist]
        held = [generator.standard_normal(block.noutputs) for block in joined.syslist]
        params = vary_parameters(program, joined, generator) if point % 2 else {}
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            expected = _tick(joined, t, u, states, held, params)
            if expected is not None:
                _compare(program, joined, expected, program.tick(t, states, held, u, params), t)


def _compare(program: Ticking, joined: Diagram, expected: Answer, got: Answer,
             t: float) -> None:
    for block, *pairs in zip(joined.syslist, *map(zip, expected, got)):
        for kind, labels, (theirs, ours) in zip(
                ("dynamics", "output"), (block.state_labels, block.output_labels), pairs):
            if len(ours):
                compare(kind, [f"{block.name}.{label}" for label in labels], theirs, ours, t)


def _tick(joined: Diagram, t: float, u: np.ndarray, states: list[np.ndarray],
          held: list[np.ndarray], params: Mapping[str, Any]) -> Answer | None:
    """States at the next tick and outputs of every part; of the plant its rates, no outputs."""
    plant, *parts = joined.syslist
    held, moved = list(held), []
    for k, part in enumerate(parts, 1):
        measured = _plant_output(joined, t, u, states, held, params)
        if measured is None:
            return None
        held[0] = measured
        inputs = _inputs(joined, k, u, held)
        output = reference(part.output, t, states[k], inputs, params)
        following = reference(part.dynamics, t, states[k], inputs, params)
        if output is None or following is None:
            return None
        held[k] = output
        moved.append(following)
    rates = reference(plant.dynamics, t, states[0], _inputs(joined, 0, u, held), params)
    return None if rates is None else ([rates, *moved], [np.zeros(0), *held[1:]])


def _plant_output(joined: Diagram, t: float, u: np.ndarray, states: list[np.ndarray],
                  held: list[np.ndarray], params: Mapping[str, Any]) -> np.ndarray | None:
    plant, output = joined.syslist[0], held[0]
    loops = np.any(joined.connect_map[:plant.ninputs, :plant.noutputs])
    for _ in range(plant.noutputs + 1 if loops else 1):
        inputs = _inputs(joined, 0, u, [output, *held[1:]])
        following = reference(plant.output, t, states[0], inputs, params)
        if following is None:
            return None
        output = following
    return output


def _inputs(joined: Diagram, k: int, u: np.ndarray, held: list[np.ndarray]) -> np.ndarray:
    rows = slice(joined.input_offset[k], joined.input_offset[k] + joined.syslist[k].ninputs)
    return joined.connect_map[rows] @ np.concatenate(held) + joined.input_map[rows] @ u
