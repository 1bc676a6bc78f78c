"""Closed-loop output error: models fitted by simulation to the measured positions, as they are."""

from collections.abc import Sequence
from typing import Any

from clie_blocks.analysis.blind.comparison.ablations import noise_without_whitening
from clie_blocks.analysis.blind.comparison.baselines.model_selection import Model, answer, bic
from clie_blocks.analysis.gap.causes import drive, friction
from clie_blocks.analysis.gap.causes.cause import Cause, Scene
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method import METHOD
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.search.screening import base_motion, scene

STEPS = 12
WORTH = 10.0  # gain of BIC from which a joint counts as affected by the cause
FRICTION_MENU = ((friction.COULOMB,), (friction.STRIBECK,), (friction.ASYMMETRIC_COULOMB,),
                 (friction.LOAD_DEPENDENT_FRICTION[0],), (friction.QUADRATIC_DRAG,))
JOINT_MENU = ((friction.COULOMB,), (drive.TIME_DELAY,), (friction.COULOMB, drive.TIME_DELAY))


def friction_menu(problem: Problem) -> dict[str, Any]:
    """Diagnose a robot by fitting each friction model of the menu in closed loop."""
    return answer(problem, fit_menu(problem, FRICTION_MENU))


def simulator_fit(problem: Problem) -> dict[str, Any]:
    """Diagnose a robot by the parameters that its simulator's joints have."""
    return answer(problem, fit_menu(problem, JOINT_MENU))


def fit_menu(problem: Problem, menu: Sequence[tuple[Cause, ...]]) -> list[Model]:
    """Fit the nominal model, then each set of causes of a menu at all joints."""
    residuals, nominal = fit_nominal(problem, METHOD, noise_without_whitening)
    sizes = scene(residuals.problem, nominal.hypothesis, base_motion(nominal.hypothesis))
    models = [_model(nominal, nominal)]
    for causes in menu:
        members = tuple(_member(cause, sizes) for cause in causes)
        start = build_hypothesis(residuals.problem, members, nominal.hypothesis)
        models.append(_model(fit(start, residuals, STEPS), nominal))
    return models


def _member(cause: Cause, sizes: Scene) -> Member:
    """Cause at all joints, starting in the middle of its search grid."""
    probes = cause.probes(sizes)
    values = probes[len(probes) // 2].values
    return Member(cause, tuple(range(sizes.problem.n)), values, values)


def _model(fitted: Fit, nominal: Fit) -> Model:
    hypothesis, logs = fitted.hypothesis, len(fitted.hypothesis.problem.fit)
    squares, samples = fitted.chi2[:logs], int(fitted.samples[:logs].sum())
    gained = nominal.chi2[:logs].sum(axis=0) - squares.sum(axis=0)
    variance = squares.sum() / samples
    joints = tuple(k for k in range(hypothesis.problem.n) if gained[k] / variance > WORTH)
    members = tuple(Member(m.cause, joints or m.joints, m.values, m.sizes)
                    for m in hypothesis.members)
    return Model(members, bic(squares.sum(), samples, len(hypothesis.free_parameters)),
                 hypothesis.values)
