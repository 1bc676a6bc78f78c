"""Excitation of a study, window by window, and a better one within the same limits."""

from dataclasses import dataclass

import control as ct
import numpy as np

from clie_blocks.analysis.stability_report.simulated_bounds import unless_diverged
from clie_blocks.analysis.stability_report.study import Study
from clie_blocks.analysis.theory.excitation_design import Limits, Multisine, design_multisine
from clie_blocks.analysis.theory.excitation_level import (
    Excitation,
    excitation,
    filtered_regressor_of,
    model_regressor,
)
from clie_blocks.compiled import compile_diagram
from clie_blocks.diagrams.clie_composite import clie_composite
from clie_blocks.signals import signal

WINDOWS = ((0.0, 5.0), (5.0, 15.0), (15.0, 25.0), (25.0, 35.0), (35.0, 45.0), (45.0, 55.0))


@dataclass(frozen=True)
class ExcitationReport:
    """Excitation per window, and what a designed multisine would give.

    Parameters
    ----------
    model, filtered : list of Excitation
        Conditions (28), (49) of the model, and (42) of the filtered robot, per window.
    limits : list of Limits
        Largest position, velocity and torque of each joint now.
    designs : list of Multisine
        One per joint, within these limits.
    per_second : ndarray, shape (n,)
        Smallest eigenvalue of (28) per second now.

    """

    model: list[Excitation]
    filtered: list[Excitation]
    limits: list[Limits]
    designs: list[Multisine]
    per_second: np.ndarray


def analyse_excitation(study: Study) -> ExcitationReport | None:
    """Excitation along the identification of a study, and a multisine within the same limits.

    The designs reach at most the position, velocity and torque of the present excitation; None if
    the simulation diverged.
    """
    joints = study.joints
    loop = clie_composite(study.plant, joints.kp, joints.kd, study.gamma_diagonal, study.alpha)
    run = unless_diverged(
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


def _reached(run: ct.TimeResponseData, n: int) -> tuple[list[Limits], np.ndarray]:
    """Limits that the robot reached about its mean, and its smallest eigenvalue per second."""
    late = run.time > WINDOWS[-1][0]
    q, dq, u = (signal(run, name)[:, late] for name in ("q", "dq", "u"))
    limits = [Limits(*(float(np.max(np.abs(x[k] - np.mean(x[k])))) for x in (q, dq, u)))
              for k in range(n)]
    phi = [np.array([dq[k], -u[k], np.ones_like(u[k])]) for k in range(n)]
    return limits, np.array([np.linalg.eigvalsh(p @ p.T / p.shape[1])[0] for p in phi])
