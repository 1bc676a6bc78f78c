"""A measured torque that was recorded late, or behind a low-pass, and drives the models.

Recorders write a torque of another topic, clock or filter into the row of a position.  No cause
of the robot brings torque and motion out of step like this, so the torque is read as logged, late,
and low-passed, each with the lag that leaves least.

Before the search, whatever depends on place, speed and load is a free torque in these models: what
it leaves is a lag, or a cause with a memory, such as a soft gear.  After a search that leaves a
gap, its best hypothesis takes the place of the free torque, and the search is repeated with the
lag that this shows.  It is the log's fault where that explains next to all that was left.
"""

import dataclasses
import itertools
from collections.abc import Callable, Sequence

import numpy as np

from clie_blocks.analysis.gap.causes.cause import Cause
from clie_blocks.analysis.gap.causes.friction import COULOMB
from clie_blocks.analysis.gap.causes.transmission import BACKLASH
from clie_blocks.analysis.gap.controller.replay import ControllerCheck
from clie_blocks.analysis.gap.explain import ExplainSteps, Explanation, explain
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.observer import with_observer
from clie_blocks.analysis.gap.method import Method
from clie_blocks.analysis.gap.problem.law import StatedLaw
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.torque_lag import TorqueLag, without_torque_lag
from clie_blocks.analysis.gap.residual.whitening import ResidualModel

Left = Callable[[TorqueLag], float]
"""Excess that models leave with a lag of the torque."""
Lagging = tuple[TorqueLag, float]
"""A lag, and what models leave with it."""
_REACH = 5.0  # steps to which a parabola is trusted
_ROUNDS = 4  # of the finest step, while the lag still moves by more than it


def time_torque(controller: ControllerCheck, problem: Problem, method: Method,
                steps: ExplainSteps) -> ControllerCheck:
    """Return the check with the lag of a measured torque, as simple models show it.

    These are the nominal model and, where it does not show it, models with Coulomb friction and
    with backlash, whose torque jumps as no smooth one does.
    """
    if not _is_driven_by_measurement(controller, problem):
        return controller
    read = with_observer(controller.corrected(problem), method)
    nominal = _explained(read, TorqueLag(), (), method, steps)
    lag, most = _early_lag(read, nominal, (), method, steps), method.fitting.torque_lag_sought
    if nominal.has_gap and not method.fitting.is_long(problem.n):
        for causes in ((COULOMB,), (BACKLASH,)):
            if lag != TorqueLag():
                break
            as_logged = _explained(read, TorqueLag(), causes, method, steps)
            if _best(as_logged).excess < most * nominal.nominal.excess:
                lag = _early_lag(read, as_logged, causes, method, steps)
    return _with_lag(controller, lag, problem)


def _explained(read: Problem, lag: TorqueLag, causes: Sequence[Cause], method: Method,
               steps: ExplainSteps) -> Explanation:
    return explain(without_torque_lag(read, lag), causes, method, steps, test_lack_of_fit=False)


def _early_lag(read: Problem, as_logged: Explanation, causes: Sequence[Cause], method: Method,
               steps: ExplainSteps) -> TorqueLag:
    """Lag that leaves a small share of what an explanation does without, beside free torques.

    An impact that comes and goes is a ridge in the misfit, so that a model of backlash is fitted
    anew behind some low-passes first.
    """
    share = method.fitting.torque_lag_left
    lag = _lag(_best(as_logged), as_logged.residuals, steps.lack_of_fit, share)
    if lag != TorqueLag() or BACKLASH not in causes:
        return lag
    timed = {each: _explained(read, each, causes, method, steps) for each in
             (TorqueLag(time_constant=seconds) for seconds in method.fitting.low_pass_starts)}
    start = min(timed, key=lambda each: _best(timed[each]).excess)
    lag = start + _lag(_best(timed[start]), timed[start].residuals, steps.lack_of_fit, 1.0)
    left = [steps.lack_of_fit(_best(one), one.residuals)
            for one in (_explained(read, lag, causes, method, steps), as_logged)]
    return lag if left[0] < share * left[1] else TorqueLag()


