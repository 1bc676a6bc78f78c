"""A continuous plant under sampled control: one loop with sample and hold.

python-control refuses to join continuous and discrete time.  Here the plant takes fixed steps, the
sampled parts run at their ticks, and what they put out is held in between.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NoReturn

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.compiled.codegen.engine import Engine, available_engine
from clie_blocks.compiled.codegen.lane_layout import Memory
from clie_blocks.compiled.codegen.methods import Method
from clie_blocks.compiled.frontend.callbacks import warn_of_callbacks
from clie_blocks.compiled.ir.layout import Layout, layout
from clie_blocks.compiled.program import Program
from clie_blocks.compiled.sampling.parts import Part, join
from clie_blocks.compiled.sampling.tracing import sampled_trace
from clie_blocks.compiled.sampling.verification import NOTHING, Answer, check_sampled
from clie_blocks.errors import ClieError
from clie_blocks.signals import Diagram


def sampled(plant: ct.NonlinearIOSystem,
            controller: ct.NonlinearIOSystem | Sequence[ct.NonlinearIOSystem],
            period: float | Mapping[str, float] | None = None,
            wires: Sequence[tuple[str, ...]] = (), *,
            inputs: Mapping[str, str | Sequence[str]] | None = None, jitter: Iterable[str] = (),
            name: str = "sampled_loop", engine: str = "llvm") -> SampledProgram:
    """Compile a continuous plant and sampled parts into one loop with sample and hold.

    Parameters
    ----------
    plant : control.NonlinearIOSystem
        The part in continuous time, a block or a diagram.
    controller : control.NonlinearIOSystem or list of them
        The parts in discrete time, or static, each a block or a diagram.  Those that tick at one
        instant run in this order; one reads from another what it held last.
    period : float or dict, optional
        Time between ticks [s] of a part that has no sample time of its own; by name if they
        differ.
    wires : list of (str, str, ...)
        ``('plant.u', 'controller.u')`` wires an input port to an output port; further sources are
        added, ``'-load.tau'`` subtracts.
    inputs : dict, optional
        Loop input to the port, or the list of ports, that it feeds.  By default every port
        without a wire is an input under its own name, or as ``'block_port'`` where two blocks
        have the port.
    jitter : iterable of str
        Parts whose ticks are delayed by the loop input ``'<part>.jitter'`` [s], read when the tick
        is due, rounded to whole steps and limited to less than a period.
    name : str
        Name of the loop.
    engine : str
        ``'llvm'`` or ``'python'``.

    Returns
    -------
    SampledProgram
        Runs as `Program`; every output of plant and parts is an output, named as the inputs are.

    Raises
    ------
    DiagramError
        For ports that do not exist or fit, and parts whose time base does not.
    TraceError
        If a block cannot be traced; names the block and the remedy.
    CompiledDifferenceError
        If the program differs from python-control's own functions.

    Notes
    -----
    At a tick a part reads the plant's outputs and the loop's inputs of this instant; an output of
    the plant that depends on its input at once shows what is held at that moment: new values of
    the parts that ran before, old ones of the others.  The signals of a part are held from tick
    to tick, also in the log.  A block with the attribute
    ``opaque = True`` is called back where it cannot be traced.

    """
    controllers = list(controller) if isinstance(controller, Sequence) else [controller]
    joined, parts = join(plant, controllers, period, wires, inputs, tuple(jitter), name)
    program = SampledProgram(joined, parts, engine)
    check_sampled(program, joined)
    warn_of_callbacks(program.name, program.callbacks)
    return program


class SampledProgram(Program):
    """A continuous plant and sampled parts as one program; made by `sampled`.

    Its attributes are those of `Program`.  Among the states are the values that are held.

    Parameters
    ----------
    joined : clie_blocks.signals.Diagram
        Plant and parts, all wires.
    parts : list of Part
        The sampled ones.
    engine : str
        ``'llvm'`` or ``'python'``.

    """

    period = None

    def __init__(self, joined: Diagram, parts: list[Part], engine: str = "llvm") -> None:
        self.name, self._engines, self._engine = joined.name, {}, available_engine(engine)
        self._trace, self._sampling = sampled_trace(joined, parts)
        self._parameters = self._trace.parameters
        self.inputs, self.outputs = self._trace.inputs, self._trace.outputs
        self.states, self.signals = self._trace.states, list(self._trace.signals)
        self._layout, self.operations = layout(self._trace), len(self._trace.graph)
        self._default = self._build(self._layout, "ode5")
        self._blocks = joined.syslist

    def source(self, language: str = "python", method: str = "ode5") -> str:
        """Return the loop as text.

        Parameters
        ----------
        language : str
            ``'llvm'``; the listings in Python and C know no ticks.
        method : str
            The method of the plant.

        """
        if language != "llvm":
            raise self._unable(f"be written in {language!r}", "write its plant and controller, "
                               "each by itself: compile_diagram(part).source(...)")
        return super().source(language, method)

    def as_nlsys(self) -> NoReturn:
        """Refuse: python-control has no block with two time bases."""
        raise self._unable("become one python-control block, for that has one time base",
                           "use compile_diagram(part).as_nlsys() for each part")

    def _unable(self, what: str, remedy: str) -> ClieError:
        return ClieError(f"{self.name}: a loop with sampled parts cannot {what}; {remedy}")

    def _text(self, arranged: Layout, method: Method, memory: Memory) -> str:
        from clie_blocks.compiled.sampling.native import sampled_module
        return sampled_module(arranged, method, memory, self._sampling)

    def _step_of(self, step: float | None) -> float:
        step = super()._step_of(step)
        for tick in self._sampling.ticks:
            steps = round(tick.period / step)
            if steps < 1 or abs(steps * step - tick.period) > 1e-6 * step:
                raise ClieError(f"{self.name}: the period {tick.period:g} s is not a multiple of "
                                f"the step {step:g} s; use {tick.period / max(1, steps):g} s")
        return step

    def tick(
            self, t: float, states: Sequence[ArrayLike], held: Sequence[ArrayLike], u: ArrayLike,
            params: Mapping[str, ArrayLike] | None = None) -> Answer:
        """Return states and outputs after one tick of all parts, as python-control counts them.

        Parameters
        ----------
        t : float
            Time [s].
        states, held : list of array_like
            States and held outputs of plant and parts, block by block; the plant holds none.
        u : array_like
            Loop inputs, without those that delay ticks.
        params : dict, optional
            Values by key.

        Returns
        -------
        moved : list of ndarray
            Rates of the plant, and the states of every part at its next tick.
        held : list of ndarray
            New outputs of every part; none of the plant.

        """
        blocks, x = self._blocks, self._spread(np.concatenate(states))
        holds = [[self.states.index(("hold", f"{block.name}.{label}"))
                  for label in block.output_labels] for block in blocks[1:]]
        for where, values in zip(holds, held[1:]):
            x[where] = values
        u = np.asarray(u, float)
        u = np.concatenate([u, np.zeros(len(self.inputs) - u.size)])
        p = self._parameters.vector(params, self.name)
        step = min(tick.period for tick in self._sampling.ticks)
        before = x.copy()
        self._default.run(1, step, t, 0, x, u[None], p, 1, NOTHING, np.zeros((1, 0)))
        x[:blocks[0].nstates] = before[:blocks[0].nstates]
        rates = self._default.derivative(t, x, u, p)[:blocks[0].nstates]
        ends = np.cumsum([block.nstates for block in blocks])
        moved = np.split(x[self._sampling.next], ends[:-1])
        return [rates, *moved[1:]], [np.zeros(0), *(x[where] for where in holds)]

    def _shown(self) -> list[int]:
        return self._sampling.shown

    def _spread(self, shown: np.ndarray) -> np.ndarray:
        x = np.zeros((*shown.shape[:-1], len(self.states)))
        x[..., self._sampling.shown] = x[..., self._sampling.next] = shown
        return x

    def _python_engine(self, arranged: Layout, method: Method) -> Engine:
        from clie_blocks.compiled.sampling.python import SampledPythonEngine
        return SampledPythonEngine(arranged, method, self._sampling)
