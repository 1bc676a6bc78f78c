"""The simulator of a problem: of the stated robot, or of the user's own loop."""

import functools
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from clie_blocks.analysis.gap.problem.law import Law
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.user_loop.law import LoopLaw
from clie_blocks.analysis.gap.simulation.closed_loop import simulator, structure
from clie_blocks.analysis.gap.simulation.user_loop.simulator import LoopSimulator
from clie_blocks.robot_loop.dynamics import ActingCause, Values


class LoopRunner(Protocol):
    """A closed loop with causes that runs in the experiment of a log."""

    @property
    def threads(self) -> int | None:
        """Threads in which it may run; None for one per processor."""

    def run(self, log: Log, values: Values, dithered: bool = True,
            ) -> tuple[np.ndarray, np.ndarray]:
        """Positions and commands of the model, shape (N, n) each."""

    def positions(self, log: Log, sets: Sequence[Values], dithered: bool = True) -> np.ndarray:
        """Measured positions for many sets of parameters, shape (sets, n, N)."""

    def means(self, views: Sequence[Log], sets: Sequence[Values], width: int) -> list[np.ndarray]:
        """The same of the views of one run, averaged over `width` neighbouring samples."""

    def check(self, log: Log) -> None:
        """Refuse a loop that cannot run in the experiment of a log."""


def simulator_of(problem: Problem, causes: Sequence[ActingCause]) -> LoopRunner:
    """Return the closed loop of a problem with some causes; compiled once."""
    return _loop_of(problem.law, problem, tuple(causes))


@functools.singledispatch
def _loop_of(law: Law, problem: Problem, causes: tuple[ActingCause, ...]) -> LoopRunner:
    return simulator(structure(problem), causes)


@_loop_of.register(LoopLaw)
def _loop_of_user(law: LoopLaw, problem: Problem, causes: tuple[ActingCause, ...]) -> LoopRunner:
    return _user_loop(law, causes)


@functools.lru_cache(maxsize=256)
def _user_loop(law: LoopLaw, causes: tuple[ActingCause, ...]) -> LoopSimulator:
    return LoopSimulator(law, causes)
