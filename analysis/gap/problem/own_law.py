"""A control law of the user's own: any block of python-control that runs in samples.

The simulated robot runs the block itself.  Sensitivities come from its linearisation at rest, and
stages that lead a model gently use the PD law that is nearest to it.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.gap.problem.law import Filter, Law, LawLog, StatedLaw
from clie_blocks.analysis.gap.problem.linearised_law import (
    NEGLIGIBLE,
    LawOnPositions,
    finite_step,
)
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.records.control_law import HALF_CIRCLE
from clie_blocks.analysis.records.velocity_filter import NEVER_FORGETS, settling, velocity_filter
from clie_blocks.analysis.theory.sampled_loop import closed_loop, held_plant
from clie_blocks.errors import ClieError
from clie_blocks.labels import signals
from clie_blocks.linear_filters import frequency_response
from clie_blocks.robot_loop.sampled_law import COMMAND, PARAMETERS, VELOCITY, SampledLaw

if TYPE_CHECKING:
    from clie_blocks.compiled.runtime.api import Batches

PERTURBATION = 1e-6  # of states and positions, in the central differences of a linearisation
BEYOND_DEAD_BAND = 0.1  # rad, likewise where smaller ones do not change the command
LOWEST = 1.0  # rad/s, from which a law is compared with PD
HIGHEST = 0.2  # rad per sample, up to which
NOISE_OF_REFERENCE = 1e-9  # rad, by which a law's gain on it is measured
STATE_SAMPLES = 2000  # from the first on, by which the state at the first sample is found
STATE_STEP = 1e-5  # of states, in the differences by which it is found
MOST_BEHIND = 20  # samples, of a law with a clock, that it may be behind its rest
STATE_ROUNDS = 10  # steps in which it is found; a linear law takes one


@dataclasses.dataclass(frozen=True, eq=False)
class BlockLaw(StatedLaw):
    """A law as a block, with the gains and the velocity filter of the PD law nearest to it.

    Beyond what a `StatedLaw` has: the `block` with its `parameters` (m,); `feedback` of each
    joint, C(z) from its position to less of its command, linearised with the joints at rest at
    `pose` (n,) [rad] over a `width` [rad]; and `rest` (states,), the state of the block there.
    """

    block: SampledLaw = dataclasses.field(kw_only=True)
    feedback: tuple[Filter, ...] = dataclasses.field(kw_only=True)
    rest: np.ndarray = dataclasses.field(kw_only=True)
    parameters: np.ndarray = dataclasses.field(kw_only=True)
    pose: np.ndarray = dataclasses.field(kw_only=True)
    width: float = dataclasses.field(kw_only=True)

    @property
    def pd(self) -> StatedLaw:
        """The PD law that is nearest."""
        return StatedLaw(**{field.name: getattr(self, field.name)
                            for field in dataclasses.fields(StatedLaw)})

    @property
    def settling(self) -> int:
        """Samples after which all of it but sums has forgotten how its run began."""
        return max(_settling(a) for _, a in self.feedback)

    def with_parameters(self, parameters: np.ndarray) -> BlockLaw:
        """The law with other parameters."""
        return self._again(parameters, self.width)

    def over_motions(self) -> BlockLaw:
        """The law linearised over motions, and not just at rest."""
        return self._again(self.parameters, BEYOND_DEAD_BAND)

    def _again(self, parameters: np.ndarray, width: float) -> BlockLaw:
        return block_law(self.block, self.pose, self.saturation, self.resolution,
                         self.measured_torque, parameters,
                         (self.numerator[:, 0], self.denominator[:, 0]), width)

    def commands(self, log: LawLog) -> np.ndarray:
        """Commands of the law on the signals of a log, shape (N, n)."""
        state = self.rest if log.law_state is None else log.law_state
        return self._limited(self.run(self.inputs_of(log), [state])[0])

    def replay(self, q: np.ndarray, q_d: np.ndarray, pe: np.ndarray | float) -> np.ndarray:
        """Command on measured positions, from rest, shape (N, n)."""
        return self._limited(self.run(self.inputs(q, q_d, pe), [self.rest])[0])

    def inputs_of(self, log: LawLog) -> np.ndarray:
        """Inputs of the block in a log."""
        return self.inputs(log.law_q, log.q_d, log.pe, log.of_drive)

    def inputs(self, q: np.ndarray, q_d: np.ndarray, pe: np.ndarray | float = 0.0,
               of_drive: Mapping[str, np.ndarray] = MappingProxyType({})) -> np.ndarray:
        """Inputs of the block, from signals of shape (N, n).

        Of what it reads of the drive, a velocity that was not measured is that of the velocity
        filter, and a torque is zero.
        """
        formed = {VELOCITY: self.rate(q)} if VELOCITY in self.block.reads else {}
        measured = [{**formed, **of_drive}.get(port, 0.0) for port in self.block.reads]
        return np.hstack([np.broadcast_to(x, (len(q), len(self.kp)))
                          for x in (q_d, q, pe, *measured)])

    def run(self, inputs: np.ndarray, states: Sequence[np.ndarray],
            parameters: Sequence[np.ndarray] = (), every: int = 1) -> np.ndarray:
        """Commands without the stated limits from first states, shape (runs, rows, n).

        Each run has a state and parameters of its own; of its samples one in `every` is kept.
        """
        n, rows = len(self.kp), len(inputs)
        numbers = parameters or [self.parameters] * len(states)
        outputs = self._program.batch(
            rows * self.period, inputs=inputs, threads=1, log=signals(COMMAND, n=n), every=every,
            initial_state=np.stack(states) if self.block.states else None,
            params={PARAMETERS: np.stack(numbers)} if len(self.parameters) else
            None).outputs[..., :-(-rows // every)]
        return np.swapaxes(outputs, 1, 2)

    def _limited(self, u: np.ndarray) -> np.ndarray:
        return np.clip(u, -self.saturation, self.saturation)

    def position_gain(self) -> np.ndarray:
        """RMS of the command over that of white noise in the position, shape (n,)."""
        frequency = np.pi * (np.arange(HALF_CIRCLE) + 0.5) / HALF_CIRCLE
        return np.array([np.sqrt(np.mean(np.abs(frequency_response(b, a, frequency)) ** 2))
                         for b, a in self.feedback])

    def reference_gain(self, q_d: np.ndarray) -> np.ndarray:
        """RMS of the command over that of white noise in a reference (N, n), shape (n,)."""
        q_d = q_d[:STATE_SAMPLES]
        noise = NOISE_OF_REFERENCE * np.random.default_rng(0).normal(size=q_d.shape)
        clean, noisy = (self.run(self.inputs(q_d, one), [self.rest])[0]
                        for one in (q_d, q_d + noise))
        return np.sqrt(np.mean((noisy - clean) ** 2, axis=0)) / NOISE_OF_REFERENCE

    def _polynomials(self, k: int, inertia: float, damping: float,
                     ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return closed_loop(held_plant(inertia, damping, self.period), self.feedback[k])

    @functools.cached_property
    def _program(self) -> Batches:
        from clie_blocks.compiled.cache.cached_program import cached_program, source_digest

        sources = source_digest("clie_blocks.compiled", "clie_blocks.robot_loop")
        return cached_program(f"{sources}\n{self.block!r}", lambda: self.block.system)


def block_law(block: SampledLaw, start: np.ndarray, saturation: np.ndarray,
              resolution: np.ndarray, measured_torque: bool = False,
              parameters: np.ndarray | None = None,
              velocity: tuple[np.ndarray, np.ndarray] | None = None,
              width: float = PERTURBATION) -> BlockLaw:
    """Law of a block, linearised at rest at a position.

    Parameters
    ----------
    block : SampledLaw
        The law.
    start : ndarray, shape (n,)
        Position, and reference, at which it rests [rad].
    saturation, resolution : ndarray, shape (n,)
        Limit of the command, infinite for none, and its rounding step, 0 for none.
    measured_torque : bool
        The logged command is a measured torque.
    parameters : ndarray, shape (m,), optional
        Parameters of the block; by default its own.
    velocity : tuple of ndarray, shape (3,), optional
        Filter ``b, a`` by which models form the velocity that the law reads of the drive; by
        default the difference of two samples.
    width : float
        Of positions and states, over which it is linearised.

    Raises
    ------
    ClieError
        If the law fails or gives no numbers there, or no position changes its command.

    """
    parameters = np.array(block.values) if parameters is None else parameters
    b, a = (np.outer(side, np.ones(block.n)) for side in
            velocity or velocity_filter("difference", block.period))
    on_positions = LawOnPositions(block, parameters, b, a)
    rest = on_positions.at_rest(start)
    for over in (width, BEYOND_DEAD_BAND):
        feedback = on_positions.feedback(start, rest, over)
        kp, kd = np.transpose([_nearest_pd(*each, block.period) for each in feedback])
        if np.any(kp):
            break
    else:
        raise ClieError(f"{block.name}: no position changes the command of the law, so that "
                        "nothing holds the joints; state law = \"unknown\" for a robot without "
                        "feedback")
    return BlockLaw(kp, kd, b, a, block.period, resolution,
                    saturation, variant="difference", measured_torque=measured_torque,
                    block=block, feedback=feedback, rest=rest[:block.states],
                    parameters=parameters, pose=start, width=over)


def with_law_state(log: Log, law: Law) -> Log:
    """Log with the state in which its commands show that the user's own law began.

    Where the controller runs more often than the log has samples, it begins at rest.
    """
    if not isinstance(law, BlockLaw) or not law.block.states or not log.shows_every_tick:
        return log
    rows = slice(0, STATE_SAMPLES)
    u, inputs = log.u[rows], law.inputs_of(log)[rows]
    usable = np.abs(u) < law.saturation
    if log.measured is not None:
        usable &= log.measured[rows, None]
    state, left = _likeliest_state(law, u, usable, inputs), np.inf
    for _ in range(STATE_ROUNDS):
        steps = STATE_STEP * np.eye(law.block.states)
        runs = law.run(inputs, [state, *(state + steps)])
        residual = (u - runs[0])[usable]
        if not residual @ residual < left:
            break
        found, left = state, residual @ residual
        columns = np.stack([(run - runs[0])[usable] for run in runs[1:]], axis=1) / STATE_STEP
        state = state + np.linalg.lstsq(columns, residual, rcond=NEGLIGIBLE)[0]
    return dataclasses.replace(log, law_state=found if np.isfinite(left) else law.rest)


def _likeliest_state(law: BlockLaw, u: np.ndarray, usable: np.ndarray,
                     inputs: np.ndarray) -> np.ndarray:
    """State from which the search begins: at rest at the first sample, or just behind it.

    A law that began a sample ago has the first error for its last one.  Without that, the error's
    velocity would be so large that the command meets a limit, where nothing shows the state.
    """
    q_d, q, _, *of_drive = np.split(inputs[0], 3 + len(law.block.reads))
    on_positions = LawOnPositions(law.block, law.parameters, law.numerator, law.denominator)
    states = [law.rest, on_positions.at_rest(q)[:law.block.states]]
    for _ in range(MOST_BEHIND if law.block.has_clock else 1):
        states.append(finite_step(law.block, states[-1], q_d, q, law.parameters, of_drive)[0])
    left = [float(np.sum((u - run)[usable] ** 2)) for run in law.run(inputs, states)]
    return states[int(np.argmin(left))]


def _nearest_pd(b: np.ndarray, a: np.ndarray, period: float) -> tuple[float, float]:
    """Gains of the PD law that is nearest to a feedback over its band."""
    frequency = np.geomspace(min(LOWEST, HIGHEST / period / 10), HIGHEST / period, 60)
    response = frequency_response(b, a, frequency * period)
    return float(np.median(response.real)), float(np.median(response.imag / frequency))


def _settling(denominator: np.ndarray) -> int:
    """Samples after which a filter has forgotten its start, but for sums, which never do."""
    poles = np.roots(denominator)
    return settling(np.atleast_1d(np.poly(poles[np.abs(poles) < NEVER_FORGETS])))
