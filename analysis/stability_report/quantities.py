"""Everything that a stability report says, as numbers; the document and the JSON both read it."""

from dataclasses import dataclass, replace

import numpy as np

from clie_blocks.analysis.stability_report.simulated_bounds import (
    identification_errors,
    pd_trajectory,
    ultimate_radius,
)
from clie_blocks.analysis.stability_report.worst_case import worst_case
from clie_blocks.analysis.theory.averaging import averaged_rates
from clie_blocks.analysis.theory.bounds import (
    condition,
    disturbance_norm,
    theorem_2,
    theorem_4,
    ultimate_bound,
)
from clie_blocks.analysis.theory.convergence import floquet_rates
from clie_blocks.analysis.theory.excitation_design import Limits, design_multisine
from clie_blocks.analysis.theory.excitation_level import (
    excitation,
    filtered_regressor_of,
    model_regressor,
)
from clie_blocks.analysis.theory.frequency import (
    PAPER_TONES,
    closed_loop_poles,
    filter_response,
    margins,
    noise_gain,
)
from clie_blocks.compiled import compile_diagram
from clie_blocks.diagrams.clie_composite import clie_composite
from clie_blocks.errors import DivergedError
from clie_blocks.filters import lowpass, velocity_filter
from clie_blocks.signals import signal

GAMMAS = np.geomspace(2.5, 640, 33)
ALPHAS = (0.0, 1e-4, 1e-3, 1e-2, 1e-1, 1.0)
WINDOWS = ((0.0, 5.0), (5.0, 15.0), (15.0, 25.0), (25.0, 35.0), (35.0, 45.0), (45.0, 55.0))
SETTLED = 5.0  # s, after which the modelling error counts
LATE = 380.0  # s, of 400
NOISE_PERIOD = 1e-3  # s


@dataclass(frozen=True)
class Bounds:
    """Conditions and bounds of a study, and what the loops really do.

    Where a simulation diverged, `trajectory` or `errors` is None and its radii are infinite.

    Parameters
    ----------
    condition : Condition
        K_bar per joint and the gains at its edge.
    eta_computed, eta_instant : float
        Largest ||B PE - D|| [rad/s^2] and when it is reached [s].
    ultimate : UltimateBound
        mu_0 for the stated bound on eta, or the computed one.
    eps_bar : tuple of float
        Bounds on the modelling error for Theorems 2 and 4 [rad/s^2].
    second, fourth : Theorem2, Theorem4
        Their constants for `eps_bar`.
    worst : WorstCase
        Over the box of the study.
    trajectory : tuple
        Time, position error and velocity of the PD loop.
    radius : float
        Its norm after 20 s.
    errors : dict
        Run of the identification loop with (27), see `identification_errors`.
    measured : dict
        Norms along it, and the mu_1 and mu_2 that belong to its modelling error.

    """

    condition: object
    eta_computed: float
    eta_instant: float
    ultimate: object
    eps_bar: tuple
    second: object
    fourth: object
    worst: object
    trajectory: tuple
    radius: float
    errors: dict
    measured: dict


def bounds_of(study):
    """Compute conditions and bounds, and simulate both loops beside them.

    Parameters
    ----------
    study : Study
        Robot, gains, excitation.

    Returns
    -------
    Bounds
        See there.

    """
    joints = study.joints
    arguments = study.plant, joints, study.q_d, study.pe
    errors, composite = (
        _unless_diverged(identification_errors, *arguments, gamma=study.gamma_diagonal,
                         alpha=alpha) for alpha in (0.0, study.alpha))
    measured = _radii(errors, composite)
    measured |= {"mu_1": theorem_2(joints, measured["eps"]).mu_1,
                 "mu_2": theorem_4(joints, study.alpha, measured["eps"], measured["eps_f"]).mu_2}
    eps = (measured["eps"],) * 2 if study.eps_bar is None else study.eps_bar
    trajectory = _unless_diverged(pd_trajectory, *arguments)
    eta, instant = disturbance_norm(joints, study.pe)
    return Bounds(
        condition(joints), eta, instant, ultimate_bound(joints, study.eta_norm or eta), eps,
        theorem_2(joints, eps[0]), theorem_4(joints, study.alpha, eps[1]),
        worst_case(study.box, joints.kp, joints.kd, study.pe, alpha=study.alpha, eps_bar=eps[0]),
        trajectory, np.inf if trajectory is None else ultimate_radius(*trajectory), errors,
        measured)


def _unless_diverged(simulate, *arguments, **options):
    try:
        return simulate(*arguments, **options)
    except DivergedError:
        return None


def _radii(errors, composite):
    """Largest norms after the start and at the end, with the laws (27) and (40)."""
    def radius(run, after, *names):
        if run is None:
            return np.inf
        return ultimate_radius(run["time"], *(run[name] for name in names), after=after)

    return {"eps": radius(errors, SETTLED, "eps"), "eps_f": radius(errors, SETTLED, "eps_f"),
            "e_early": radius(errors, SETTLED, "e", "de"),
            "e_late": radius(errors, LATE, "e", "de"),
            "sigma_late": radius(composite, LATE, "e", "de", "e_f")}


