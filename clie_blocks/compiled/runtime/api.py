"""What a program offers beyond one run: many runs at once, and derivatives."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.compiled.codegen.engine import Engine
from clie_blocks.compiled.codegen.lane_layout import SINGLE, Memory
from clie_blocks.compiled.ir.layout import Layout, Trace
from clie_blocks.compiled.ir.parameters import Parameters
from clie_blocks.compiled.runtime.arguments import count_steps, select, state_vector
from clie_blocks.compiled.runtime.inputs import Inputs, Rows
from clie_blocks.compiled.runtime.simulate import DivergedRunError, Divergence, Log, Plan, simulate
from clie_blocks.errors import ClieError

if TYPE_CHECKING:
    import control as ct

    from clie_blocks.compiled.reduce import Reduction
    from clie_blocks.compiled.runtime.batch import Batch
    from clie_blocks.compiled.runtime.sensitivities import Derivatives, Place

MANY = 3000  # operations, whose values in two registers each go through the memory


class Batches:
    """Many runs at once: what a program can do that knows its machine code and its labels."""

    name: str
    inputs: list[str]
    outputs: list[str]
    states: list[tuple[str, str]]
    signals: list[str]
    period: float | None
    operations: int
    _engine: str
    _engines: dict[tuple, Engine]
    _layout: Layout
    _parameters: Parameters

    def _drive(self, inputs: Inputs, steps: int, step: float) -> tuple[Rows, Layout]:
        """Rows of the inputs, and the layout with inputs that are functions of time."""
        raise NotImplementedError

    def _step_of(self, step: float | None) -> float:
        """Step of a run [s]."""
        raise NotImplementedError

    def _build(self, arranged: Layout, method_name: str, memory: Memory = SINGLE) -> Engine:
        """Engine that runs a layout."""
        raise NotImplementedError

    def batch(self, duration: float, step: float | None = None, method: str = "ode5",
              inputs: Inputs = None,
              initial_state: ArrayLike | Mapping[str, ArrayLike] | None = None,
              params: Mapping[str, ArrayLike] | None = None,
              log: str | Sequence[str] | None = None, every: int = 1,
              reduce: Mapping[str, Reduction] | None = None, threads: int | None = None) -> Batch:
        """Simulate many parameter sets at once: side by side in each processor, on all of them.

        Every run equals that of `run` with the same parameters, to round-off.  A run that
        diverges ends as NaN, is marked in ``diverged`` and disturbs no other.

        Parameters
        ----------
        duration, step, method, inputs, every
            As for `run`, the same for all runs.
        initial_state : array_like or dict, optional
            As for `run`, or one row per run: (N, states), or (N, n) by block.
        params : dict
            By key, run by run: N numbers, or (N, n) for a parameter of shape (n,).  One number
            serves all runs; one vector for all runs is written ``[[...]]``.
        log : str or list of str, optional
            Signals of which every row is kept; by default the diagram's outputs, or none where
            `reduce` is given.
        reduce : dict, optional
            By a name of your choice, a reduction of `clie_blocks.compiled.reduce`: mean, mean
            square of a signal or of a difference, extremum, integral, final value, or your own.
            It is computed during the runs, so that no long record is stored.
        threads : int, optional
            By default one per processor.

        Returns
        -------
        Batch
            With ``.time``, ``.outputs``, ``.final_state``, ``.diverged``; ``batch['name']``
            is the reduction of that name.  The first axis counts runs.

        Raises
        ------
        ClieError
            For unknown names, with the nearest valid one, wrong shapes, and rows that would
            not fit into memory.

        Examples
        --------
        ::

            gains = np.geomspace(1, 100, 1000)
            done = program.batch(100.0, inputs=..., params={"update.gamma": gains}, reduce={
                "error": reduce.mean_square("q", minus="model.q", start=50.0)})
            best = gains[done["error"].sum(axis=1).argmin()]

        """
        from clie_blocks.compiled.runtime.batch import lanes_and_threads, run_batch
        from clie_blocks.compiled.runtime.parameter_sets import parameter_sets
        from clie_blocks.compiled.runtime.recorder import Recorder, Schedule
        step = self._step_of(step)
        steps = count_steps(duration, step, every)
        rows, arranged = self._drive(inputs, steps, step)
        sets = parameter_sets(self._parameters, params, self._shown_states(),
                              initial_state, self.name)
        sets = replace(sets, x=self._spread(sets.x))
        if log is None:
            log = [] if reduce else self.outputs
        schedule = Schedule(steps, int(every), float(step))
        recorder = Recorder(self.signals, select(self.signals, log, self.name), reduce or {},
                        schedule, len(sets), self.name)
        width, threads = lanes_and_threads(len(sets), threads, self.lanes)
        done = run_batch(lambda arranged, memory: self._build(arranged, method, memory),
                         arranged, schedule, sets, rows, recorder, width, threads,
                         f"running {self.name} {len(sets)} times")
        return replace(done, final_state=done.final_state[:, self._shown()])

    def compile(self, log: str | Sequence[str], parameters: Collection[str], width: int) -> None:
        """Compile what `batch` runs, before it is needed.

        Parameters
        ----------
        log : str or list of str
            Signals of which every row is kept.
        parameters : collection of str
            Those that are given run by run.
        width : int
            Number of runs side by side.

        """
        from clie_blocks.compiled.runtime.batch import lanes_of_runs

        own = np.zeros(self._parameters.defaults.size, bool)
        for key in parameters:
            own[self._parameters.slots(key, self.name)] = True
        arranged, memory = lanes_of_runs(
            self._layout, select(self.signals, log, self.name), width, own)
        self._build(arranged, "ode5", memory)

    @property
    def lanes(self) -> int:
        """The most runs of a batch that go side by side, at little more than the cost of one."""
        if self._engine == "python" or self._layout.opaque:
            return 1
        from clie_blocks.compiled.codegen.machine import lane_width, register_width
        return register_width() if self.operations > MANY else lane_width()

    def _shown(self) -> list[int]:
        """States that the user knows; a sampled loop has others."""
        return list(range(len(self.states)))

    def _shown_states(self) -> list[tuple[str, str]]:
        return [self.states[k] for k in self._shown()]

    def _spread(self, shown: np.ndarray) -> np.ndarray:
        """All states of vectors of the shown ones."""
        return shown


class Studies(Batches):
    """Batches and derivatives; the part of `Program` that needs more than one run."""

    _trace: Trace

    def sensitivities(self, names: str | Sequence[str], duration: float, step: float | None = None,
                      method: str = "ode5", inputs: Inputs = None,
                      initial_state: ArrayLike | Mapping[str, ArrayLike] | None = None,
                      params: Mapping[str, ArrayLike] | None = None,
                      log: str | Sequence[str] | None = None, every: int = 1,
                      states: str | Sequence[str] = ()) -> tuple[ct.TimeResponseData, Derivatives]:
        """Simulate, with the derivatives of all that is logged.

        They are those of the fixed-step run itself, exact to round-off: the program is
        differentiated forward, one lane per column.  Where a function has a kink or a jump
        (sign, abs, where, clip, floor, a comparison) the derivative is that of the branch that
        is taken; that the instant of the switch moves with a parameter is not seen.

        Parameters
        ----------
        names : str or list of str
            Parameters: keys (all entries), entries (``'plant.damping[0]'``) or patterns.
        duration, step, method, inputs, initial_state, params, log, every
            As for `run`.
        states : str or list of str, optional
            Initial states, by label (``'plant.q[0]'``), base name or pattern.

        Returns
        -------
        response : control.TimeResponseData
            As from `run`.
        derivatives : Derivatives
            ``.outputs`` (signals, columns, rows), ``.states``, ``.columns``;
            ``derivatives['pd.gain']`` is one column of the outputs.

        Raises
        ------
        ClieError
            As for `run`; also for a sampled loop or an opaque block, which are not
            differentiated.
        DivergedError
            If a state or a derivative becomes infinite or NaN.

        """
        from clie_blocks.compiled.runtime import sensitivities
        step = self._step_of(step)
        steps = count_steps(duration, step, every)
        _, arranged = self._drive(inputs, steps, step)
        if arranged.maps or arranged.opaque:
            kind = "a sampled loop" if arranged.maps else "an opaque block"
            raise ClieError(f"{self.name}: {kind} is not differentiated; take central "
                            "differences of batch() with the parameter a little up and down")
        chosen = self.outputs if log is None else select(self.signals, log, self.name)
        columns = sensitivities.find_columns(
            self._parameters, names, [".".join(state) for state in self.states], states, self.name)
        twin = sensitivities.Differentiated(
            arranged, self._trace.graph, [arranged.slots[name] for name in chosen],
            self._parameters.defaults.size, list(columns.values()), self._columns(len(columns)))
        engine = self._build(twin.layout, method, twin.memory)
        p = self._parameters.vector(params, self.name)
        x = state_vector(self.states, initial_state, self.name)

        def run_pass(places: list[Place]) -> Log:
            plan = Plan(steps, int(every), float(step), twin.entries(len(places)))
            return simulate(engine, plan, twin.start(x, places), twin.parameters(p, places),
                            self._drive(inputs, steps, step)[0], f"differentiating {self.name}")

        done, derivatives = sensitivities.run_passes(twin, columns, run_pass)
        response = self._response(done, chosen)
        if done.divergence is not None:
            raise self._diverged(done.divergence, response)
        return response, derivatives

    def _columns(self, count: int) -> int:
        """How many of so many columns go side by side."""
        if self._engine == "python":
            return 1
        from clie_blocks.compiled.runtime.sensitivities import WIDEST
        return min(WIDEST, 1 << (count - 1).bit_length())

    def _response(self, done: Log, chosen: list[str]) -> ct.TimeResponseData:
        import control as ct

        nx, nu, shown = len(self.states), len(self.inputs), self._shown()
        columns = done.values.T
        return ct.TimeResponseData(
            done.time, columns[nx + nu:], columns[shown], columns[nx:nx + nu], issiso=False,
            output_labels=chosen, input_labels=self.inputs, sysname=self.name,
            state_labels=list(map(".".join, self._shown_states())),
            title=f"Response of {self.name}", plot_inputs=False)

    def _diverged(self, end: Divergence, response: ct.TimeResponseData) -> DivergedRunError:
        block, label = self.states[end.state]
        state = self._trace.graph.variable("x", end.state)
        shown = [name for name, expression in self._trace.signals.items()
                 if expression is state and name.startswith(f"{block}.")]
        error = DivergedRunError(
            f"{self.name}: at t = {end.time:.6g} s state {label} of block {block!r}"
            f"{f' (signal {shown[0]})' if shown else ''} is no longer finite; the loop is "
            "unstable or the step too long for it: try a shorter step, smaller gains or check "
            "the inputs. What was computed until then is in the error's response")
        error.response, error.time = response, end.time
        error.block, error.signal = block, shown[0] if shown else f"{block}.{label}"
        return error
