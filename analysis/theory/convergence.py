"""How fast the update law converges, predicted from the linearised periodic loop.

With a periodic excitation the loop settles on a periodic orbit.  The Floquet multipliers of the
orbit are the factors by which a small parametric error decays per period; they come from the
compiled diagram itself, differentiated over one period.  `clie_blocks.analysis.theory.averaging`
has the approximation for small gains.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import control as ct
import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import connected_components

from clie_blocks.analysis.theory.bounds import ControlledJoints
from clie_blocks.compiled import Program, compile_diagram
from clie_blocks.diagrams.clie_composite import clie_composite
from clie_blocks.diagrams.clie_loop import clie_loop
from clie_blocks.errors import DivergedError
from clie_blocks.joints import decoupled_joints
from clie_blocks.signals import Diagram

PAPER_PERIOD = 2.0  # s, of the excitation (48)
STEP = 1e-3  # s
NUDGE = 1e-5
NEWTON_STEPS = 4
RAMP_OVER = {"filtered_regressor.omega_f": 1e9}  # the start-up term of (36) is not periodic


@dataclass(frozen=True)
class PeriodicLoop:
    """An identification loop under a periodic excitation, around the true parameters.

    Parameters
    ----------
    joints : ControlledJoints
        True parameters and gains.
    pe : callable
        Excitation [N m].
    period : float
        Its period [s], a multiple of 1 ms.
    q_d : array_like, shape (n,)
        Set-point [rad]; in exact arithmetic without influence on the rates.
    alpha : float
        Gain of the gradient method; zero gives (27).
    shape : array_like, shape (3n,)
        Diagonal of Gamma for a gain of one; all ones by default, as in the paper.

    """

    joints: ControlledJoints
    pe: Callable[[float], ArrayLike]
    period: float = PAPER_PERIOD
    q_d: ArrayLike = 0.0
    alpha: float = 0.0
    shape: np.ndarray | float = 1.0

    def diagonal(self, gamma: float) -> np.ndarray:
        """Diagonal of Gamma, shape (3n,), for a gain."""
        return gamma * self.shape * np.ones(3 * self.joints.n)

    def diagram(self) -> Diagram:
        """Return the identification loop with the true joints as plant; Gamma is a parameter."""
        robot = self.joints
        plant = decoupled_joints(robot.a, robot.b, robot.d)
        if self.alpha == 0:
            return clie_loop(plant, robot.kp, robot.kd, self.diagonal(1.0))
        return clie_composite(plant, robot.kp, robot.kd, self.diagonal(1.0), self.alpha)

    def inputs(self, diagram: Diagram) -> dict[str, Any]:
        """Return the periodic inputs of a run, without noise."""
        quiet = {"noise": 0.0} if "noise[0]" in diagram.input_labels else {}
        return {"q_d": self.q_d, "pe": self.pe, **quiet}


@dataclass(frozen=True)
class Rates:
    """Rates at which parametric errors decay.

    Parameters
    ----------
    per_joint : ndarray, shape (n,)
        Slowest rate of each joint [1/s]; negative where the estimates diverge.
    multipliers : ndarray of complex
        Floquet multipliers of all states over one period.

    """

    per_joint: np.ndarray
    multipliers: np.ndarray

    @property
    def slowest(self) -> float:
        """Slowest rate of all joints [1/s]."""
        return float(np.min(self.per_joint))

    @property
    def time_constant(self) -> float:
        """Time in which the slowest error falls to 1/e [s]; infinite if it does not fall."""
        return 1 / self.slowest if self.slowest > 0 else float("inf")

    def time_to(self, remaining: float) -> float:
        """Time in which the slowest error falls to a fraction [s]."""
        return float(self.time_constant * np.log(1 / remaining))


class FloquetLoop:
    """A `PeriodicLoop`, compiled once, for any number of gains.

    Parameters
    ----------
    loop : PeriodicLoop
        The loop.

    """

    def __init__(self, loop: PeriodicLoop) -> None:
        self.loop, diagram = loop, loop.diagram()
        self.program, self.inputs = compile_diagram(diagram), loop.inputs(diagram)
        self.fixed: dict[str, float] = RAMP_OVER if loop.alpha else {}
        self.owners = [block for block, _ in self.program.states]
        self.joint = _joint_of_states(self.program)
        self.start = np.zeros(len(self.owners))
        self.start[[block == "update" for block in self.owners]] = loop.joints.theta

    def period_run(self, x: np.ndarray, gamma: float, log: list[str]) -> ct.TimeResponseData:
        """Response over one period from the state x."""
        return self.program.run(
            self.loop.period, step=STEP, inputs=self.inputs, initial_state=x, log=log,
            params={"update.gamma": self.loop.diagonal(gamma), **self.fixed})

    def after_period(self, x: np.ndarray, gamma: float) -> np.ndarray:
        """States one period after the states x, shape (runs, states)."""
        run = self.program.batch(
            self.loop.period, step=STEP, inputs=self.inputs, initial_state=x, log=[],
            params={"update.gamma": [self.loop.diagonal(gamma)], **self.fixed},
            every=round(self.loop.period / STEP))
        if np.any(run.diverged):
            raise DivergedError(f"the loop diverges within one period at a gain of {gamma:g}")
        return run.final_state

    def monodromy(self, x: np.ndarray, gamma: float) -> tuple[np.ndarray, np.ndarray]:
        """State after the state x, and its derivative by x, shape (states, states).

        Central differences; all runs go side by side, and each nudges one state of every joint,
        since the joints do not act on each other.
        """
        place = np.array([np.sum(self.joint[:k] == one) for k, one in enumerate(self.joint)])
        nudges = NUDGE * (place == np.arange(np.max(place) + 1)[:, None])
        after = self.after_period(np.vstack([x + nudges, x - nudges, x]), gamma)
        up, down = after[:len(nudges)], after[len(nudges):-1]
        slopes = (up - down).T[:, place] / (2 * NUDGE)
        return after[-1], np.where(self.joint[:, None] == self.joint, slopes, 0.0)

    def orbit(self, gamma: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the state at time 0 of the periodic orbit, and its monodromy, by Newton.

        The search starts at the last orbit found: without a modelling error all gains share it.
        """
        x = self.start
        for _ in range(NEWTON_STEPS):
            after, matrix = self.monodromy(x, gamma)
            step = np.linalg.solve(np.eye(x.size) - matrix, after - x)
            x = x + step
            if np.max(np.abs(step)) < 1e-7:
                break
        self.start = x
        return x, matrix

    def rates(self, gamma: float) -> Rates:
        """Floquet rates at an adaptation gain."""
        n = self.loop.joints.n
        try:
            _, matrix = self.orbit(gamma)
        except DivergedError:  # within one period: as unstable as can be
            return Rates(np.full(n, -np.inf), np.array([np.inf]))
        multipliers = [np.linalg.eigvals(matrix[np.ix_(own, own)])
                       for own in (self.joint == k for k in range(n))]
        slowest = [np.max(np.abs(values)) for values in multipliers]
        return Rates(-np.log(slowest) / self.loop.period, np.concatenate(multipliers))


