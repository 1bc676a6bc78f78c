"""A python-control diagram in Drake: block for block, as leaf systems in Python."""

from collections.abc import Callable

import control as ct
import loop
import numpy as np
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import (
    BasicVector,
    Context,
    ContinuousState,
    DiagramBuilder,
    LeafSystem,
)

from clie_blocks.compiled.frontend.flatten import Leaf, flatten


def simulator(diagram: ct.NonlinearIOSystem) -> Callable[[int], np.ndarray]:
    """Return ``run(steps)``, which takes steps of the loop without noise, and gives the states."""
    flat, builder = flatten(diagram), DiagramBuilder()
    owners = {("u", k): ("drive", k) for k in range(diagram.ninputs)}
    for leaf in flat.leaves:
        owners |= {("y", leaf.y + k): (leaf.name, k) for k in range(leaf.system.noutputs)}
    widths = {"drive": diagram.ninputs} | {
        leaf.name: leaf.system.noutputs for leaf in flat.leaves}
    parts = [builder.AddSystem(_Part(leaf, [
        owners[source] for wire in flat.wires[leaf.u:leaf.u + leaf.system.ninputs]
        for source in wire], widths)) for leaf in flat.leaves]
    outputs = {part.leaf.name: part.get_output_port() for part in parts}
    outputs["drive"] = builder.AddSystem(_Drive(diagram.input_labels)).get_output_port()
    for part in parts:
        for port, name in enumerate(part.names):
            builder.Connect(outputs[name], part.get_input_port(port))
    simulation = Simulator(builder.Build())
    # Drake's own runge_kutta5 is Dormand-Prince
    ResetIntegratorFromFlags(simulation, "runge_kutta5", loop.STEP)
    simulation.get_mutable_integrator().set_fixed_step_mode(True)

    def run(steps: int) -> np.ndarray:
        context = simulation.get_mutable_context()
        context.SetTime(0.0)
        context.SetContinuousState(np.zeros(context.num_continuous_states()))
        simulation.Initialize()
        simulation.AdvanceTo(steps * loop.STEP)
        return context.get_continuous_state_vector().CopyToVector()
    return run


class _Drive(LeafSystem):
    """The inputs of the loop."""

    def __init__(self, labels: list[str]) -> None:
        super().__init__()
        self.DeclareVectorOutputPort(
            "y", len(labels), lambda context, y: y.SetFromVector(
                [loop.still(label, context.get_time()) for label in labels]),
            prerequisites_of_calc={self.time_ticket()})


class _Part(LeafSystem):
    """A block with one input for each block that it listens to."""

    def __init__(self, leaf: Leaf, wires: list[tuple[str, int]], widths: dict[str, int]) -> None:
        super().__init__()
        self.leaf, system, n = leaf, leaf.system, leaf.system.nstates
        self.names = list(dict.fromkeys(name for name, _ in wires))
        self.where = [(self.names.index(name), k) for name, k in wires]
        system._update_params(leaf.params)  # a block keeps the values that it was last called with
        for name in self.names:
            self.DeclareVectorInputPort(name, widths[name])
        random = np.random.default_rng(0)
        x, u = random.standard_normal(n), random.standard_normal((2, system.ninputs))
        self.direct = not n or np.any(system._out(1.0, x, u[0]) != system._out(1.0, x, u[1]))
        if n:
            self.DeclareContinuousState(n)
        needs = {self.time_ticket(), self.xc_ticket()}
        self.DeclareVectorOutputPort(
            "y", system.noutputs, self._output, prerequisites_of_calc=needs | (
                {self.all_input_ports_ticket()} if self.direct else set()))

    def _inputs(self, context: Context) -> np.ndarray:
        signals = [self.get_input_port(k).Eval(context) for k in range(len(self.names))]
        return np.array([signals[port][k] for port, k in self.where])

    def _output(self, context: Context, y: BasicVector) -> None:
        x = context.get_continuous_state_vector().CopyToVector()
        u = self._inputs(context) if self.direct else np.zeros(len(self.where))
        y.SetFromVector(self.leaf.system._out(context.get_time(), x, u))

    def DoCalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:  # noqa: N802, Drake's name
        """Give Drake the rates of the block's states."""
        x = context.get_continuous_state_vector().CopyToVector()
        rates = self.leaf.system._rhs(context.get_time(), x, self._inputs(context))
        derivatives.get_mutable_vector().SetFromVector(rates)
