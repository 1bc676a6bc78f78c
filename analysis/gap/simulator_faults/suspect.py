"""The simulator as suspect: which fault makes its logs differ from what its files state.

Each fault is a hypothesis without parameters: the stated run with the fault, simulated by the
blocks of this package in closed loop.  It is fitted within next to nothing of the stated joint
model, and ranked as the diagnosis ranks its causes.  What a run leaves is its mean square error,
in that of the noise: the errors of engines and steps are not coloured by a loop as the noise of an
encoder is, and a simulator starts from a state that its logs show.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import build_hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.method import METHOD, Method
from clie_blocks.analysis.gap.problem.sensor_noise import sensor_noise
from clie_blocks.analysis.gap.residual.whitening import residual_model
from clie_blocks.analysis.gap.simulator_comparison.integrator import (
    describe_integrator,
    lead_of,
)
from clie_blocks.analysis.gap.simulator_faults.faults import FAULTS, Fault
from clie_blocks.analysis.gap.simulator_faults.stated_run import StatedRun
from clie_blocks.analysis.gap.verdict.evidence import Row, Table
from clie_blocks.analysis.gap.verdict.posterior import LIKELY, NONE, UNKNOWN, posterior

LEAST = 1e-3  # probability below which a fault is not listed


@dataclasses.dataclass(frozen=True, eq=False)
class Suspected:
    """One fault at some joints, and the run that it would make.

    Parameters
    ----------
    fault : Fault
        What is wrong.
    joints : tuple of int
        Where; all of them for a fault of the whole simulator.
    probability : float
        That it is this one.
    gap : float
        RMS of logged less simulated position that is left with it [rad].
    fit : Fit
        The fitted run.

    """

    fault: Fault
    joints: tuple[int, ...]
    probability: float
    gap: float
    fit: Fit


@dataclasses.dataclass(frozen=True, eq=False)
class Suspicion:
    """What a simulator does wrong, by its own logs.

    Parameters
    ----------
    run : StatedRun
        What it was to run.
    verdict : str
        Name of the fault, ``none``, or ``unknown`` where no fault of the list explains the logs.
    suspected : tuple of Suspected
        Faults, most probable first.
    none, unknown : float
        Probabilities that nothing is wrong, and that something else is.
    stated : Fit
        The run that the files state, fitted.
    gap : float
        RMS of logged less stated position [rad].

    """

    run: StatedRun
    verdict: str
    suspected: tuple[Suspected, ...]
    none: float
    unknown: float
    stated: Fit
    gap: float

    def to_dict(self) -> dict[str, Any]:
        """Return the answer in plain types."""
        return {"schema_version": 1, "verdict": self.verdict, "model": str(self.run.model.path),
                "gap": self.gap, "none": self.none, "unknown": self.unknown,
                "notes": list(describe_integrator(self.stated.hypothesis)),
                "faults": [_row(one, self.run) for one in self.suspected]}


@threadpool_limits.wrap(limits=1, user_api="blas")  # small matrices: threads would only wait
def suspect(run: StatedRun, method: Method = METHOD) -> Suspicion:
    """Find the fault that makes a simulator differ from what its files state.

    Parameters
    ----------
    run : StatedRun
        From `stated_run`.
    method : Method
        Thresholds.

    """
    start = build_hypothesis(run.problem, ())
    residuals = residual_model(run.problem, start, method)
    stated, unfitted = fit(start, residuals), fit(start, residuals, 0)
    tried = [(fault, joints, fit(build_hypothesis(changed.problem, ()), residuals))
             for fault, joints, changed in _tried(run)]
    best = _best_of_each(tried)
    rows = [Row((name,), excess(fitted), fault.free, fit=fitted)
            for name, (fault, _, fitted) in best.items()]
    table = Table(excess(stated), 0.0, 0, (), rows, nominal=stated)
    ranking = posterior(table, method.calibration)
    probability = {ranked.names[0]: ranked.probability for ranked in ranking}
    suspected = tuple(
        Suspected(best[name][0], best[name][1], p, rms_error(best[name][2]), best[name][2])
        for name, p in probability.items() if name in best and p >= LEAST)
    leading = max(probability, key=lambda name: probability[name])
    verdict = best[leading][0].name if leading in best else leading
    if probability[leading] < LIKELY and leading != NONE:
        verdict = UNKNOWN
    return Suspicion(run, verdict, suspected, probability[NONE], probability[UNKNOWN],
                     stated, rms_error(unfitted))


def _tried(run: StatedRun) -> Iterator[tuple[Fault, tuple[int, ...], StatedRun]]:
    """Every fault at all joints, and at each joint alone."""
    n = run.problem.n
    places = [np.ones(n, bool), *(np.arange(n) == k for k in range(n) if n > 1)]
    for fault in FAULTS:
        for at in places:
            for changed in fault.runs(dataclasses.replace(run, at=at)):
                yield fault, tuple(np.flatnonzero(at).tolist()), changed


def _best_of_each(tried: Sequence[tuple[Fault, tuple[int, ...], Fit]],
                  ) -> dict[str, tuple[Fault, tuple[int, ...], Fit]]:
    """The run of each fault that leaves least, by name."""
    best: dict[str, tuple[Fault, tuple[int, ...], Fit]] = {}
    for one in tried:
        name = one[0].name
        if name not in best or excess(one[2]) < excess(best[name][2]):
            best[name] = one
    return best


def excess(fitted: Fit) -> float:
    """Mean square error beyond that of the noise, with the distance from the stated numbers."""
    problem = fitted.hypothesis.problem
    noise = np.array([sensor_noise(problem, k) for k in range(problem.n)])
    error = _errors(fitted) / noise
    return float(np.mean(error**2) - 1.0 + fitted.penalty / len(error))


def rms_error(fitted: Fit) -> float:
    """RMS of logged less simulated position, over all logs and joints [rad]."""
    return float(np.sqrt(np.mean(_errors(fitted) ** 2)))


def _errors(fitted: Fit) -> np.ndarray:
    """Logged less simulated positions of all logs, shape (N, n) [rad]."""
    hypothesis = fitted.hypothesis
    return np.concatenate([hypothesis.error(j) for j in range(len(hypothesis.problem.logs))])


def _row(one: Suspected, run: StatedRun) -> dict[str, Any]:
    """A suspected fault in plain types, with the lines of the model file that hold it."""
    fault = one.fault
    places = [fault.place(run, k) for k in one.joints[:1 if fault.of_robot else None]]
    return {"fault": fault.name, "probability": one.probability,
            "joints": [] if fault.of_robot else [run.problem.joints[k] for k in one.joints],
            "says": fault.says, "mend": fault.mend, "gap": one.gap,
            "attribute": fault.attribute,
            "lines": [{"line": run.model.document.line(place), "element": place.name,
                       "value": place.attributes.get(fault.attribute)}
                      for place in places if place is not None],
            "step": 2.0 * abs(lead_of(one.fit.hypothesis)) if fault.name == "long_step" else None}
