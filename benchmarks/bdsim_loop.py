"""A python-control diagram as a bdsim diagram: block for block, with the blocks' own functions."""

import contextlib
import io
from collections.abc import Callable
from typing import Any

import bdsim
import control as ct
import loop
import numpy as np

from clie_blocks.compiled.frontend.flatten import Leaf, flatten


def simulator(diagram: ct.NonlinearIOSystem) -> Callable[[int], np.ndarray]:
    """Return ``run(steps)``, which takes steps of the loop without noise, and gives the states."""
    flat = flatten(diagram)
    simulation = bdsim.BDSim(banner=False, graphics=False, progress=False, sysargs=False)
    drawn = simulation.blockdiagram()
    time = drawn.TIME()
    drive = drawn.FUNCTION(
        lambda t: np.array([loop.still(label, t) for label in diagram.input_labels]), nin=1,
        name="drive")
    drawn.connect(time, drive)
    owners = {("u", k): ("drive", k) for k in range(diagram.ninputs)}
    for leaf in flat.leaves:
        owners |= {("y", leaf.y + k): (leaf.name, k) for k in range(leaf.system.noutputs)}
    parts = [_Part(drawn, leaf, [owners[source] for wire in
                                 flat.wires[leaf.u:leaf.u + leaf.system.ninputs]
                                 for source in wire]) for leaf in flat.leaves]
    outputs = {"drive": drive} | {part.leaf.name: part.output for part in parts}
    for part in parts:
        part.connect(drawn, time, outputs)
    drawn.compile(report=False)

    def run(steps: int) -> np.ndarray:
        options = {"rtol": 1e30, "atol": 1e30, "first_step": loop.STEP}
        with contextlib.redirect_stdout(io.StringIO()):
            done = simulation.run(drawn, T=steps * loop.STEP, solver="RK45",
                                  max_step=loop.STEP, solver_args=options)
        return done.x[-1]
    return run


class _Part:
    """A block as an output function and, if it has states, a rate function and an integrator."""

    def __init__(self, drawn: Any, leaf: Leaf, wires: list[tuple[str, int]]) -> None:
        self.leaf, self.wires, system, n = leaf, wires, leaf.system, leaf.system.nstates
        self.names = list(dict.fromkeys(name for name, _ in wires))
        system._update_params(leaf.params)  # a block keeps the values that it was last called with
        random = np.random.default_rng(0)
        x, u = random.standard_normal(n), random.standard_normal((2, system.ninputs))
        self.direct = not n or np.any(system._out(1.0, x, u[0]) != system._out(1.0, x, u[1]))
        self.state = drawn.INTEGRATOR(x0=np.zeros(n), name=f"{leaf.name}_x") if n else None
        self.output = self._function(drawn, system._out, self.direct, "y")
        self.rate = self._function(drawn, system._rhs, True, "dx") if n else None

    def _function(self, drawn: Any, function: Callable[..., Any], direct: bool,
                  ending: str) -> Any:
        where = [(self.names.index(name), k) for name, k in self.wires]
        ports = 1 + (self.state is not None) + direct * len(self.names)

        def call(t: float, *values: Any) -> np.ndarray:
            x, signals = (values[0], values[1:]) if self.state is not None else ([], values)
            u = np.array([signals[k][j] for k, j in where]) if direct else np.zeros(len(where))
            return np.asarray(function(t, np.asarray(x), u))
        # in a list, for bdsim cannot count the arguments behind a star
        return drawn.FUNCTION([call], nin=int(ports), name=f"{self.leaf.name}_{ending}")

    def connect(self, drawn: Any, time: Any, outputs: dict[str, Any]) -> None:
        """Wire the blocks."""
        inner = [] if self.state is None else [self.state]
        for block, direct in ((self.output, self.direct), (self.rate, True)):
            if block is not None:
                whole = [outputs[name] for name in self.names] if direct else []
                for port, source in enumerate([time, *inner, *whole]):
                    drawn.connect(source, block[port])
        if inner:
            drawn.connect(self.rate, self.state)