@dataclass(frozen=True)
class LinearAnalysis:
    """Filters, poles and margins of a study.

    Parameters
    ----------
    filters : dict
        ``'G1'``, ``'G2'`` to `FilterResponse` at the tones of the excitation.
    noise : dict
        The same keys to the noise gain.
    poles, margins : dict
        ``'exact'``, ``'G1'`` to `Poles`, and to one `Margins` per joint.

    """

    filters: dict
    noise: dict
    poles: dict
    margins: dict


def linear_analysis_of(study):
    """Linear analysis with exact velocity and with velocity through G1.

    Parameters
    ----------
    study : Study
        Robot and gains.

    Returns
    -------
    LinearAnalysis
        Poles and margins by ``'exact'`` and ``'G1'``; margins joint by joint.

    """
    blocks = {"G1": velocity_filter(1), "G2": lowpass(1)}
    tones = 2 * np.pi * np.array(PAPER_TONES)
    arguments = (study.plant, study.joints.kp, study.joints.kd)
    kinds = {"exact": False, "G1": True}
    return LinearAnalysis(
        {name: filter_response(block, tones, name == "G1") for name, block in blocks.items()},
        {name: noise_gain(block, NOISE_PERIOD) for name, block in blocks.items()},
        {kind: closed_loop_poles(*arguments, filtered=filtered, q=study.q_d)
         for kind, filtered in kinds.items()},
        {kind: [margins(*arguments, k, filtered=filtered, q=study.q_d)
                for k in range(study.joints.n)] for kind, filtered in kinds.items()})


@dataclass(frozen=True)
class Convergence:
    """Predicted rates of the update law over Gamma, and over alpha at the chosen Gamma.

    Parameters
    ----------
    gammas : ndarray, shape (m,)
        Gains.
    rates : list of Rates
        One per gain.
    averaged : ndarray, shape (m, n)
        Rates by averaging [1/s].
    here : Rates
        At the gain of the study.
    over_alpha : dict
        Alpha to `Rates`, at the gain of the study.

    """

    gammas: np.ndarray
    rates: list
    averaged: np.ndarray
    here: object
    over_alpha: dict

    @property
    def best(self):
        """Gain with the fastest slow mode, and its rates."""
        k = int(np.argmax([rates.slowest for rates in self.rates]))
        return float(self.gammas[k]), self.rates[k]

    def gain_for(self, time, remaining=0.01):
        """Smallest gain of the sweep that reaches a fraction in a time [s]; None if none."""
        enough = [gamma for gamma, rates in zip(self.gammas, self.rates)
                  if rates.time_to(remaining) <= time]
        return float(enough[0]) if enough else None


def convergence_of(study):
    """Floquet rates of the update law around the true parameters, and their average.

    Parameters
    ----------
    study : Study
        Robot, gains, excitation.

    Returns
    -------
    Convergence
        Over `GAMMAS`.

    """
    *rates, here = floquet_rates(study.loop, [*GAMMAS, study.gamma])
    over_alpha = {alpha: floquet_rates(replace(study.loop, alpha=alpha), [study.gamma])[0]
                  for alpha in ALPHAS}
    return Convergence(GAMMAS, rates, averaged_rates(study.loop, GAMMAS), here, over_alpha)


@dataclass(frozen=True)
class ExcitationReport:
    """Excitation per window, and what a designed multisine would give.

    Parameters
    ----------
    model, filtered : list of Excitation
        Conditions (28), (49) of the model, and (42) of the filtered robot, per window.
    limits : list of Limits
        What each joint reaches now.
    designs : list of Multisine
        One per joint, within these limits.
    per_second : ndarray, shape (n,)
        Smallest eigenvalue of (28) per second now.

    """

    model: list
    filtered: list
    limits: list
    designs: list
    per_second: np.ndarray


def excitation_of(study):
    """Excitation of a study along its identification, and a multisine within the same limits.

    Parameters
    ----------
    study : Study
        Robot, gains, excitation.

    Returns
    -------
    ExcitationReport or None
        The designs reach at most the position, velocity and torque of the present excitation;
        None if the simulation diverged.

    """
    joints = study.joints
    loop = clie_composite(study.plant, joints.kp, joints.kd, study.gamma_diagonal, study.alpha)
    run = _unless_diverged(
        compile_diagram(loop).run, WINDOWS[-1][1], step=1e-3, every=2,
        inputs={"q_d": study.q_d, "pe": study.pe, "noise": 0.0},
        log=["q", "dq", "u", "dq_model", "u_model", "filtered_regressor.phi_f"])
    if run is None:
        return None
    model, filtered = model_regressor(run), filtered_regressor_of(run)
    limits, per_second = _reached(run, joints.n)
    designs = [design_multisine(joints, k, limits[k]) for k in range(joints.n)]
    return ExcitationReport(
        [excitation(model, run.time, window) for window in WINDOWS],
        [excitation(filtered, run.time, window) for window in WINDOWS],
        limits, designs, per_second)


def _reached(run, n):
    """Limits that the robot reached about its mean, and its smallest eigenvalue per second."""
    late = run.time > WINDOWS[-1][0]
    q, dq, u = (signal(run, name)[:, late] for name in ("q", "dq", "u"))
    limits = [Limits(*(float(np.max(np.abs(x[k] - np.mean(x[k])))) for x in (q, dq, u)))
              for k in range(n)]
    phi = [np.array([dq[k], -u[k], np.ones_like(u[k])]) for k in range(n)]
    return limits, np.array([np.linalg.eigvalsh(p @ p.T / p.shape[1])[0] for p in phi])
