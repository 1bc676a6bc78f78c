"""What a law leaves of the commands of a log, from where its velocity filter is known.

A filter that begins at rest with the log is known from the first sample on.  In a log that was cut
out of a longer run it is known once it has forgotten how that run began.
"""

from clie_blocks.analysis.records.velocity_filter import settling


def first_known_sample(log, law):
    """First sample at which the velocity that the law forms is known."""
    if log.at_rest:
        return 0
    return min(settling(law.variant, law.period, law.corners), len(log) // 2)


def law_residual(law, log, late=0):
    """Logged command less that of the law some rows before it, shape (samples, n)."""
    made = law.replay(log.q, log.q_d, log.pe)[:len(log) - late]
    return (log.u[late:] - made)[first_known_sample(log, law):]
