"""Derivatives of a run with respect to parameters and initial states, one lane for each.

The program is differentiated forward, operation by operation, with the last column of the
operation table; the derivatives of the states are further states behind the states themselves.
"""

import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from clie_blocks.compiled.codegen.lane_layout import Memory
from clie_blocks.compiled.ir.layout import Layout
from clie_blocks.compiled.ir.operations import OPERATIONS
from clie_blocks.compiled.ir.parameters import Parameters
from clie_blocks.compiled.ir.scalars import F
from clie_blocks.compiled.ir.symbols import Expression, Graph, Symbol, topological
from clie_blocks.compiled.runtime.arguments import select
from clie_blocks.compiled.runtime.simulate import Log
from clie_blocks.errors import ClieError, DivergedError, nearest

WIDEST = 16  # columns in one pass

Place = tuple[str, int]  # ('p', slot) of a parameter, ('x', k) of an initial state


@dataclass(frozen=True)
class Derivatives:
    """Derivatives of a response; ``derivatives['pd.gain']`` are those of the outputs.

    Parameters
    ----------
    columns : list of str
        With respect to what: ``'pd.gain'``, ``'plant.damping[0]'``, a state ``'plant.q[0]'``.
    outputs : ndarray, shape (signals, columns, rows)
        Of what was logged.
    states : ndarray, shape (states, columns, rows)
        Of all states.

    """

    columns: list[str]
    outputs: np.ndarray
    states: np.ndarray

    def __getitem__(self, column: str) -> np.ndarray:
        if column not in self.columns:
            raise ClieError(f"no derivative with respect to {column!r}; "
                            f"{nearest(column, self.columns)}")
        return self.outputs[:, self.columns.index(column)]


def tangents(roots: Iterable[Expression], seeds: Mapping[Symbol, Expression]) -> list[Expression]:
    """Return the forward derivatives of expressions."""
    derivative = dict(seeds)
    for node in topological(roots):
        if node not in derivative:
            inner = () if node.op == "variable" else [
                derivative[a] if isinstance(a, Symbol) else 0.0 for a in node.args]
            derivative[node] = _tangent(node, inner) if any(map(_is_some, inner)) else 0.0
    return [derivative[root] if isinstance(root, Symbol) else 0.0 for root in roots]


def _tangent(node: Symbol, inner: Sequence[Expression]) -> Expression:
    operation = OPERATIONS[node.op]
    if operation.tangent:
        return operation.tangent(F, node, node.args, inner)
    terms = [F.mul(partial, tangent)
             for partial, tangent in zip(operation.partials(F, node, *node.args), inner)
             if _is_some(partial) and _is_some(tangent)]
    return functools.reduce(F.add, terms) if terms else 0.0


def _is_some(value: Expression) -> bool:
    return isinstance(value, Symbol) or value != 0.0


def find_columns(parameters: Parameters, names: str | Sequence[str], state_labels: list[str],
            states: str | Sequence[str], owner: str) -> dict[str, Place]:
    """Find parameters and initial states by name.

    Raises
    ------
    ClieError
        For unknown names, with the nearest valid one, or none at all.

    """
    places: dict[str, Place] = {}
    for key in parameters.offset:
        slots = parameters.slots(key, owner)
        entries = [key] if parameters.shape[key] == () else [
            f"{key}[{k}]" for k in range(slots.stop - slots.start)]
        places |= {label: ("p", slots.start + k) for k, label in enumerate(entries)}
    for name in parameters.frozen.intersection([names] if isinstance(names, str) else names):
        parameters.slots(name, owner)
    chosen = {label: places[label] for label in select(list(places), names, owner, "parameter")}
    chosen |= {label: ("x", state_labels.index(label))
              for label in select(state_labels, states, owner, "state")}
    if not chosen:
        raise ClieError(f"{owner}: name at least one parameter or initial state")
    return chosen


