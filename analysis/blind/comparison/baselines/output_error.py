"""Closed-loop output error: models fitted by simulation to the measured positions, as they are."""

from clie_blocks.analysis.blind.comparison.ablations import unwhitened, weighing
from clie_blocks.analysis.blind.comparison.baselines.model_selection import Model, answer, bic
from clie_blocks.analysis.gap.causes import drive, friction
from clie_blocks.analysis.gap.fitting.hypothesis import Member, hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.search.screening import base_motion, scene

STEPS = 12


WORTH = 10.0  # how much BIC must gain for a joint to count as a place of the cause


def fitted(problem, menu):
    """Fit the nominal model and each entry of a menu.

    Parameters
    ----------
    problem : Problem
        The robot.
    menu : list of tuple of Cause
        Models, each a set of causes at all joints.

    Returns
    -------
    list of Model
        The nominal model first.

    """
    with weighing(unwhitened):
        bench, base = fit_nominal(problem)
    look = scene(bench.problem, base.hypothesis, base_motion(base.hypothesis))
    found = [_model(base, base)]
    for causes in menu:
        members = tuple(_member(cause, look) for cause in causes)
        start = hypothesis(bench.problem, members, base.hypothesis)
        found.append(_model(fit(start, bench, STEPS), base))
    return found


def _member(cause, look):
    """Cause at all joints; the numbers in the middle of where it is looked for are its start."""
    probes = cause.probes(look)
    values = probes[len(probes) // 2].values
    return Member(cause, tuple(range(look.problem.n)), values, values)


def _model(found, base):
    at, logs = found.hypothesis, len(found.hypothesis.problem.fit)
    squares, samples = found.chi2[:logs], int(found.samples[:logs].sum())
    numbers = len(at.open)
    gained = base.chi2[:logs].sum(axis=0) - squares.sum(axis=0)
    left = squares.sum() / samples
    joints = tuple(k for k in range(at.problem.n) if gained[k] / left > WORTH)
    members = tuple(Member(m.cause, joints or m.joints, m.values, m.sizes) for m in at.members)
    return Model(members, bic(squares.sum(), samples, numbers), at.values)


FRICTION_MENU = ((friction.COULOMB,), (friction.STRIBECK,), (friction.ASYMMETRIC_COULOMB,),
        (friction.LOAD_DEPENDENT_FRICTION[0],), (friction.QUADRATIC_DRAG,))


def friction_menu(problem):
    """Diagnose a robot by fitting each friction model of the menu in closed loop."""
    return answer(problem, fitted(problem, FRICTION_MENU))


JOINT_MENU = ((friction.COULOMB,), (drive.TIME_DELAY,), (friction.COULOMB, drive.TIME_DELAY))


def simulator_fit(problem):
    """Diagnose a robot by the numbers that its simulator's joints have."""
    return answer(problem, fitted(problem, JOINT_MENU))
