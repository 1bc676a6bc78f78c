"""What a program computes: derivatives, and the record of every signal that can be logged."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from clie_blocks.compiled.ir.callback import Callback
from clie_blocks.compiled.ir.parameters import Parameters
from clie_blocks.compiled.ir.scalars import with_operands
from clie_blocks.compiled.ir.symbols import Expression, Graph, Symbol, topological


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
    derivatives: list[Expression]
    signals: dict[str, Expression]
    outputs: list[str]
    inputs: list[str]
    states: list[tuple[str, str]]
    parameters: Parameters
    maps: list[dict[int, Expression]] = field(default_factory=list)
    opaque: list[Callback] = field(default_factory=list)

    def names(self) -> dict[Expression, str]:
        """Return the signal names by expression, for the comments of a listing."""
        names: dict[Expression, str] = {}
        for name, expression in self.signals.items():
            names[expression] = f"{names[expression]}, {name}" if expression in names else name
        return names

    def ports(self) -> list[str]:
        """Return lines that name the entries of x, u and y."""
        return [*(f"x[{k}]  {block}.{label}" for k, (block, label) in enumerate(self.states)),
                *(f"u[{k}]  {label}" for k, label in enumerate(self.inputs)),
                *(f"y[{k}]  {label}" for k, label in enumerate(self.outputs))]

    def legend(self, name: str) -> str:
        """Return the docstring of a listing of the diagram `name`: ports and parameters."""
        parameters = self.parameters
        lines = [f'"""Diagram {name}: derivative and record.', "", *self.ports()]
        lines += [f"p[{start}]  {key}{list(parameters.shape[key])}"
                  for key, start in parameters.offset.items()]
        return "\n".join([*lines, '"""'])


@dataclass(frozen=True)
class Layout:
    """The two lists of expressions that an emitter turns into functions.

    Parameters
    ----------
    derivatives : list
        One expression per state.
    record : list
        States, inputs, then every distinct signal.
    slots : dict
        Entry of the record by signal name.
    nu : int
        Number of inputs.
    maps : list of dict
        Of every sampled part, what it stores at its ticks: an expression by state.
    watch : list
        At most one expression: where it is not zero, a run stops.
    opaque : list of Callback
        Functions that are called back.

    """

    derivatives: list[Expression]
    record: list[Expression]
    slots: dict[str, int]
    nu: int
    maps: list[dict[int, Expression]] = field(default_factory=list)
    watch: list[Expression] = field(default_factory=list)
    opaque: list[Callback] = field(default_factory=list)

    @property
    def nx(self) -> int:
        """Number of states."""
        return len(self.derivatives)


def layout(trace: Trace, driven: Mapping[int, Expression] | None = None) -> Layout:
    """Arrange a trace for the emitters."""
    graph, driven = trace.graph, driven or {}
    x = [graph.variable("x", k) for k in range(len(trace.derivatives))]
    u = [graph.variable("u", k) for k in range(len(trace.inputs))]
    stored = [expression for map_ in trace.maps for expression in map_.values()]
    roots = [*trace.derivatives, *x, *u, *trace.signals.values(), *stored]
    final = substitute(roots, {u[k]: expression for k, expression in driven.items()})
    record, slots = final[len(x):2 * len(x) + len(u)], {}
    entry = {expression: k for k, expression in enumerate(record)}
    for k, name in enumerate(trace.signals):
        expression = final[2 * len(x) + len(u) + k]
        if expression not in entry:
            entry[expression] = len(record)
            record.append(expression)
        slots[name] = entry[expression]
    rest = iter(final[len(roots) - len(stored):])
    maps = [{state: next(rest) for state in map_} for map_ in trace.maps]
    return Layout(final[:len(x)], record, slots, len(u), maps, opaque=trace.opaque)


def substitute(roots: Iterable[Expression],
               replacement: Mapping[Symbol, Expression]) -> list[Expression]:
    """Return the expressions with variables replaced."""
    final = dict(replacement)
    if not final:
        return list(roots)
    for node in topological(roots):
        if node in final:
            continue
        final[node] = node if node.op == "variable" else with_operands(
            node, [final[a] if isinstance(a, Symbol) else a for a in node.args])
    return [final[root] if isinstance(root, Symbol) else root for root in roots]