def _joint_of_states(program: Program) -> np.ndarray:
    """Joint of each state of an identification loop: states of two joints share no signal."""
    somewhere = np.random.default_rng(0)
    x, u = (somewhere.uniform(1.0, 2.0, len(names)) for names in (program.states, program.inputs))
    rates = program.dynamics(0.0, x, u)
    acts = [program.dynamics(0.0, x + nudge, u) != rates for nudge in np.eye(x.size)]
    return connected_components(np.array(acts), directed=False)[1]


def floquet_rates(loop: PeriodicLoop, gammas: ArrayLike) -> list[Rates]:
    """Floquet rates of a loop over adaptation gains.

    Parameters
    ----------
    loop : PeriodicLoop
        The loop.
    gammas : array_like, shape (m,)
        Adaptation gains.

    Returns
    -------
    list of Rates
        One per gain.

    """
    compiled = FloquetLoop(loop)
    return [compiled.rates(gamma) for gamma in np.atleast_1d(gammas)]


def composite_rates(loop: PeriodicLoop, gamma: float, alphas: Sequence[float]) -> list[Rates]:
    """Floquet rates of a loop with the composite law (40), over its gains alpha.

    Parameters
    ----------
    loop : PeriodicLoop
        The loop; its own alpha does not matter.
    gamma : float
        Adaptation gain.
    alphas : sequence of float
        Gains of the gradient method, one of them not zero.

    Returns
    -------
    list of Rates
        One per alpha.

    """
    compiled, rates = FloquetLoop(replace(loop, alpha=max(alphas))), []
    for alpha in alphas:
        compiled.fixed = {**RAMP_OVER, "update.alpha": alpha}
        rates.append(compiled.rates(gamma))
    return rates
