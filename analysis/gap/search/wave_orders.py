"""Orders of waves over the position, of which a gear or an encoder has only some.

No fit refines them: screening takes the one that looks best along the motion of the nominal model.
A wave that moves the joint far is not seen there as it is, and a harmonic beside it may look
better.
"""

from clie_blocks.analysis.gap.causes.cause import Scene
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis, Member
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit, lender
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.search.screening import base_motion, scene

ORDER = "order"


def refit_orders(fitted: Fit, residuals: ResidualModel) -> Fit:
    """Return a fit with harmonics beside those of its waves, while they explain more."""
    waves = [(member, k) for member in fitted.hypothesis.members for k in member.joints
             if any(number.name == ORDER and number.fixed for number in member.cause.numbers)]
    if not waves or fitted.has_diverged or fitted.excess <= residuals.method.calibration.healthy:
        return fitted
    sizes = scene(residuals.problem, fitted.hypothesis, base_motion(fitted.hypothesis))
    for member, k in waves:
        fitted = _with_best_order(fitted, member, k, residuals, sizes)
    return fitted


def _with_best_order(fitted: Fit, member: Member, k: int, residuals: ResidualModel, sizes: Scene,
                     ) -> Fit:
    """Fit whose wave at joint k has an order that none beside it does better than."""
    orders = sorted({float(probe.values[ORDER][k]) for probe in member.cause.probes(sizes)})
    tried = {float(fitted.hypothesis.values[f"{member.name}.{ORDER}"][k])}
    while not residuals.is_out_of_time:
        at = float(fitted.hypothesis.values[f"{member.name}.{ORDER}"][k])
        beside = {*[x for x in orders if x < at][-1:], *[x for x in orders if x > at][:1]} - tried
        if not beside:
            break
        tried |= beside
        like = lender(fitted, residuals.method.fitting)
        fits = [fit(_with_order(fitted.hypothesis, member, k, x), residuals,
                    residuals.method.search.finalist_steps, like) for x in beside]
        fitted = min((fitted, *fits), key=lambda one: one.total)
    return fitted


def _with_order(hypothesis: Hypothesis, member: Member, k: int, order: float) -> Hypothesis:
    """Hypothesis with a small wave of another order at joint k."""
    values = dict(hypothesis.values)
    for name in ("sine", "cosine", ORDER):
        key = f"{member.name}.{name}"
        values[key] = values[key].copy()
        values[key][k] = order if name == ORDER else member.sizes[name][k]
    return hypothesis.with_values(values)
