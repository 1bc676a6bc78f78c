"""Phases and onsets of a fitted hypothesis, sought anew in each log."""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.causes.drive import PACKET_HOLD
from clie_blocks.analysis.gap.causes.timed import PERIODIC_DISTURBANCE, STEP_FAULT
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import (
    Hypothesis,
    Member,
    Values,
    chi2_by_joint,
)
from clie_blocks.analysis.gap.fitting.law_view import law_view
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.events import (
    NEVER,
    fault_columns,
    first_onsets,
    sinusoid_columns,
    unit_fault_torque,
)
from clie_blocks.analysis.gap.search.hold_times import refit_holds

_SIDE_BY_SIDE = 15  # simulations


def refit_event_times(fitted: Fit, residuals: ResidualModel) -> Fit:
    """Return a fit with phases and onsets of all logs sought anew, if that explains more."""
    method = residuals.method.search
    timed = [member for member in fitted.hypothesis.members
             if member.cause in (PERIODIC_DISTURBANCE, PACKET_HOLD, *STEP_FAULT)]
    if not timed or fitted.has_diverged:
        return fitted
    for _ in range(method.event_rounds):
        hypothesis = fitted.hypothesis
        for member in timed:
            new_values = {PERIODIC_DISTURBANCE: refit_phases, PACKET_HOLD: refit_holds}.get(
                member.cause, refit_onsets)
            seen = law_view(dataclasses.replace(fitted, hypothesis=hypothesis), residuals)
            hypothesis = hypothesis.with_values(new_values(seen.fit, member, seen.residuals))
        before, refitted = fitted.total, fit(hypothesis, residuals, method.event_iterations)
        fitted = refitted if refitted.total < before else fitted
        if fitted.total > (1.0 - method.event_round_gain) * before:
            break
    return fitted


def refit_phases(fitted: Fit, member: Member, residuals: ResidualModel) -> Values:
    """Values with sine and cosine of a sinusoid as they fit each log."""
    hypothesis, problem = fitted.hypothesis, residuals.problem
    sine, cosine, frequency = (f"{member.name}.{name}" for name in ("sine", "cosine", "frequency"))
    values = {**hypothesis.values, sine: hypothesis.values[sine].copy(),
              cosine: hypothesis.values[cosine].copy()}
    for j, log in enumerate(problem.logs):
        errors = residuals.whitened(hypothesis.error(j), j)
        for k in member.joints:
            phase = 2 * np.pi * values[frequency][k] * problem.period * np.arange(len(log))
            columns = sinusoid_columns(residuals, fitted, j, k, phase)
            more = np.linalg.lstsq(columns, errors[k], rcond=None)[0]
            values[sine][j, k] += more[0]
            values[cosine][j, k] += more[1]
    return values


def refit_onsets(fitted: Fit, member: Member, residuals: ResidualModel) -> Values:
    """Values with the onset of a fault at which it explains most of each log."""
    hypothesis, method = fitted.hypothesis, residuals.method.search
    onset, size = (f"{member.name}.{name}" for name in ("onset", member.cause.numbers[0].name))
    onsets = hypothesis.values[onset].copy()
    faultless = hypothesis.with_values({**hypothesis.values,
                                        onset: np.full_like(onsets, NEVER)})
    together = [list(member.joints)] if member.cause.shared else [[k] for k in member.joints]
    for j in range(len(residuals.problem.logs)):
        log = _FaultInLog.of(fitted, faultless, member, residuals, j)
        for joints in together:
            known = onsets[j, joints[0]] < NEVER
            best, gain = log.best_onset(joints, hypothesis.values[size][joints[0]],
                                        onsets[j, joints[0]] if known else None)
            if known or gain > method.onset_gain:
                onsets[j, joints] = _simulated_onset(hypothesis, residuals, onset, best, j, joints)
    return {**hypothesis.values, onset: onsets}


@dataclasses.dataclass(frozen=True, eq=False)
class _FaultInLog:
    """What one log shows of a fault: the errors without it, and its unit torque (N, n)."""

    fitted: Fit
    residuals: ResidualModel
    j: int
    errors: list[np.ndarray]
    torque: np.ndarray

    @classmethod
    def of(cls, fitted: Fit, faultless: Hypothesis, member: Member, residuals: ResidualModel,
           j: int) -> "_FaultInLog":
        """Simulate log j without the fault."""
        error, log = faultless.error(j), residuals.problem.logs[j]
        torque = unit_fault_torque(member.cause.variant, residuals.problem, log.q - error)
        return cls(fitted, residuals, j, residuals.whitened(error, j), torque)

    def best_onset(self, joints: list[int], size: float, known: float | None,
                   ) -> tuple[float, float]:
        """Onset that gains most, sought more and more finely, and what it gains."""
        method = self.residuals.method.search
        duration = len(self.torque) * self.residuals.problem.period
        tried = first_onsets(duration, method.fault_margin, method.refit_onset_spacing)
        if known is not None:
            tried = np.append(tried, known)
        steps = method.refit_onset_spacing, *method.refit_onset_refinements
        for wide, fine in zip(steps, steps[1:]):
            best = tried[np.argmax(self._gains(joints, size, tried))]
            tried = best + np.arange(-wide, wide, fine)
        gains = self._gains(joints, size, tried)
        return tried[np.argmax(gains)], gains.max()

    def _gains(self, joints: list[int], size: float, onsets: np.ndarray) -> np.ndarray:
        """What a fault of a given size would explain of the joints' errors, from each onset on."""
        gains = np.zeros(len(onsets))
        for k in joints:
            columns = fault_columns(self.residuals, self.fitted, self.j, k, self.torque[:, k],
                                    onsets)
            gains += 2 * size * columns.T @ self.errors[k] - size**2 * (columns**2).sum(axis=0)
        return gains


def _simulated_onset(hypothesis: Hypothesis, residuals: ResidualModel, key: str, onset: float,
                     j: int, joints: list[int]) -> float:
    """Onset in log j, near another one, at which the simulated fault leaves least."""
    method = residuals.method.search
    for reach in method.simulated_onset_reaches:
        tried = np.maximum(onset + reach * np.linspace(-1.0, 1.0, _SIDE_BY_SIDE),
                           method.fault_margin)
        variants = [hypothesis.with_values(_with_onset(hypothesis.values, key, each, j, joints))
                    for each in tried]
        onset = float(tried[np.argmin(sum(chi2_by_joint(variants, residuals, j)))])
    return onset


def _with_onset(values: Values, key: str, onset: float, j: int, joints: list[int]) -> Values:
    onsets = values[key].copy()
    onsets[j, joints] = onset
    return {**values, key: onsets}
