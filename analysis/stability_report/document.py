"""The stability report as a document: verdict first, then each condition."""

import numpy as np

from clie_blocks.analysis.report.document import BAD, GOOD, UNSURE, Document, Section
from clie_blocks.analysis.reproduction.errata import errata_section
from clie_blocks.analysis.stability_report.linear_analysis import LinearAnalysis
from clie_blocks.analysis.stability_report.plots import NORM
from clie_blocks.analysis.stability_report.quantities import Quantities
from clie_blocks.analysis.stability_report.sections import (
    condition_section,
    convergence_section,
    excitation_section,
    identification_section,
    join_values,
    linear_section,
    number,
    pd_bound_section,
)
from clie_blocks.analysis.stability_report.study import Study
from clie_blocks.analysis.theory.bounds import Condition


def document(study: Study, quantities: Quantities) -> Document:
    """The report of a study, ready to be written."""
    sentence, mood, advice = verdict(study, quantities)
    b = quantities.bounds
    sections = [
        Section("What to do" if advice else "Assumptions", (), (*advice, *study.remarks)),
        condition_section(study, b), pd_bound_section(study, b), identification_section(study, b),
        linear_section(study, quantities.linear),
        convergence_section(study, quantities.convergence),
        excitation_section(quantities.excitation)]
    if study.is_paper:
        sections.append(errata_section())
    return Document(f"Stability of {study.name}", sentence, mood, tuple(sections),
                    facts(study, quantities))


def facts(study: Study, quantities: Quantities) -> tuple[tuple[str, str], ...]:
    """The quantities of the summary, each with its value and unit in words."""
    b, joints = quantities.bounds, study.joints
    return (("smallest margin of K_bar", number(b.condition.margin)),
            (f"mu_0 {NORM}", number(b.ultimate.mu_0)),
            (f"invariant radius {NORM}", number(b.ultimate.invariant.outer)),
            (f"simulated radius {NORM}", number(b.radius)),
            ("slowest estimate [s]", f"{quantities.convergence.here.time_constant:.3g}"),
            ("Kp [N m/rad]", join_values(joints.kp)),
            ("Kd [N m s/rad]", join_values(joints.kd)))


def verdict(study: Study, quantities: Quantities) -> tuple[str, str, tuple[str, ...]]:
    """Whether the gains are safe in a sentence, its mood, and what to change joint by joint.

    The mood is ``'good'``, ``'unsure'`` (safe nominally, not over the whole box) or ``'bad'``.
    """
    b, poles = quantities.bounds, quantities.linear.poles
    advice = _advice(study, b.condition, "") if not b.condition.holds else ()
    if not poles["G1"].stable:
        return ("Unstable: with velocity through G1 the PD loop itself has poles in the right "
                "half-plane.", BAD, (*advice, _lower(quantities.linear)))
    if advice:
        return (f"Not safe: K_bar = Kp^-1 Kd A_bar - I is {b.condition.margin:.3g}, not positive, "
                "so that the identification loop has no proof of stability; "
                f"{_pd_loop(quantities)}.", BAD, advice)
    if not b.worst.condition.holds:
        return (f"Safe for the nominal parameters (margin {b.condition.margin:.3g}), but not for "
                f"all that are possible (margin {b.worst.condition.margin:.3g}).", UNSURE,
                _advice(study, b.worst.condition, " to be safe for all possible parameters"))
    return (f"Stable: K_bar = Kp^-1 Kd A_bar - I is positive for every joint, smallest margin "
            f"{b.condition.margin:.4g}, and {b.worst.condition.margin:.4g} over all possible "
            "parameters.", GOOD, ())


def _advice(study: Study, condition: Condition, purpose: str) -> tuple[str, ...]:
    joints = study.joints
    return tuple(
        f"Joint {k + 1}: raise Kd from {joints.kd[k]:.4g} above {condition.smallest_kd[k]:.4g} "
        f"N m s/rad, or lower Kp from {joints.kp[k]:.4g} below {condition.largest_kp[k]:.4g} "
        f"N m/rad{purpose}." for k in np.flatnonzero(condition.per_joint <= 0))


def _pd_loop(quantities: Quantities) -> str:
    if quantities.convergence.here.slowest < 0:
        return "linearised about the true parameters it is unstable at this Gamma"
    return "the PD loop alone is stable, and small errors still decay at this Gamma"


def _lower(linear: LinearAnalysis) -> str:
    factor = min(one.least_gain for one in linear.margins["G1"])
    return f"Lower both gains to less than {factor:.3g} times their values."
