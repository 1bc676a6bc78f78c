"""Least squares of a hypothesis in closed loop: simulate, whiten, step, keep what improves.

The residual is the whitened prediction error of all joints and fit logs, freed from the response
to an unknown start, with the distances from the datasheet appended.
"""

from clie_blocks.analysis.gap.fitting.hypothesis import hypothesis
from clie_blocks.analysis.gap.fitting.jacobian import jacobian
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import damped_step

TRIES = 4


def shrink_amplitudes(start, bench, reference, members):
    """Return a start with smaller amplitudes, if as it is it does worse than a reference.

    Parameters
    ----------
    start : Hypothesis
        With numbers from a linear regression, which may reach too far.
    bench : Bench
        Whitening.
    reference : float
        Cost on the fit logs of the hypothesis without the causes.
    members : sequence of Member
        Whose amplitudes.

    """
    amplitudes = [f"{member.name}.{number.name}" for member in members
                  for number in member.cause.numbers
                  if number.neutral == 0.0 and not number.fixed]
    for _ in range(TRIES):
        if jacobian(start, bench).cost < reference:
            break
        start = start.with_values({key: 0.3 * value if key in amplitudes else value
                                   for key, value in start.values.items()})
    return start


STEPS = 2  # of the numbers that were there before


def initial_guess(candidate, bench, base):
    """Return the hypothesis of a candidate that a fit starts from.

    Parameters
    ----------
    candidate : Candidate
        Causes with numbers from a linear regression.
    bench : Bench
        Whitening.
    base : Fit
        The refitted nominal model.

    """
    before = candidate.after or base
    at = hypothesis(bench.problem, candidate.members, before.hypothesis)
    there = {entry.key for entry in before.hypothesis.open}
    known = {member.name for member in before.hypothesis.members}
    new = [member for member in candidate.members if member.name not in known]
    extends = len(known) + len(new) == len(candidate.members)
    reference = (before if extends else base).cost
    for _ in range(STEPS):
        here = jacobian(at, bench)
        if here.cost < reference:
            break
        answered = damped_step(at, here, keys=there)
        if jacobian(answered, bench).cost >= here.cost:
            break
        at = answered
    return shrink_amplitudes(at, bench, reference, new)
