"""The stability report as a document: verdict first, then each condition with its numbers."""

import numpy as np

from clie_blocks.analysis.report.document import BAD, GOOD, UNSURE, Document, Section
from clie_blocks.analysis.reproduction.command import errata_section
from clie_blocks.analysis.stability_report.sections import (
    condition_section,
    convergence_section,
    excitation_section,
    identification_section,
    linear_section,
    listed,
    number,
    pd_bound_section,
)


def document(study, found):
    """Arrange the numbers of a study.

    Parameters
    ----------
    study : Study
        Robot, gains, excitation.
    found : dict
        ``bounds``, ``linear``, ``convergence``, ``excitation``, see
        `clie_blocks.analysis.stability_report.quantities`.

    Returns
    -------
    Document
        Ready to be written.

    """
    sentence, mood, advice = verdict(study, found)
    b, joints = found["bounds"], study.joints
    facts = (("smallest margin of K_bar", number(b.condition.margin)),
             ("mu_0", number(b.ultimate.mu_0)),
             ("radius that holds", number(b.ultimate.invariant.outer)),
             ("simulated radius", number(b.radius)),
             ("slowest estimate", f"{found['convergence'].here.time_constant:.3g} s"),
             ("Kp; Kd", f"{listed(joints.kp)}; {listed(joints.kd)}"))
    sections = [
        Section("What to do" if advice else "What was assumed", (), (*advice, *study.remarks)),
        condition_section(study, b), pd_bound_section(study, b), identification_section(study, b),
        linear_section(study, found["linear"]), convergence_section(study, found["convergence"]),
        excitation_section(found["excitation"])]
    if study.is_paper:
        sections.append(errata_section())
    return Document(f"Stability of {study.name}", sentence, mood, tuple(sections), facts)


def verdict(study, found):
    """Say whether the gains are safe, and if not what to change.

    Parameters
    ----------
    study : Study
        Robot and gains.
    found : dict
        As in `document`.

    Returns
    -------
    sentence : str
        The answer.
    mood : str
        ``'good'``, ``'unsure'`` (nominally, not over the whole box) or ``'bad'``.
    advice : tuple of str
        What to change, joint by joint.

    """
    b, poles = found["bounds"], found["linear"].poles
    advice = _advice(study, b.condition, "") if not b.condition.holds else ()
    if not poles["G1"].stable:
        return ("Unstable: with velocity through G1 the PD loop itself has poles in the right "
                "half-plane.", BAD, (*advice, _lower(found["linear"])))
    if advice:
        return (f"Not safe: K_bar = Kp^-1 Kd A_bar - I is {b.condition.margin:.3g}, not positive, "
                f"so that the identification loop has no proof of stability; {_indeed(found)}.",
                BAD, advice)
    if not b.worst.condition.holds:
        return (f"Safe for the nominal parameters (margin {b.condition.margin:.3g}), but not for "
                f"all that are possible (margin {b.worst.condition.margin:.3g}).", UNSURE,
                _advice(study, b.worst.condition, " to be safe for all possible parameters"))
    return (f"Stable: K_bar = Kp^-1 Kd A_bar - I is positive for every joint, smallest margin "
            f"{b.condition.margin:.4g}, and {b.worst.condition.margin:.4g} over all possible "
            "parameters.", GOOD, ())


def _advice(study, condition, purpose):
    joints = study.joints
    return tuple(
        f"Joint {k + 1}: raise Kd from {joints.kd[k]:.4g} above {condition.smallest_kd[k]:.4g} "
        f"N m s/rad, or lower Kp from {joints.kp[k]:.4g} below {condition.largest_kp[k]:.4g} "
        f"N m/rad{purpose}." for k in np.flatnonzero(condition.per_joint <= 0))


def _indeed(found):
    if found["convergence"].here.slowest < 0:
        return "linearised about the true parameters it is indeed unstable at this Gamma"
    return "the PD loop alone is stable, and small errors still die out at this Gamma"


def _lower(linear):
    factor = min(one.least_gain for one in linear.margins["G1"])
    return f"Lower both gains, to less than {factor:.3g} of what they are."