class Differentiated:
    """A program with its derivatives, which follow its states, parameters and record.

    Parameters
    ----------
    arranged : Layout
        The program.
    graph : Graph
        Where its expressions live.
    chosen : list of int
        Entries of the record that are outputs.
    parameters : int
        How many parameters the program has.
    places : list of (str, int)
        With respect to what, as from `columns`.
    width : int
        Columns in one pass.

    """

    def __init__(self, arranged: Layout, graph: Graph, chosen: list[int], parameters: int,
                 places: list[Place], width: int) -> None:
        nx, self.width, self.nx = arranged.nx, width, arranged.nx
        self.slots = sorted(index for kind, index in places if kind == "p")
        seeds = {graph.variable("x", k): graph.variable("x", nx + k) for k in range(nx)}
        seeds |= {graph.variable("p", slot): graph.variable("p", parameters + k)
                  for k, slot in enumerate(self.slots)}
        shown = [*range(nx + arranged.nu), *chosen]
        record = [arranged.record[k] for k in shown]
        derived = [*range(nx), *range(nx + arranged.nu, len(shown))]
        self.shown, self.derived = len(record), len(derived)
        record += tangents([record[k] for k in derived], seeds)
        self.layout = Layout([*arranged.derivatives, *tangents(arranged.derivatives, seeds)],
                             record, {}, arranged.nu)
        self.memory = Memory(width, {
            "x": (False,) * nx + (True,) * nx,
            "p": (False,) * parameters + (True,) * len(self.slots),
            "record": (False,) * self.shown + (True,) * self.derived})

    def start(self, x: np.ndarray, places: list[Place]) -> np.ndarray:
        """Return states and parameters' derivatives at the start, packed."""
        return self._pack("x", x, [("x", k) for k in range(self.nx)], places)

    def parameters(self, p: np.ndarray, places: list[Place]) -> np.ndarray:
        """Return parameters and the derivatives of the named ones, packed."""
        return self._pack("p", p, [("p", slot) for slot in self.slots], places)

    def entries(self, count: int) -> np.ndarray:
        """Return the entries of the record that are kept, for so many columns."""
        where = self.memory.positions("record", self.shown + self.derived)
        return np.concatenate([where[:self.shown, 0], where[self.shown:, :count].ravel()])

    def _pack(self, vector: str, values: np.ndarray, rows: list[Place],
              places: list[Place]) -> np.ndarray:
        lanes = np.zeros((len(rows), self.width))
        for lane, place in enumerate(places):
            lanes[:, lane] = [place == row for row in rows]
        shared = np.repeat(np.asarray(values)[:, None], self.width, axis=1)
        return self.memory.pack(vector, np.concatenate([shared, lanes]))

    def split(self, log: Log, count: int) -> tuple[Log, np.ndarray]:
        """Return the log of the program alone, and the derivatives (entries, columns, rows)."""
        derived = log.values[:, self.shown:].reshape(-1, self.derived, count)
        return replace(log, values=log.values[:, :self.shown]), derived.transpose(1, 2, 0)


def run_passes(twin: Differentiated, chosen: Mapping[str, Place],
               run_pass: Callable[[list[Place]], Log]) -> tuple[Log, Derivatives]:
    """Run so many columns at a time.

    Raises
    ------
    DivergedError
        If a derivative becomes infinite or NaN while the states stay finite.

    """
    labels, parts = list(chosen), []
    for first in range(0, len(labels), twin.width):
        part = labels[first:first + twin.width]
        log = run_pass([chosen[label] for label in part])
        done, derived = twin.split(log, len(part))
        end = log.divergence
        if end is not None and end.state >= twin.nx:
            lane = (end.state - twin.nx) % twin.width
            raise DivergedError(
                f"at t = {end.time:.6g} s a derivative with respect to "
                f"{part[min(lane, len(part) - 1)]} is no longer finite, while the states "
                "are; a function has no derivative there, such as the square root of zero")
        parts.append(derived)
        if end is not None:
            break
    whole = np.concatenate(parts, axis=1)
    return done, Derivatives(labels, whole[twin.nx:], whole[:twin.nx])
