"""From a diagram to one straight-line program: each block's own functions run once, on symbols."""

from dataclasses import dataclass, field

import control as ct
import numpy as np

from clie_blocks.compiled.frontend.callbacks import Callback, call_nodes, reads_inputs
from clie_blocks.compiled.frontend.flatten import flatten, schedule
from clie_blocks.compiled.frontend.parameters import Parameters, is_numeric
from clie_blocks.compiled.frontend.symbol_arrays import flat_scalars, has_symbols, symbol_array
from clie_blocks.compiled.frontend.symbolic_numpy import twin
from clie_blocks.compiled.ir.scalars import F
from clie_blocks.compiled.ir.symbols import (
    FrozenParameterError,
    Graph,
    Symbol,
    TraceError,
    topological,
    variables,
)
from clie_blocks.errors import ClieError, nearest
from clie_blocks.labels import DiagramError


@dataclass
class Trace:
    """A diagram as expressions of the variables t, x, u and p.

    Parameters
    ----------
    graph : Graph
        Where the expressions live.
    derivatives : list
        One expression per state.
    signals : dict
        One expression per signal, by ``'block.port'`` and by the name of a diagram output.
    outputs : list of str
        The names of the diagram outputs.
    inputs : list of str
        The labels of the diagram inputs.
    states : list of (str, str)
        Block and label of every state.
    parameters : Parameters
        The run-time arguments of the program.
    maps : list of dict
        Of every sampled part, what it stores at its ticks: an expression by state.
    opaque : list of Callback
        Functions that are called back.

    """

    graph: Graph
    derivatives: list
    signals: dict
    outputs: list
    inputs: list
    states: list
    parameters: Parameters
    maps: list = field(default_factory=list)
    opaque: list = field(default_factory=list)


def trace(diagram, held=(), opaque=()):
    """Trace a diagram.

    Parameters
    ----------
    diagram : control.NonlinearIOSystem
        The diagram, left untouched.
    held : iterable of int
        As in `flatten`; such a wire is the variable ``('h', k)``.
    opaque : iterable of str
        Blocks, or diagrams of blocks, whose functions are called back where they cannot be
        traced; a block with the attribute ``opaque = True`` is one of them.

    Returns
    -------
    Trace
        Its program.

    Raises
    ------
    TraceError
        If a block cannot be traced; names the block and the remedy.
    DiagramError
        For an algebraic loop, or an opaque block that does not exist.

    """
    flat, frozen = flatten(diagram, held), set()
    hidden = _opaque_leaves(diagram, flat, opaque)
    while True:
        try:
            return _Tracer(diagram, flat, frozen, hidden).trace()
        except _FreezeError as need:
            frozen |= need.keys


def _opaque_leaves(diagram, flat, opaque):
    hidden = {leaf.name for leaf in flat.leaves if getattr(leaf.system, "opaque", False)}
    for name in opaque:
        found = {leaf.name for leaf in flat.leaves if f"{leaf.name}.".startswith(f"{name}.")}
        if not found:
            known = [leaf.name for leaf in flat.leaves]
            raise DiagramError(f"{diagram.name}: no block {name!r} to be opaque; "
                               f"{nearest(name, known)}")
        hidden |= found
    return hidden


class _FreezeError(Exception):
    def __init__(self, keys):
        super().__init__(f"constants needed: {sorted(keys)}")
        self.keys = keys


class _Tracer:
    def __init__(self, diagram, flat, frozen, hidden):
        self.diagram, self.flat, self.graph = diagram, flat, Graph()
        self.hidden, self.callbacks = hidden, []
        self.parameters = Parameters(frozen=frozen)
        self.outputs, self.final = {}, {}

    def trace(self):
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

    def _leaf(self, leaf):
        system = leaf.system
        x = [self.graph.variable("x", leaf.x + k) for k in range(system.nstates)]
        u = [self.graph.variable("w", leaf.u + k) for k in range(system.ninputs)]
        if isinstance(system, ct.StateSpace):
            return (_linear(system.C, x, system.D, u), _linear(system.A, x, system.B, u))
        y = x if system.outfcn is None else self._call(leaf, "output", system.outfcn, x, u)
        dx = [] if not x else self._call(leaf, "update", system.updfcn, x, u)
        for kind, got, wanted in (("output", y, system.noutputs), ("update", dx, system.nstates)):
            if len(got) != wanted:
                raise DiagramError(f"block {leaf.name!r}: its {kind} function returns "
                                   f"{len(got)} values where {wanted} are declared")
        return y, dx

    def _call(self, leaf, kind, function, x, u):
        try:
            return self._run_on_symbols(leaf, kind, function, x, u)
        except TraceError:
            if leaf.name not in self.hidden:
                raise
            return self._call_back(leaf, kind, function, x, u)

    def _call_back(self, leaf, kind, function, x, u):
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

    def _run_on_symbols(self, leaf, kind, function, x, u):
        t, params = self.graph.variable("t"), self._params(leaf)
        try:
            return flat_scalars(twin(function)(t, symbol_array(x), symbol_array(u), params))
        except FrozenParameterError as need:
            raise _FreezeError({self.parameters.key_of(k) for k in need.slots}) from None
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

    def _params(self, leaf):
        seen = dict(leaf.params)
        for key, value in leaf.params.items():
            name = key if key in (self.diagram.params or {}) else f"{leaf.name}.{key}"
            if is_numeric(value) and name not in self.parameters.frozen:
                self.parameters.add(name, value)
                seen[key] = self.parameters.symbols(self.graph, name)
        return seen

    def _order(self, outputs):
        names, needs = {}, {}
        for leaf in self.flat.leaves:
            for k, label in enumerate(leaf.system.output_labels):
                names[leaf.y + k] = f"{leaf.name}.{label}"
        for k, expression in enumerate(outputs):
            reads = {index for kind, index in variables([expression]) if kind == "w"}
            needs[k] = {source for index in reads
                        for kind, source in self.flat.wires[index] if kind == "y"}
        return schedule(needs, names)

    def _compose(self, expression):
        for node in topological([expression]):
            if node not in self.final:
                self.final[node] = self._final(node)
        return self.final[expression] if isinstance(expression, Symbol) else expression

    def _final(self, node):
        if node.op == "variable":
            kind, index = node.args
            return self._wire(self.flat.wires[index]) if kind == "w" else node
        return getattr(F, node.op)(
            *(self.final[a] if isinstance(a, Symbol) else a for a in node.args))

    def _wire(self, wire):
        total = 0.0
        for (kind, index), gain in wire.items():
            source = self.outputs[index] if kind == "y" else self.graph.variable(kind, index)
            total = F.add(total, F.mul(gain, source))
        return total


def _linear(state_gain, x, input_gain, u):
    rows = np.hstack([np.asarray(state_gain), np.asarray(input_gain)])
    return [_dot(row, [*x, *u]) for row in rows]


def _dot(row, values):
    total = 0.0
    for gain, value in zip(row, values):
        if gain:
            total = F.add(total, F.mul(float(gain), value))
    return total
