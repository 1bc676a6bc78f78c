"""From a diagram to one straight-line program: each block's own functions run once, on symbols."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import control as ct
import numpy as np

from clie_blocks.compiled.frontend.callbacks import call_nodes, reads_inputs
from clie_blocks.compiled.frontend.flatten import Flat, Leaf, Wire, flatten, schedule
from clie_blocks.compiled.frontend.symbol_arrays import flat_scalars, has_symbols, symbol_array
from clie_blocks.compiled.frontend.symbolic_numpy import twin
from clie_blocks.compiled.ir.callback import Callback
from clie_blocks.compiled.ir.layout import Trace
from clie_blocks.compiled.ir.parameters import Parameters, is_numeric
from clie_blocks.compiled.ir.scalars import F, with_operands
from clie_blocks.compiled.ir.symbols import (
    ChangingResultError,
    Expression,
    FrozenParameterError,
    Graph,
    Symbol,
    TraceError,
    topological,
    variables,
)
from clie_blocks.errors import ClieError, nearest
from clie_blocks.labels import DiagramError

BlockFunction = Callable[..., Any]  # of (t, x, u, params)


def trace(diagram: ct.NonlinearIOSystem, held: Iterable[int] = (),
          opaque: Iterable[str] = (), repeated: bool = True) -> Trace:
    """Trace a diagram.

    Each block runs twice, unless `repeated` is False: a result that changes is found then.

    Raises
    ------
    TraceError
        If a block cannot be traced; names the block and the remedy.
    DiagramError
        For an algebraic loop, or an opaque block that does not exist.

    """
    flat = flatten(diagram, held)
    frozen: set[str] = set()
    hidden = _opaque_leaves(diagram, flat, opaque)
    while True:
        try:
            return _Tracer(diagram, flat, frozen, hidden, repeated).trace()
        except _FreezeError as need:
            frozen |= need.keys


def _opaque_leaves(diagram: ct.NonlinearIOSystem, flat: Flat, opaque: Iterable[str]) -> set[str]:
    hidden = {leaf.name for leaf in flat.leaves if getattr(leaf.system, "opaque", False)}
    for name in opaque:
        named = {leaf.name for leaf in flat.leaves if f"{leaf.name}.".startswith(f"{name}.")}
        if not named:
            known = [leaf.name for leaf in flat.leaves]
            raise DiagramError(f"{diagram.name}: no block {name!r} to be opaque; "
                               f"{nearest(name, known)}")
        hidden |= named
    return hidden


class _FreezeError(Exception):
    def __init__(self, keys: set[str]) -> None:
        super().__init__(f"constants needed: {sorted(keys)}")
        self.keys = keys


class _Tracer:
    def __init__(self, diagram: ct.NonlinearIOSystem, flat: Flat, frozen: set[str],
                 hidden: set[str], repeated: bool) -> None:
        self.diagram, self.flat, self.graph = diagram, flat, Graph()
        self.hidden, self.repeated = hidden, repeated
        self.callbacks: list[Callback] = []
        self.parameters = Parameters(frozen=frozen)
        self.outputs: dict[int, Expression] = {}
        self.final: dict[Symbol, Expression] = {}

    def trace(self) -> Trace:
        traced = [self._leaf(leaf) for leaf in self.flat.leaves]
        outputs = [expression for ys, _ in traced for expression in ys]
        for k in self._order(outputs):
            self.outputs[k] = self._compose(outputs[k])
        signals = {name: self._wire(wire) for name, wire in self.flat.signals.items()}
        shown = zip(self.diagram.output_labels, self.flat.outputs)
        signals |= {label: self._wire(wire) for label, wire in shown}
        return Trace(
            self.graph, [self._compose(expression) for _, dx in traced for expression in dx],
            signals, list(self.diagram.output_labels), list(self.diagram.input_labels),
            [(leaf.name, label) for leaf in self.flat.leaves
             for label in leaf.system.state_labels], self.parameters, opaque=self.callbacks)

    def _leaf(self, leaf: Leaf) -> tuple[list[Expression], list[Expression]]:
        system = leaf.system
        x = [self.graph.variable("x", leaf.x + k) for k in range(system.nstates)]
        u = [self._input(leaf.u + k) for k in range(system.ninputs)]
        if isinstance(system, ct.StateSpace):
            return (_linear(system.C, x, system.D, u), _linear(system.A, x, system.B, u))
        y: list[Expression] = [*x]
        if system.outfcn is not None:
            y = self._call(leaf, "output", system.outfcn, x, u)
        dx = self._call(leaf, "update", system.updfcn, x, u) if x else []
        for kind, got, wanted in (("output", y, system.noutputs), ("update", dx, system.nstates)):
            if len(got) != wanted:
                raise DiagramError(f"block {leaf.name!r}: its {kind} function returns "
                                   f"{len(got)} values where {wanted} are declared")
        return y, dx

    def _input(self, index: int) -> Symbol:
        """An input of a block: one of the diagram itself, or what is known once all are traced."""
        wire = self.flat.wires[index]
        if all(kind != "y" for kind, _ in wire):
            source = self._wire(wire)
            if isinstance(source, Symbol):
                return source
        return self.graph.variable("w", index)

    def _call(self, leaf: Leaf, kind: str, function: BlockFunction, x: list[Symbol],
              u: list[Symbol]) -> list[Expression]:
        try:
            return self._run_on_symbols(leaf, kind, function, x, u)
        except TraceError:
            if leaf.name not in self.hidden:
                raise
            return self._call_back(leaf, kind, function, x, u)

    def _call_back(self, leaf: Leaf, kind: str, function: BlockFunction, x: list[Symbol],
                   u: list[Symbol]) -> list[Expression]:
        params = self._params(leaf)
        shown = {key: value for key, value in params.items() if has_symbols(value)}
        callback = Callback(
            f"block {leaf.name!r}, {kind} function", function, len(x), len(u),
            leaf.system.noutputs if kind == "output" else len(x),
            {key: np.shape(leaf.params[key]) for key in shown},
            {key: value for key, value in params.items() if key not in shown})
        inputs = u if reads_inputs(function) else [0.0] * len(u)
        return call_nodes(self.graph, self.callbacks, callback,
                          [self.graph.variable("t"), *x, *inputs, *shown.values()])

    def _run_on_symbols(self, leaf: Leaf, kind: str, function: BlockFunction, x: list[Symbol],
                        u: list[Symbol]) -> list[Expression]:
        t, params = self.graph.variable("t"), self._params(leaf)
        try:
            first, *again = (flat_scalars(twin(function)(t, symbol_array(x), symbol_array(u),
                                                         params))
                             for _ in range(2 if self.repeated else 1))
            if again and list(map(_identity, first)) != list(map(_identity, again[0])):
                raise ChangingResultError(
                    "its result changes from call to call with equal arguments, as with a clock, "
                    "random numbers or a memory of its own; give it inputs and states instead")
            return first
        except FrozenParameterError as need:
            raise _FreezeError({self.parameters.key_of(k) for k in need.slots}) from None
        except ChangingResultError as error:
            raise ChangingResultError(f"block {leaf.name!r}, {kind} function: {error}") from error
        except TraceError as error:
            raise TraceError(f"block {leaf.name!r}, {kind} function: {error}; or have it called "
                             f"back, slowly: opaque=[{leaf.name!r}]") from error
        except ClieError:
            raise
        except Exception as error:
            raise TraceError(
                f"block {leaf.name!r}, {kind} function cannot be traced: "
                f"{type(error).__name__}: {error}. Write it with numpy functions of (t, x, u, "
                "params) that work element by element, without a branch on a signal, or have it "
                f"called back, slowly: opaque=[{leaf.name!r}]") from error

    def _params(self, leaf: Leaf) -> dict[str, Any]:
        seen = dict(leaf.params)
        for key, value in leaf.params.items():
            name = key if key in (self.diagram.params or {}) else f"{leaf.name}.{key}"
            if is_numeric(value) and name not in self.parameters.frozen:
                self.parameters.add(name, value)
                seen[key] = self._symbols(name)
        return seen

    def _symbols(self, key: str) -> Any:
        """A parameter as a block sees it: a symbol or an array of symbols."""
        shape, slots = self.parameters.shape[key], self.parameters.slots(key, self.diagram.name)
        symbols = symbol_array([self.graph.variable("p", k)
                                for k in range(slots.start, slots.stop)])
        return symbols[0] if shape == () else symbols.reshape(shape)

    def _order(self, outputs: list[Expression]) -> list[int]:
        names, needs = {}, {}
        for leaf in self.flat.leaves:
            for k, label in enumerate(leaf.system.output_labels):
                names[leaf.y + k] = f"{leaf.name}.{label}"
        for k, expression in enumerate(outputs):
            reads = {index for kind, index in variables([expression]) if kind == "w"}
            needs[k] = {source for index in reads
                        for kind, source in self.flat.wires[index] if kind == "y"}
        return schedule(needs, names)

    def _compose(self, expression: Expression) -> Expression:
        for node in topological([expression], self.final):
            self.final[node] = self._final(node)
        return self.final[expression] if isinstance(expression, Symbol) else expression

    def _final(self, node: Symbol) -> Expression:
        if node.op == "variable":
            kind, index = node.args
            return self._wire(self.flat.wires[index]) if kind == "w" else node
        return with_operands(node, [self.final[a] if isinstance(a, Symbol) else a
                                    for a in node.args])

    def _wire(self, wire: Wire) -> Expression:
        if not isinstance(self.diagram, ct.InterconnectedSystem):
            return next(self._source(*place) for place in wire)
        total = 0.0  # as python-control sums: a wire holds no negative zero
        for (kind, index), gain in wire.items():
            total = F.add(total, F.mul(gain, self._source(kind, index)))
        return total

    def _source(self, kind: str, index: int) -> Expression:
        return self.outputs[index] if kind == "y" else self.graph.variable(kind, index)


def _identity(value: Expression) -> int | str:
    """Equal of equal expressions alone: symbols are hash-consed."""
    return id(value) if isinstance(value, Symbol) else float(value).hex()


def _linear(state_gain: np.ndarray, x: list[Symbol], input_gain: np.ndarray,
            u: list[Symbol]) -> list[Expression]:
    rows = np.hstack([np.asarray(state_gain), np.asarray(input_gain)])
    return [_dot(row, [*x, *u]) for row in rows]


def _dot(row: np.ndarray, values: Sequence[Expression]) -> Expression:
    total = 0.0
    for gain, value in zip(row, values):
        if gain:
            total = F.add(total, F.mul(float(gain), value))
    return total
