"""A compiled diagram: run it, read it, hand it back."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.compiled.cache.signature import Description
from clie_blocks.compiled.codegen.engine import Engine, available_engine
from clie_blocks.compiled.codegen.lane_layout import SINGLE, Memory
from clie_blocks.compiled.codegen.methods import SAMPLED, Method, method_named
from clie_blocks.compiled.codegen.python import PythonEngine, source
from clie_blocks.compiled.frontend.callbacks import warn_of_callbacks
from clie_blocks.compiled.frontend.tracing import trace
from clie_blocks.compiled.ir.callback import Callback
from clie_blocks.compiled.ir.evaluation import Interpreted
from clie_blocks.compiled.ir.layout import Layout, layout
from clie_blocks.compiled.ir.symbols import Symbol
from clie_blocks.compiled.runtime.api import Studies
from clie_blocks.compiled.runtime.arguments import count_steps, select, state_vector
from clie_blocks.compiled.runtime.events import Bounds, StopBounds
from clie_blocks.compiled.runtime.inputs import Inputs, Rows, bind_inputs
from clie_blocks.compiled.runtime.simulate import Plan, simulate
from clie_blocks.compiled.verification import POINTS, check
from clie_blocks.errors import ClieError, nearest

QUICK_POINTS = 2  # with the default parameters, and with others
KEPT_ARRANGEMENTS = 32  # of a program for inputs that are part of it
LARGE = 2000  # operations; python-control takes tens of milliseconds to evaluate so many once


def compile_diagram(diagram: ct.NonlinearIOSystem, engine: str = "llvm",
                    opaque: Iterable[str] = ()) -> Program:
    """Compile a diagram to machine code.

    Parameters
    ----------
    diagram : control.NonlinearIOSystem
        A diagram in continuous or discrete time, nested or not, or a single block.
    engine : str
        ``'llvm'``, or ``'python'`` for plain Python, slower, without llvmlite.
    opaque : iterable of str
        Names of blocks that are called back where they cannot be traced, slowly; a warning reports
        what that costs.  Without such a call they are traced like the others.

    Returns
    -------
    Program
        Checked against the diagram at random points.

    Raises
    ------
    TraceError
        If a block cannot be traced; names the block and the remedy.
    DiagramError
        For an algebraic loop, named signal by signal.
    CompiledDifferenceError
        If the program differs from the diagram.

    Notes
    -----
    Every block function ``(t, x, u, params)`` runs once, on symbols, so it must be pure numpy or
    math without a branch on a signal.  Arithmetic follows numpy bit by bit up to the last digit
    of the elementary functions, with one exception: a constant zero times a signal is zero, also
    where the signal is infinite or NaN.  Small linear systems are solved with row exchange.

    """
    if isinstance(diagram, ct.TransferFunction):
        diagram = ct.ss(diagram, name=diagram.name)
    program = Program(diagram, engine, opaque)
    check(program, diagram, QUICK_POINTS if program.cached or program.is_large else POINTS)
    warn_of_callbacks(program.name, program.callbacks)
    return program


class Program(Studies):
    """A diagram as one straight-line program; made by `compile_diagram`.

    Parameters
    ----------
    diagram : control.NonlinearIOSystem
        The diagram.
    engine : str
        ``'llvm'`` or ``'python'``.
    opaque : iterable of str
        Blocks that are called back where they cannot be traced.
    repeated : bool
        Whether each block is traced twice, to find a result that changes.

    Attributes
    ----------
    name : str
        Name of the diagram.
    inputs, outputs : list of str
        Labels of the diagram.
    states : list of (str, str)
        Block and label of every state.
    signals : list of str
        Everything that can be logged: the outputs, and every port of every block.
    period : float or None
        Sample time of a diagram in discrete time [s].
    params : dict
        Default value by key.
    operations : int
        How many of them a step takes, about.

    """

    def __init__(self, diagram: ct.NonlinearIOSystem, engine: str = "llvm",
                 opaque: Iterable[str] = (), repeated: bool = True) -> None:
        self.name, self._engines, self._engine = diagram.name, {}, available_engine(engine)
        self._trace = trace(diagram, opaque=opaque, repeated=repeated)
        self._parameters = self._trace.parameters
        self.inputs, self.outputs = self._trace.inputs, self._trace.outputs
        self.states, self.signals = self._trace.states, list(self._trace.signals)
        self._layout, self.operations = layout(self._trace), len(self._trace.graph)
        self.period = None if not diagram.dt else 1.0 if diagram.dt is True else diagram.dt

    def __repr__(self) -> str:
        clock = "" if self.period is None else f", every {self.period:g} s"
        return (f"<program {self.name}: {len(self.inputs)} inputs, {len(self.states)} states, "
                f"{len(self.outputs)} outputs, {self.operations} operations{clock}>")

    @functools.cached_property
    def _driven(self) -> dict[tuple[tuple[int, Symbol | str], ...], Layout]:
        """Arrangements of the last constant and closed-form inputs."""
        return {}

    @functools.cached_property
    def _default(self) -> Engine:
        return self._build(self._layout, "ode5")

    def interpreted(self) -> Interpreted:
        """Return the same program, evaluated operation by operation."""
        return Interpreted(self.name, self.states, self.outputs, self.params, self._layout,
                           self._parameters)

    @property
    def params(self) -> dict[str, Any]:
        """Default value by key."""
        parameters = self._parameters
        return {key: parameters.part(key, parameters.defaults).copy()[()]
                for key in parameters.offset}

    @property
    def description(self) -> Description:
        """What the arguments and results are called, and where they lie."""
        return Description(self.name, self.inputs, self.outputs, self.states, self._layout.slots,
                           len(self._layout.record), self._parameters, self.period,
                           self.operations)

    @property
    def callbacks(self) -> list[Callback]:
        """Functions of opaque blocks that the program calls back."""
        return self._trace.opaque

    @property
    def is_large(self) -> bool:
        """Whether the diagram takes thousands of operations."""
        return self.operations > LARGE

    @property
    def cached(self) -> bool:
        """Whether the machine code came from the disk."""
        return self._default.cached

    def dynamics(self, t: float, x: ArrayLike, u: ArrayLike,
                 params: Mapping[str, ArrayLike] | None = None) -> np.ndarray:
        """Derivatives of the states, as ``diagram.dynamics``."""
        p = self._parameters.vector(params, self.name)
        return self._default.derivative(t, np.asarray(x), np.asarray(u), p)

    def output(self, t: float, x: ArrayLike, u: ArrayLike,
               params: Mapping[str, ArrayLike] | None = None) -> np.ndarray:
        """Outputs, as ``diagram.output``."""
        p = self._parameters.vector(params, self.name)
        record = self._default.observe(t, np.asarray(x), np.asarray(u), p)
        return record[[self._layout.slots[name] for name in self.outputs]]

    def run(
            self, duration: float, step: float | None = None, method: str = "ode5",
            inputs: Inputs = None,
            initial_state: ArrayLike | Mapping[str, ArrayLike] | None = None,
            params: Mapping[str, ArrayLike] | None = None, log: str | Sequence[str] | None = None,
            every: int = 1,
            stop: StopBounds | None = None) -> ct.TimeResponseData:
        """Simulate with a fixed step.

        Parameters
        ----------
        duration : float
            Simulated time [s], a multiple of the step.
        step : float, optional
            Step [s], by default 0.1 ms; a diagram in discrete time steps by its sample time.
        method : str
            ``'ode1'`` Euler, ``'ode2'`` Heun, ``'ode3'`` Bogacki-Shampine, ``'ode4'``
            Runge-Kutta, ``'ode5'`` Dormand-Prince: Simulink's fixed-step methods.
        inputs : dict, optional
            By base name (``'q_d'``) or label (``'q_d[0]'``); every diagram input needs one of:

            - a constant, or an array of shape (n,): constant;
            - an array of shape (steps, n): one row per step, *held* over all stages of it;
            - `held_normal`: noise, held likewise;
            - a function of time that returns (n,): evaluated at every stage.

            Held matters: python-control interpolates between rows, so that a stage at the end
            of the step sees the next sample.  On noise the two differ by far more than the
            error of the method; Simulink and a sampled controller hold.
        initial_state : array_like or dict, optional
            All states in the diagram's order, or values by block (``{'plant': [...]}``); zero
            by default.
        params : dict, optional
            Values by key, instead of the diagram's; no new compilation.
        log : str or list of str, optional
            What the response holds as outputs: names (``'q'``, ``'update.theta_hat'``) or
            patterns (``'pd*.u'``) among `signals`; by default the diagram's outputs.
        every : int
            One row is kept every so many steps.
        stop : dict, optional
            Bounds ``(low, high)`` by name or pattern among `signals`, None for an open side:
            ``{'q': (-2.0, 2.0), 'pd.u[0]': (None, 30.0)}``.  The run ends at the first step at
            which one of them is outside, or is not a number; that step is the last row.  Fixed
            steps do not search for the crossing: it lies within the step before.

        Returns
        -------
        control.TimeResponseData
            With ``.time``, ``.outputs``, ``.states``, ``.inputs`` and ``.plot()``; its
            attribute ``stopped`` is None, or a `Stop` that names time, signal and reason.

        Raises
        ------
        ClieError
            For unknown names, with the nearest valid one, and wrong shapes.
        DivergedError
            If a state becomes infinite or NaN: names time, block and state; its attribute
            `response` holds what was computed until then.

        """
        step = self._step_of(step)
        steps = count_steps(duration, step, every)
        rows, arranged = self._drive(inputs, steps, step)
        bounds = Bounds(stop or {}, self.signals, self.name)
        watched = [arranged.slots[name] for name in bounds.labels]
        arranged = replace(arranged, watch=bounds.watch(
            self._trace.graph, [arranged.record[slot] for slot in watched],
            self._parameters.defaults.size))
        engine = self._build(arranged, method)
        chosen = self.outputs if log is None else select(self.signals, log, self.name)
        entries = [*range(arranged.nx + arranged.nu), *(arranged.slots[name] for name in chosen)]
        plan = Plan(steps, int(every), float(step), np.array(entries, np.int64))
        p = np.append(self._parameters.vector(params, self.name), bounds.values)
        x = self._spread(state_vector(self._shown_states(), initial_state, self.name))
        done = simulate(engine, plan, x, p, rows, f"running {self.name}",
                        lambda time, record: bounds.stop(time, record[watched]))
        response = self._response(done, chosen)
        response.stopped = done.stop
        if done.divergence is not None:
            raise self._diverged(done.divergence, response)
        return response

    def as_nlsys(self) -> ct.NonlinearIOSystem:
        """Return the program as one flat `control.NonlinearIOSystem`, for all of python-control.

        Labels and parameters are those of the diagram, and so are the results of
        `control.input_output_response`, `control.linearize` and `control.find_operating_point`;
        a parameter that no block has is refused.
        """
        from clie_blocks.compiled.runtime.flat_system import flat_system
        return flat_system(self, self.params, self._default,
                           [self._layout.slots[name] for name in self.outputs],
                           lambda params: self._parameters.vector(params, self.name))

    def source(self, language: str = "python", method: str = "ode5") -> str:
        """Return the program as text.

        Parameters
        ----------
        language : str
            ``'python'``, a listing with the diagram's names in comments; ``'torch'``, the same
            for tensors, with constants made by a function ``number``; ``'c'``, a self-contained
            C99 file; or ``'llvm'``.
        method : str
            The method of the C file's ``step`` and of the LLVM loop.

        """
        if language == "python":
            return source(self._layout, self._trace.names(), self._trace.legend(self.name))
        if language == "torch":
            return source(self._layout, self._trace.names(), self._trace.legend(self.name),
                          number="number", library="torch")
        if language == "llvm":
            return self._text(self._layout, self._method(method), SINGLE)
        if language == "c":
            from clie_blocks.compiled.codegen import c
            return c.source(self.name, self._layout,
                            [self._trace.signals[name] for name in self.outputs],
                            self._parameters, self._method(method), self._trace.ports())
        raise ClieError(f"no source in {language!r}; "
                        f"{nearest(language, ['python', 'torch', 'c', 'llvm'])}")

    def machine_text(self, entries: Sequence[int], memory: Memory) -> str:
        """Return the LLVM text of a batch that records only these entries of the record.

        What depends on parameters alone is computed once a run; the last digit of quotients by
        it may differ.
        """
        from clie_blocks.compiled.codegen.hoisting import hoisted
        from clie_blocks.compiled.codegen.native import module_of_runs

        record = [self._layout.record[k] for k in entries]
        apart = hoisted(replace(self._layout, record=record, slots={}))
        return module_of_runs(apart, self._method("ode5"), memory, self._parameters.defaults.size)

    def _drive(self, inputs: Inputs, steps: int, step: float) -> tuple[Rows, Layout]:
        rows, driven = bind_inputs(self._trace.graph, self.inputs, inputs, steps, step)
        key = tuple((k, one if isinstance(one, Symbol) else float(one).hex())
                    for k, one in driven.items())  # equal expressions are one object
        if not driven:
            return rows, self._layout
        if key not in self._driven:
            if len(self._driven) == KEPT_ARRANGEMENTS:
                del self._driven[next(iter(self._driven))]
            self._driven[key] = layout(self._trace, driven)
        return rows, self._driven[key]

    def _step_of(self, step: float | None) -> float:
        if self.period is None:
            return 1e-4 if step is None else step
        if step not in (None, self.period):
            raise ClieError(f"{self.name} is a diagram in discrete time with the sample time "
                            f"{self.period:g} s; it cannot take steps of {step:g} s")
        return self.period

    def _method(self, name: str) -> Method:
        return method_named(name) if self.period is None else SAMPLED

    def _build(self, arranged: Layout, method_name: str, memory: Memory = SINGLE) -> Engine:
        method = self._method(method_name)
        if self._engine == "python":
            return self._python_engine(arranged, method)
        from clie_blocks.compiled.codegen.native import NativeEngine
        key = (method.name, tuple(arranged.derivatives), tuple(arranged.record),
               tuple(arranged.watch), *(tuple(stored.items()) for stored in arranged.maps),
               memory.key)
        if key not in self._engines:
            self._engines[key] = NativeEngine(arranged, method, memory,
                                              self._text(arranged, method, memory))
        return self._engines[key]

    def _python_engine(self, arranged: Layout, method: Method) -> Engine:
        return PythonEngine(arranged, method)

    def _text(self, arranged: Layout, method: Method, memory: Memory) -> str:
        from clie_blocks.compiled.codegen.native import module
        return module(arranged, method, memory)
