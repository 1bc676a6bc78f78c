"""A control law of the user's own: any block of python-control that runs in samples.

The simulated robot runs the block itself.  Sensitivities come from its linearisation at rest, and
stages that lead a model gently use the PD law that is nearest to it.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.gap.problem.law import Filter, Law, LawLog, StatedLaw
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.records.control_law import HALF_CIRCLE
from clie_blocks.analysis.records.velocity_filter import NEVER_FORGETS, settling, velocity_filter
from clie_blocks.analysis.theory.sampled_loop import closed_loop, held_plant
from clie_blocks.errors import ClieError
from clie_blocks.labels import signals
from clie_blocks.linear_filters import frequency_response
from clie_blocks.robot_loop.sampled_law import COMMAND, PARAMETERS, SampledLaw

if TYPE_CHECKING:
    from clie_blocks.compiled.runtime.api import Batches

PERTURBATION = 1e-6  # of states and positions, in the central differences of a linearisation
BEYOND_DEAD_BAND = 0.1  # rad, likewise where smaller ones do not change the command
NEGLIGIBLE = 1e-9  # of the largest entry of a linearisation: rounding of its differences
AT_REST = 1e-7  # of the largest state, by which a state at rest may change
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
    `pose` (n,) [rad]; and `rest` (states,), the state of the block there.
    """

    block: SampledLaw = dataclasses.field(kw_only=True)
    feedback: tuple[Filter, ...] = dataclasses.field(kw_only=True)
    rest: np.ndarray = dataclasses.field(kw_only=True)
    parameters: np.ndarray = dataclasses.field(kw_only=True)
    pose: np.ndarray = dataclasses.field(kw_only=True)

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
        return block_law(self.block, self.pose, self.saturation, self.resolution,
                         self.measured_torque, parameters)

    def commands(self, log: LawLog) -> np.ndarray:
        """Commands of the law on the signals of a log, shape (N, n)."""
        state = self.rest if log.law_state is None else log.law_state
        return self._limited(self.run(log.law_q, log.q_d, log.pe, [state])[0])

    def replay(self, q: np.ndarray, q_d: np.ndarray, pe: np.ndarray | float) -> np.ndarray:
        """Command on measured positions, from rest, shape (N, n)."""
        return self._limited(self.run(q, q_d, pe, [self.rest])[0])

    def run(self, q: np.ndarray, q_d: np.ndarray, pe: np.ndarray | float,
            states: Sequence[np.ndarray], parameters: Sequence[np.ndarray] = (),
            every: int = 1) -> np.ndarray:
        """Commands without the stated limits from first states, shape (runs, rows, n).

        Each run has a state and parameters of its own; of its samples one in `every` is kept.
        """
        n, rows = len(self.kp), len(q)
        inputs = np.hstack([np.broadcast_to(x, (rows, n)) for x in (q_d, q, pe)])
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
        clean, noisy = (self.run(q_d, one, 0.0, [self.rest])[0] for one in (q_d, q_d + noise))
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
              parameters: np.ndarray | None = None) -> BlockLaw:
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

    Raises
    ------
    ClieError
        If the law fails or gives no numbers there, or no position changes its command.

    """
    parameters = np.array(block.values) if parameters is None else parameters
    rest = _rest_state(block, start, parameters)
    for change in (PERTURBATION, BEYOND_DEAD_BAND):
        feedback = tuple(_linearised(block, start, rest, parameters, change))
        kp, kd = np.transpose([_nearest_pd(*each, block.period) for each in feedback])
        if np.any(kp):
            break
    else:
        raise ClieError(f"{block.name}: no position changes the command of the law, so that "
                        "nothing holds the joints; state law = \"unknown\" for a robot without "
                        "feedback")
    b, a = velocity_filter("difference", block.period)
    one = np.ones(block.n)
    return BlockLaw(kp, kd, np.outer(b, one), np.outer(a, one), block.period, resolution,
                    saturation, variant="difference", measured_torque=measured_torque,
                    block=block, feedback=feedback, rest=rest, parameters=parameters,
                    pose=start)


def with_law_state(log: Log, law: Law) -> Log:
    """Log with the state in which its commands show that the user's own law began.

    Where the controller runs more often than the log has samples, it begins at rest.
    """
    if not isinstance(law, BlockLaw) or not law.block.states or not log.shows_every_tick:
        return log
    rows = slice(0, STATE_SAMPLES)
    q, q_d, pe, u = (x[rows] for x in (log.law_q, log.q_d, log.pe, log.u))
    usable = np.abs(u) < law.saturation
    if log.measured is not None:
        usable &= log.measured[rows, None]
    state, left = _likeliest_state(law, u, usable, q, q_d, pe), np.inf
    for _ in range(STATE_ROUNDS):
        steps = STATE_STEP * np.eye(law.block.states)
        runs = law.run(q, q_d, pe, [state, *(state + steps)])
        residual = (u - runs[0])[usable]
        if not residual @ residual < left:
            break
        found, left = state, residual @ residual
        columns = np.stack([(run - runs[0])[usable] for run in runs[1:]], axis=1) / STATE_STEP
        state = state + np.linalg.lstsq(columns, residual, rcond=NEGLIGIBLE)[0]
    return dataclasses.replace(log, law_state=found if np.isfinite(left) else law.rest)


def _likeliest_state(law: BlockLaw, u: np.ndarray, usable: np.ndarray, q: np.ndarray,
                     q_d: np.ndarray, pe: np.ndarray) -> np.ndarray:
    """State from which the search begins: at rest at the first sample, or just behind it.

    A law that began a sample ago has the first error for its last one.  Without that, the error's
    velocity would be so large that the command meets a limit, where nothing shows the state.
    """
    at_rest = _rest_state(law.block, q[0], law.parameters)
    states = [law.rest, at_rest]
    for _ in range(MOST_BEHIND if law.block.has_clock else 1):
        states.append(_step(law.block, states[-1], q_d[0], q[0], law.parameters)[0])
    left = [float(np.sum((u - run)[usable] ** 2)) for run in law.run(q, q_d, pe, states)]
    return states[int(np.argmin(left))]


def _rest_state(block: SampledLaw, start: np.ndarray, parameters: np.ndarray) -> np.ndarray:
    """State that stays as it is while the joints rest at their references."""
    from scipy.optimize import least_squares

    def change(x: np.ndarray) -> np.ndarray:
        return _step(block, x, start, start, parameters)[0] - x

    zero = np.zeros(block.states)
    if not block.states or not np.any(change(zero)):
        return zero
    columns = np.stack([change(unit) - change(zero) for unit in np.eye(block.states)], axis=1)
    at_once = -np.linalg.lstsq(columns, change(zero), rcond=NEGLIGIBLE)[0]
    if np.abs(change(at_once)).max() <= AT_REST * np.abs(at_once).max(initial=0.0):
        return at_once
    return least_squares(change, zero, xtol=1e-14, ftol=1e-14, gtol=1e-14).x


def _step(block: SampledLaw, x: np.ndarray, q_d: np.ndarray, q: np.ndarray,
          parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    with np.errstate(all="ignore"):
        after, u = block.step(0.0, x, q_d, q, np.zeros(block.n), parameters)
    if not (np.isfinite(after).all() and np.isfinite(u).all()):
        raise ClieError(f"{block.name}: the law gives NaN or infinity with the joints at "
                        f"{np.round(q, 6).tolist()} rad and the references at "
                        f"{np.round(q_d, 6).tolist()} rad; keep roots, logarithms and divisions "
                        "off zero")
    return after, u


def _linearised(block: SampledLaw, start: np.ndarray, rest: np.ndarray,
                parameters: np.ndarray, h: float) -> list[Filter]:
    """C(z) of each joint at rest: of the states that its position moves and its command reads."""
    n, states = block.n, block.states

    def both(x: np.ndarray, q: np.ndarray) -> np.ndarray:
        return np.concatenate(_step(block, x, start, q, parameters))

    by_state = [(both(rest + h * unit, start) - both(rest - h * unit, start)) / (2 * h)
                for unit in np.eye(states)]
    by_position = [(both(rest, start + h * unit) - both(rest, start - h * unit)) / (2 * h)
                   for unit in np.eye(n)]
    jacobian = np.transpose([*by_state, *by_position])
    jacobian[np.abs(jacobian) < NEGLIGIBLE * np.abs(jacobian).max(initial=0.0)] = 0.0
    a, b = jacobian[:states, :states], jacobian[:states, states:]
    c, d = jacobian[states:, :states], jacobian[states:, states:]
    return [_transfer(a, b[:, k], c[k], d[k, k]) for k in range(n)]


def _transfer(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: float) -> Filter:
    """Feedback ``-(d + c (z - a)^-1 b)`` in powers of 1/z, without states that take no part."""
    used = _reached(a, b != 0) & _reached(a.T, c != 0)
    a, b, c = a[np.ix_(used, used)], b[used], c[used]
    denominator = np.real(np.poly(a)) if used.any() else np.ones(1)
    numerator = np.real(np.poly(a - np.outer(b, c))) if used.any() else np.ones(1)
    return -(numerator + (d - 1.0) * denominator), denominator


def _reached(a: np.ndarray, first: np.ndarray) -> np.ndarray:
    """States that some first ones move, in any number of samples."""
    reached = first
    for _ in range(len(a)):
        wider = reached | ((a != 0) @ reached)
        if np.array_equal(wider, reached):
            break
        reached = wider
    return reached


def _nearest_pd(b: np.ndarray, a: np.ndarray, period: float) -> tuple[float, float]:
    """Gains of the PD law that is nearest to a feedback over its band."""
    frequency = np.geomspace(min(LOWEST, HIGHEST / period / 10), HIGHEST / period, 60)
    response = frequency_response(b, a, frequency * period)
    return float(np.median(response.real)), float(np.median(response.imag / frequency))


def _settling(denominator: np.ndarray) -> int:
    """Samples after which a filter has forgotten its start, but for sums, which never do."""
    poles = np.roots(denominator)
    return settling(np.atleast_1d(np.poly(poles[np.abs(poles) < NEVER_FORGETS])))