def time_torque_again(controller: ControllerCheck, problem: Problem, as_logged: Explanation,
                      explain: Callable[[Problem], Explanation],
                      ) -> tuple[ControllerCheck, Explanation]:
    """Return the check and the explanation with the lag of a torque that its best model shows.

    The best hypothesis may be another one then, which shows the lag better.
    """
    method = as_logged.residuals.method.fitting
    if controller.torque_lag or not _is_driven_by_measurement(controller, problem):
        return controller, as_logged
    total, explanation = TorqueLag(), as_logged
    for _ in range(method.torque_lag_rounds):
        more = _lag(_best(explanation), explanation.residuals, lambda one, _: one.excess,
                    method.torque_lag_sought)
        total = total + more
        timed = _with_lag(controller, total, problem)
        if more == TorqueLag() or timed is controller:
            break
        explanation = explain(timed.corrected(problem))
        if _best(explanation).excess < method.torque_lag_left * _best(as_logged).excess:
            return timed, explanation
    return controller, as_logged


def _is_driven_by_measurement(controller: ControllerCheck, problem: Problem) -> bool:
    """Whether a measured torque drives the models; beside a simulator, its runs are compared."""
    law = controller.law
    return (isinstance(law, StatedLaw) and law.measured_torque
            and not problem.law.holds_joints and not problem.simulated)


def _best(explanation: Explanation) -> Fit:
    fits = [row.fit for row in explanation.evidence.rows if row.fit is not None]
    return min([explanation.nominal, *fits], key=lambda one: one.excess)


def _with_lag(controller: ControllerCheck, lag: TorqueLag, problem: Problem) -> ControllerCheck:
    """Check with a lag, itself where that is less than from one sample to the next."""
    if abs(lag.seconds) < problem.period * max(log.stride for log in problem.logs):
        return controller
    return dataclasses.replace(controller, torque_lag=lag)


def _lag(model: Fit, residuals: ResidualModel, excess: Callable[[Fit, ResidualModel], float],
         share: float) -> TorqueLag:
    """Lag with which a model, refitted, leaves less than a share of what it does without."""
    method = residuals.method
    if model.has_diverged or model.excess < method.calibration.healthy:
        return TorqueLag()

    def left(lag: TorqueLag) -> float:
        read = without_torque_lag(residuals.problem, lag)
        seen = dataclasses.replace(residuals, problem=read)
        refitted = fit(dataclasses.replace(model.hypothesis, problem=read), seen)
        return np.inf if refitted.has_diverged else excess(refitted, seen)

    steps = method.fitting.torque_lag_steps
    as_logged = late = best = TorqueLag(), left(TorqueLag())
    if as_logged[1] < method.calibration.healthy:
        return TorqueLag()
    for step in steps:
        late = _better(late, "age", step, left)
    for _ in range(_ROUNDS):
        before, late = late, _better(late, "age", steps[-1], left)
        if abs(late[0].age - before[0].age) < steps[-1]:
            break
    if late[0].age > 0.0 and late[1] > method.calibration.healthy:
        passed = TorqueLag(time_constant=late[0].age)
        best = passed, left(passed)
        for name, step in itertools.product(("time_constant", "age"), steps[1:]):
            best = _better(best, name, step, left)
    lag, least = best if best[1] < method.fitting.low_pass_left * late[1] else late
    return lag if least < share * as_logged[1] else TorqueLag()


def _better(best: Lagging, name: str, step: float, left: Left) -> Lagging:
    """Lag of least excess near one, along one of its numbers: what is left is a parabola of it."""
    lag, least = best

    def at(change: float) -> Lagging:
        moved = dataclasses.replace(lag, **{name: getattr(lag, name) + change})
        return moved, left(moved)

    before, after = at(-step), at(step)
    tried = [best, before, after]
    bend = before[1] - 2.0 * least + after[1]
    if np.isfinite(bend) and bend > 0.0:
        reach = _REACH * step
        tried.append(at(float(np.clip(0.5 * step * (before[1] - after[1]) / bend, -reach, reach))))
    return min(tried, key=lambda one: one[1])
