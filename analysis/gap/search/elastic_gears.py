"""Gears that give way: when one of them leads, the others start where they come nearest.

A gear that stiffens or that slips is an elastic one with two more parameters, in which what it
leaves has many minima.  So a grid over them is simulated side by side around the elastic gear.
"""

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.causes.transmission import (
    JOINT_ELASTICITY,
    STIFFENING_ELASTICITY,
    TORSIONAL_HYSTERESIS,
)
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import (
    Member,
    Values,
    build_hypothesis,
    chi2_by_joint,
)
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.candidates import fitted_members
from clie_blocks.robot_loop.motion import link_share_of_joint

ELASTIC = JOINT_ELASTICITY, STIFFENING_ELASTICITY, TORSIONAL_HYSTERESIS
_SOFTER = 0.5, 0.7, 0.85, 1.0  # frequencies over that of the elastic gear
_STIFFENINGS = (*itertools.product((0.5, 1.5, 4.0), (0.15, 0.35, 0.7, 1.2)),
                (20.0, 1.5), (20.0, 4.0))
"""Stiffenings and knees, these over the RMS torque; the last two are nearly cubic springs."""
_LEVELS, _REACHES = (0.1, 0.3, 0.7), (0.06, 0.15, 0.4, 1.0, 2.5)  # over RMS torque, its twist
_LESS_DAMPED = 0.1  # times the damping of the elastic gear, where what slips takes the energy
_FIRST_STEPS = 4  # of a fit, after which the better of two starts shows
_RINGING = np.geomspace(2.0, 60.0, 60), (0.01, 0.03, 0.1, 0.3)
"""Frequencies [Hz] and damping ratios of a gear that may ring."""
_SHARES_OF_LINKS, _SHARES_OF_JOINT = (0.7, 1.0), (0.2, 0.6)  # that it carries
_RINGING_STARTS = 6


def other_gears(member: Member, others: Sequence[Member], leader: Fit, residuals: ResidualModel,
                ) -> list[Member]:
    """Elastic gears in the place of one of the members of a fit, each from its best start.

    What slips takes energy as a damper does: from the damping that made up for it, its level
    shrinks to nothing.
    """
    gears = [_best_start(cause, member, others, leader, residuals) for cause in ELASTIC]
    ringing = dataclasses.replace(member, values={
        **member.values, "damping_ratio": _LESS_DAMPED * member.values["damping_ratio"]})
    slipping = [gears[-1],
                _best_start(TORSIONAL_HYSTERESIS, ringing, others, leader, residuals)]
    return [*gears[:-1], _after_first_steps(slipping, others, leader, residuals)]


def ringing_gear(joints: tuple[int, ...], others: Sequence[Member], leader: Fit,
                 residuals: ResidualModel) -> Member:
    """Return the elastic gear, at some joints beside other members, that leaves least.

    A gear that rings in its loop explains next to nothing unless frequency and damping are nearly
    right, so a fine grid is simulated, and its best places are fitted for a few steps.
    """
    problem = residuals.problem
    shares = _SHARES_OF_LINKS if problem.links.known else _SHARES_OF_JOINT
    grid = [{name: np.full(problem.n, value) for name, value in (
                ("frequency", frequency), ("damping_ratio", damping), ("link_share", share),
                ("bearing_share", 0.5), ("loose", 1.0))}
            for frequency, damping, share in itertools.product(*_RINGING, shares)]
    gears = [Member(JOINT_ELASTICITY, joints, values, _sizes(values)) for values in grid]
    left = _left_by_joint(gears, others, leader, residuals)
    ranked = np.argsort(left, axis=1)[:, :_RINGING_STARTS].T
    starts = [_of_joints(gears, best) for best in ranked]
    return _after_first_steps(starts, others, leader, residuals)


def _after_first_steps(starts: Sequence[Member], others: Sequence[Member], leader: Fit,
                       residuals: ResidualModel) -> Member:
    """That of some members which leaves less after a few steps of its fit, as it is then."""
    fits = [fit(build_hypothesis(residuals.problem, (*others, start), leader.hypothesis),
                residuals, _FIRST_STEPS) for start in starts]
    best = min(fits, key=lambda one: one.cost)
    return fitted_members(best.hypothesis)[-1]


def _best_start(cause: Cause, member: Member, others: Sequence[Member], leader: Fit,
                residuals: ResidualModel) -> Member:
    """Gear with the parameters, joint by joint, that leave least."""
    starts = [dataclasses.replace(member, cause=cause, values=values, sizes=_sizes(values))
              for values in _grid(cause, member, leader)]
    left = _left_by_joint(starts, others, leader, residuals)
    return _of_joints(starts, np.argmin(left, axis=1))


def _left_by_joint(gears: Sequence[Member], others: Sequence[Member], leader: Fit,
                   residuals: ResidualModel) -> np.ndarray:
    """chi^2 of each joint with each of some gears, beside other members, shape (n, gears)."""
    variants = [build_hypothesis(residuals.problem, (*others, gear), leader.hypothesis)
                for gear in gears]
    return np.sum([chi2_by_joint(variants, residuals, j)
                   for j in range(len(residuals.problem.fit))], axis=0)


def _of_joints(gears: Sequence[Member], which: Sequence[int]) -> Member:
    """Gear with the parameters at each joint of one of some gears."""
    values = {name: np.stack([gear.values[name] for gear in gears])[which, range(len(which))]
              for name in gears[0].values}
    return dataclasses.replace(gears[0], values=values, sizes=_sizes(values))


def _sizes(values: Values) -> Values:
    return {name: np.abs(value) + 1e-9 for name, value in values.items()}


def _grid(cause: Cause, member: Member, leader: Fit) -> list[Values]:
    """Parameters of a gear around those of another one."""
    kept = {number.name: member.values[number.name] for number in JOINT_ELASTICITY.numbers}
    if cause is JOINT_ELASTICITY:
        return [kept]
    torque, stiffness = _torque_and_stiffness(kept["frequency"], member, leader)
    if cause is STIFFENING_ELASTICITY:
        return [{**kept, "frequency": softer * kept["frequency"],
                 "stiffening": stiffening + 0 * torque, "knee": knee * torque}
                for softer, (stiffening, knee) in itertools.product(_SOFTER, _STIFFENINGS)]
    return [{**kept, "frequency": softer * kept["frequency"], "level": level * torque,
             "reach": reach * torque / stiffness}
            for softer, level, reach in itertools.product(_SOFTER, _LEVELS, _REACHES)]


def _torque_and_stiffness(frequency: np.ndarray, member: Member, leader: Fit,
                          ) -> tuple[np.ndarray, np.ndarray]:
    """RMS torque, and stiffness of a gear whose link swings at a frequency [Hz].

    Two encoders show the twist, and with it the torque that the gear itself passes on.
    """
    problem, values = leader.hypothesis.problem, leader.hypothesis.values
    link, _ = link_share_of_joint(
        problem.links, problem.gear_ratio, values, member.values["link_share"])
    stiffness = link * (2 * np.pi * frequency) ** 2
    twists = [log.q - log.law_q for log in problem.fit if log.of_other_encoder]
    if twists:
        return stiffness * np.std(np.concatenate(twists), axis=0), stiffness
    return problem.rms_command, stiffness
