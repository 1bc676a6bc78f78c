"""Bounds of a study by the theorems, and the same radii in simulations."""

from dataclasses import dataclass

import numpy as np

from clie_blocks.analysis.stability_report.simulated_bounds import (
    Trajectory,
    identification_errors,
    pd_trajectory,
    ultimate_radius,
    unless_diverged,
)
from clie_blocks.analysis.stability_report.study import Study
from clie_blocks.analysis.stability_report.worst_case import WorstCase, worst_case
from clie_blocks.analysis.theory.bounds import (
    Condition,
    Theorem2,
    Theorem4,
    UltimateBound,
    condition,
    disturbance_norm,
    theorem_2,
    theorem_4,
    ultimate_bound,
)

SETTLED = 5.0  # s, after which the modelling error counts
LATE = 380.0  # s, of 400


@dataclass(frozen=True)
class Bounds:
    """Conditions and bounds of a study, and what the simulated loops do.

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

    condition: Condition
    eta_computed: float
    eta_instant: float
    ultimate: UltimateBound
    eps_bar: tuple[float, float]
    second: Theorem2
    fourth: Theorem4
    worst: WorstCase
    trajectory: Trajectory | None
    radius: float
    errors: dict[str, np.ndarray] | None
    measured: dict[str, float]


def analyse_bounds(study: Study) -> Bounds:
    """Conditions and bounds of a study, and a simulation of both loops to compare with."""
    joints = study.joints
    arguments = study.plant, joints, study.q_d, study.pe
    errors, composite = identification_errors(*arguments, gamma=study.gamma_diagonal,
                                              alpha=study.alpha)
    measured = _radii(errors, composite)
    measured |= {"mu_1": theorem_2(joints, measured["eps"]).mu_1,
                 "mu_2": theorem_4(joints, study.alpha, measured["eps"], measured["eps_f"]).mu_2}
    eps = (measured["eps"],) * 2 if study.eps_bar is None else study.eps_bar
    trajectory = unless_diverged(pd_trajectory, *arguments)
    eta, instant = disturbance_norm(joints, study.pe)
    return Bounds(
        condition(joints), eta, instant, ultimate_bound(joints, study.eta_norm or eta), eps,
        theorem_2(joints, eps[0]), theorem_4(joints, study.alpha, eps[1]),
        worst_case(study.box, joints.kp, joints.kd, study.pe, alpha=study.alpha, eps_bar=eps[0]),
        trajectory, np.inf if trajectory is None else ultimate_radius(*trajectory), errors,
        measured)


def _radii(errors: dict[str, np.ndarray] | None,
           composite: dict[str, np.ndarray] | None) -> dict[str, float]:
    """Largest norms after the start and at the end, with the laws (27) and (40)."""
    def radius(run: dict[str, np.ndarray] | None, after: float, *names: str) -> float:
        if run is None:
            return np.inf
        return ultimate_radius(run["time"], *(run[name] for name in names), after=after)

    return {"eps": radius(errors, SETTLED, "eps"), "eps_f": radius(errors, SETTLED, "eps_f"),
            "e_early": radius(errors, SETTLED, "e", "de"),
            "e_late": radius(errors, LATE, "e", "de"),
            "sigma_late": radius(composite, LATE, "e", "de", "e_f")}
