"""A loop of a continuous plant and sampled parts as one trace: states, holds and maps.

A wire that leaves a sampled part carries a *hold*, a state that only the part's map changes, at
its ticks.  So no part needs another at the same instant, and there is no algebraic loop between
them.  The states of the trace, in memory::

    plant | holds that the plant reads | other holds | states of the parts | the same, next
          | other signals of the parts, held for the log | waits of delayed ticks

A map stores the states that it computed at its last tick, computes from them and from the plant
what the part puts out now, and its states at the next tick.
"""

from dataclasses import dataclass, replace

from clie_blocks.compiled.frontend.tracing import trace
from clie_blocks.compiled.ir.layout import Trace, substitute
from clie_blocks.compiled.ir.symbols import Expression, Symbol, variables
from clie_blocks.compiled.sampling.parts import Part
from clie_blocks.signals import Diagram


@dataclass(frozen=True)
class Tick:
    """When a map runs.

    Parameters
    ----------
    period : float
        Time between ticks [s].
    jitter : int or None
        The input that delays a tick [s].
    wait : int or None
        The state that keeps by how many steps this one does.

    """

    period: float
    jitter: int | None = None
    wait: int | None = None


@dataclass(frozen=True)
class Sampling:
    """What a sampled loop adds to a program.

    Parameters
    ----------
    moving : int
        How many states, from the first, the right-hand side reads; the others change at ticks.
    shown : list of int
        The states of plant and parts, as the user counts them.
    next : list of int
        Where their values at the next tick lie; a state of the plant is its own.
    ticks : list of Tick
        One per map.

    """

    moving: int
    shown: list[int]
    next: list[int]
    ticks: list[Tick]


def sampled_trace(joined: Diagram, parts: list[Part]) -> tuple[Trace, Sampling]:
    """Trace a sampled loop."""
    return _Sampler(joined, parts).trace()


class _Sampler:
    def __init__(self, joined: Diagram, parts: list[Part]) -> None:
        self.joined, self.parts, plant = joined, parts, joined.syslist[0]
        labels = [f"{part.name}.{label}" for part in joined.syslist
                  for label in part.output_labels]
        columns = range(plant.noutputs, len(labels))
        self.base = trace(joined, held=columns)
        self.graph, self.nx = self.base.graph, plant.nstates
        self.nd = len(self.base.states) - self.nx
        read = {k for kind, k in variables(self.base.derivatives[:self.nx]) if kind == "h"}
        order = sorted(columns, key=lambda column: column not in read)
        self.moving, self.first = self.nx + len(read), self.nx + len(order)
        self.hold = {column: self.nx + k for k, column in enumerate(order)}
        own = self.base.states[self.nx:]
        self.states = [*self.base.states[:self.nx], *(("hold", labels[c]) for c in order), *own,
                       *(("next", f"{block}.{label}") for block, label in own)]

    def trace(self) -> tuple[Trace, Sampling]:
        base, delayed = self.base, [part.name for part in self.parts if part.delayed]
        held: dict[Symbol, Expression] = {
            self.graph.variable("h", c): self._x(k) for c, k in self.hold.items()}
        signals = dict(zip(base.signals, substitute(base.signals.values(), held)))
        flow = substitute(base.derivatives[:self.nx], held)
        maps = [self._map(block, held, signals) for block in range(1, len(self.parts) + 1)]
        ticks = [self._tick(part, delayed) for part in self.parts]
        traced = replace(
            base, derivatives=[*flow, *[0.0] * (len(self.states) - self.nx)], signals=signals,
            inputs=[*base.inputs, *(f"{name}.jitter" for name in delayed)], states=self.states,
            maps=maps)
        plant, own = range(self.nx), range(self.first, self.first + self.nd)
        return traced, Sampling(self.moving, [*plant, *own],
                                [*plant, *(k + self.nd for k in own)], ticks)

    def _map(self, block: int, held: dict[Symbol, Expression],
             signals: dict[str, Expression]) -> dict[int, Expression]:
        """Return the map of a part; `signals` of the part become what is held of them."""
        system, base = self.joined.syslist[block], self.base
        start, column = self.joined.state_offset[block], self.joined.output_offset[block]
        now = {start + k: self.first - self.nx + start + k for k in range(system.nstates)}
        stored = {slot + self.nd: base.derivatives[k] for k, slot in now.items()}
        stored |= {self.hold[column + k]: base.signals[f"{system.name}.{label}"]
                   for k, label in enumerate(system.output_labels)}
        place: dict[Expression, int] = {
            self.graph.variable("x", k): slot for k, slot in now.items()}
        place |= {expression: slot for slot, expression in stored.items()
                  if slot < self.first and isinstance(expression, Symbol)}
        for name, expression in base.signals.items():
            if name.startswith(f"{system.name}.") and isinstance(expression, Symbol):
                if expression not in place:
                    place[expression] = self._new_state("hold", name)
                    stored[place[expression]] = expression
                signals[name] = self._x(place[expression])
        awake = held | {self.graph.variable("x", k): self._x(slot + self.nd)
                        for k, slot in now.items()}
        fresh = dict(zip(stored, substitute(stored.values(), awake)))
        return {**{slot: self._x(slot + self.nd) for slot in now.values()}, **fresh}

    def _tick(self, part: Part, delayed: list[str]) -> Tick:
        if not part.delayed:
            return Tick(part.period)
        return Tick(part.period, len(self.base.inputs) + delayed.index(part.name),
                    self._new_state("wait", part.name))

    def _new_state(self, block: str, label: str) -> int:
        self.states.append((block, label))
        return len(self.states) - 1

    def _x(self, k: int) -> Symbol:
        return self.graph.variable("x", k)
