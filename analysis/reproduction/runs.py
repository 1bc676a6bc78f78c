"""The runs behind the paper's tables and figures, each a function of the reading that is taken."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks import paper
from clie_blocks.analysis.theory.excitation_level import (
    Excitation,
    excitation,
    model_regressor,
    weighted_integral,
)
from clie_blocks.compiled import compile_diagram
from clie_blocks.compiled.program import Program
from clie_blocks.diagrams.clie_loop import CASES, clie_loop
from clie_blocks.diagrams.feedback_linearization import feedback_linearization
from clie_blocks.diagrams.scripts.paper_experiment import Experiment, mean_estimate
from clie_blocks.excitation import paper_excitation
from clie_blocks.joints import decoupled_joints
from clie_blocks.signals import signal

FROZEN = 1e-12  # an adaptation gain that leaves the estimates where they are
LOG_EVERY = 100  # steps of 0.1 ms

Curve = tuple[np.ndarray, np.ndarray]  # time [s] and the integral (49)
Levels = tuple[list[Excitation], list[Curve]]


@dataclass(frozen=True)
class Reading:
    """One interpretation of what the paper leaves open.

    Parameters
    ----------
    name : str
        In words.
    settings : tuple of (str, value)
        Differences from the defaults of `Experiment`.
    literal : bool
        Whether the paper states it so.
    noisy : bool
        Whether it depends on the seed.

    """

    name: str
    settings: tuple[tuple[str, Any], ...]
    literal: bool = False
    noisy: bool = False

    def experiment(self, case: int, seed: int = 0) -> Experiment:
        """Return the experiment of a case of Table 1."""
        return Experiment(CASES, case=case, seed=seed, **dict(self.settings))


READINGS = (
    Reading("Gamma = 20, 100 s, exact velocities, noise variance 1e-6 rad^2",
            (("duration", 100.0),), noisy=True),
    Reading("Gamma = 20, 100 s, velocity through G1 in the robot's loop, variance 1e-6 rad^2",
            (("duration", 100.0), ("velocity", "measured")), noisy=True),
    Reading("as printed: Gamma = 20, 100 s, velocity through G1, variance 1e-3 rad^2",
            (("duration", 100.0), ("velocity", "measured"),
             ("noise_variance", paper.NOISE_VARIANCE_PRINTED)), literal=True, noisy=True),
    Reading("Gamma = 20 for 400 s, exact velocities, no noise",
            (("duration", 400.0), ("noise_variance", 0.0))),
    Reading("fitted: gain 78.5, set-point (1.0345, 0.6613) rad, exact velocities, no noise, 100 s",
            (("duration", 100.0), ("gamma", 78.5), ("set_point", (1.0345, 0.6613)),
             ("noise_variance", 0.0))),
)


def estimates(reading: Reading, case: int, seeds: Sequence[int]) -> np.ndarray:
    """Mean estimates of the last 20 s in a case of Table 1, shape (seeds, 6)."""
    return np.array([mean_estimate(identification(reading, case, seed)) for seed in seeds])


def identification(reading: Reading, case: int, seed: int = 0) -> ct.TimeResponseData:
    """Run the identification of a case under a reading; the response holds theta_hat."""
    experiment = reading.experiment(case, seed)
    program = _program(case, experiment.velocity)
    diagram = experiment.diagram()
    return program.run(experiment.duration, step=paper.STEP, inputs=experiment.inputs(diagram),
                       log=["theta_hat"], every=LOG_EVERY,
                       params={"update.gamma": experiment.gamma})


def excitation_levels(pe: Callable[[float], ArrayLike] | float = paper_excitation,
                      ) -> Levels:
    """Regressor of CASE 1 over the windows of Fig. 3.

    Parameters
    ----------
    pe : callable or float
        Excitation [N m].

    Returns
    -------
    levels : list of Excitation
        One per window.
    curves : list of (ndarray, ndarray)
        Time [s] and the integral (49) per window.

    """
    run = _program(1, "exact").run(
        paper.WINDOWS[-1][1], step=1e-3, every=2, log=["dq_model", "u_model"],
        inputs={"q_d": paper.SET_POINT, "pe": pe}, params={"update.gamma": paper.GAMMA})
    phi = model_regressor(run)
    return ([excitation(phi, run.time, window) for window in paper.WINDOWS],
            weighted_integral(phi, run.time))


def tracking(case: int, printed_sign: bool = False, duration: float = 100.0,
             ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Run the validation (50) with the printed estimates, from rest at zero.

    Parameters
    ----------
    case : int
        Whose estimates of Table 2.
    printed_sign : bool
        ``-D_hat`` as printed.
    duration : float
        Simulated time [s].

    Returns
    -------
    time : ndarray, shape (samples,)
        Time [s].
    wanted, reached : ndarray, shape (2, samples)
        Positions [rad].

    """
    loop = feedback_linearization(paper.paper_arm(), paper.THETA_HAT[case], paper.KP, paper.KD,
                                  printed_sign=printed_sign)
    run = compile_diagram(loop).run(duration, step=paper.STEP, every=10, log=["q"], inputs={
        "q_d": paper.tracking_reference, "dq_d": paper.tracking_velocity,
        "ddq_d": paper.tracking_acceleration})
    return run.time, paper.tracking_reference(run.time), signal(run, "q")


def tracking_mse(case: int, printed_sign: bool = False) -> np.ndarray:
    """Mean squared tracking error of both joints over 100 s, Table 3 [rad^2]."""
    _, wanted, reached = tracking(case, printed_sign)
    return np.mean((wanted - reached) ** 2, axis=1)


def signed_mean_error(case: int) -> np.ndarray:
    """The mean of eps that Table 3 prints, with the estimates of Table 2 frozen [rad/s^2]."""
    loop = clie_loop(decoupled_joints(*paper.THETA.reshape(3, 2)), paper.KP, paper.KD, FROZEN)
    run = compile_diagram(loop).run(
        100.0, step=1e-3, every=1000, log=["dq", "dq_model"],
        inputs={"q_d": paper.SET_POINT, "pe": paper_excitation},
        initial_state={"update": paper.THETA_HAT[case]})
    de = signal(run, "dq") - signal(run, "dq_model")
    return (de[:, -1] - de[:, 0]) / run.time[-1]


@lru_cache
def _program(case: int, velocity: str) -> Program:
    return compile_diagram(Experiment(CASES, case=case, velocity=velocity).diagram())
