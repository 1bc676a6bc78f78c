"""Gains and timing that ran in the place of the stated ones, read from the log alone.

With position, reference and command logged, the law is linear in its gains: least squares finds
them without any model of the robot.  A finding counts only where it explains the command down to
its rounding, so that nothing of the robot can pose as the controller.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.replayed import known_from

NONE, UNKNOWN = ("none",), ("unknown",)


def with_fitted_gains(problem, law, k):
    """Return the law with the gains of joint k that fit the logged commands best.

    Parameters
    ----------
    problem : Problem
        Logs.
    law : ControlLaw
        The law to mend; its velocity estimate is kept.
    k : int
        Joint.

    """
    columns, wanted = [], []
    for log in problem.logs:
        free = np.abs(log.u[:, k]) < law.saturation[k] * (1 - 1e-9)
        free[:known_from(log, law)] = False
        columns.append(np.stack([log.q_d[:, k] - log.q[:, k], -law.rate(log.q)[:, k]], 1)[free])
        wanted.append((log.u - log.pe)[free, k])
    found = np.linalg.lstsq(np.concatenate(columns), np.concatenate(wanted), rcond=None)[0]
    kp, kd = law.kp.copy(), law.kd.copy()
    kp[k], kd[k] = found
    return dataclasses.replace(law, kp=kp, kd=kd)


def in_words(name, stated, ran, k):
    """Gains that ran at joint k beside the stated ones, as a sentence."""
    parts = [f"{key} {getattr(ran, key)[k]:.4g}, stated {getattr(stated, key)[k]:.4g}"
             for key in ("kp", "kd")]
    return (f"{name}: the gains that ran are not the stated ones ({'; '.join(parts)}); the file "
            "is wrong, or somebody changed the controller")


def beyond_the_library(ranking):
    """Ranking of a robot whose gains are not the stated ones.

    With the gains that ran nothing else may be left to explain; but then there is something, and
    no effect of the library is it: what would go to `none` goes to `unknown`.

    Parameters
    ----------
    ranking : list of Standing
        From `weighed`, with the law that ran.

    """
    nothing = sum(s.probability for s in ranking if s.names == NONE)
    moved = {NONE: -nothing, UNKNOWN: nothing}
    found = [dataclasses.replace(s, probability=s.probability + moved.get(s.names, 0.0))
             for s in ranking]
    return sorted(found, key=lambda standing: -standing.probability)
