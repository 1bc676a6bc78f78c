"""The functions that a search is made of: each can be timed, or swapped for another."""

import dataclasses
from collections.abc import Callable, Sequence

from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Member
from clie_blocks.analysis.gap.fitting.refinement import prune_joints
from clie_blocks.analysis.gap.method.method import Method
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.candidates import Candidate, pairs, singles
from clie_blocks.analysis.gap.search.drive_gains import drive_gain_fits
from clie_blocks.analysis.gap.search.file_numbers import fit_numbers, wrong_numbers
from clie_blocks.analysis.gap.search.racing import race
from clie_blocks.analysis.gap.search.screening import Screen, screen_causes, screen_residual


@dataclasses.dataclass(frozen=True)
class SearchSteps:
    """The functions, by what they do."""

    screen: Callable[[ResidualModel, Fit, Sequence[Cause]], Screen] = screen_causes
    screen_residual: Callable[[Screen, ResidualModel, Fit], Screen] = screen_residual
    singles: Callable[[Screen, ResidualModel, Fit, Sequence[Cause]], list[Candidate]] = singles
    pairs: Callable[[Screen, Method], list[Candidate]] = pairs
    race: Callable[[ResidualModel, Fit, Sequence[Candidate], int], list[Fit]] = race
    wrong_numbers: Callable[[Problem], list[Member]] = wrong_numbers
    fit_numbers: Callable[[Sequence[Member], ResidualModel, Fit], Fit] = fit_numbers
    drive_gains: Callable[[Fit, ResidualModel], list[Fit]] = drive_gain_fits
    prune: Callable[[Fit, ResidualModel, float], Fit] = prune_joints


SEARCH_STEPS = SearchSteps()
