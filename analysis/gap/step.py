"""One step of a fit, and the doubt that is left: both know what the datasheet allows."""

import numpy as np

from clie_blocks.analysis.gap.hypothesis import SOFTNESS

DAMPING = 1e-4
FACTOR = 2.5  # by which a step may change a time or a range
BOUNDS = 4  # rounds of finding which bounds of the datasheet a step ends beyond
TINY = 1e-9
ANYWHERE = 3.0  # inverse variance, in tolerances, of what lies anywhere within its tolerance


def step(at, here, damping=DAMPING, keys=None, within=0.0):
    """Hypothesis after a damped Gauss-Newton step, of all open numbers or of some keys only.

    Parameters
    ----------
    at : Hypothesis
        Where the step starts.
    here : Tangent
        Its slopes.
    damping : float
        Levenberg's, relative to the squares of the columns.
    keys : collection of str, optional
        Numbers that may move.
    within : float
        What draws a number to its stated value inside its tolerance, see `change`.

    """
    used = [i for i, entry in enumerate(at.open) if keys is None or entry.key in keys]
    gram, right = here.normal
    delta = change([at.open[i] for i in used], at, gram[np.ix_(used, used)], right[used],
                   damping, within)
    moves = []
    for entry, moved in zip((at.open[i] for i in used), delta):
        here = at.get(entry)
        reach = 3 * max(abs(here), entry.size)
        value = here + np.clip(moved * entry.size, -reach, reach)
        if _is_scale(entry) and here > 0.0:
            value = np.clip(value, here / FACTOR, FACTOR * here)
        moves.append((entry, float(np.clip(value, entry.lower, entry.upper))))
    return at.with_values(at.moved(moves))


def _is_scale(entry):
    """Whether a number is a time or a range: what it does goes with its logarithm."""
    return entry.key.partition(".")[2] in ("time", "range")


def change(entries, at, gram, right, damping=DAMPING, within=0.0):
    """Change of each number, over its size, that is best with the datasheet's bounds.

    What a datasheet allows costs nothing, so a bound counts where the step ends beyond it; or it
    costs `within` times its squared distance from the stated value, in tolerances, and from the
    bound on that cost grows no faster.
    """
    size, here = (np.array(x) for x in zip(*((entry.size, at.get(entry)) for entry in entries)))
    centre, allowed = np.array([(entry.centre or 0.0, entry.tolerance or np.inf)
                                for entry in entries]).T
    side = np.sign(at.stray()[[at.open.index(entry) for entry in entries]])
    for _ in range(BOUNDS):
        weight = np.where(side == 0.0, np.sqrt(within), 1.0 / SOFTNESS)
        slope = weight * size / allowed
        bound = side * (1.0 - within * SOFTNESS**2)
        beyond = weight * ((here - centre) / allowed - bound)
        normal = gram + np.diag(slope**2)
        scale = np.sqrt(np.diag(normal)) + 1e-12
        normal = normal / np.outer(scale, scale) + damping * np.eye(len(scale))
        delta = -np.linalg.solve(normal, (right + slope * beyond) / scale) / scale
        z = (here + delta * size - centre) / allowed
        ended = np.sign(z) * (np.abs(z) > 1.0)
        if (ended == side).all():
            break
        side = ended
    return delta


def spread(entries, gram, misfit):
    """Standard deviation of each number, whatever the others are.

    Parameters
    ----------
    entries : sequence of Open
        The numbers.
    gram : ndarray
        Of the columns of the logs, per size of each number.
    misfit : float
        chi^2 per sample, by which the logs tell less than their noise would allow.

    """
    size, allowed = np.array([(entry.size, entry.tolerance or np.inf) for entry in entries]).T
    known = gram / max(misfit, 1.0) + ANYWHERE * np.diag((size / allowed)**2)
    scale = np.sqrt(np.diag(known)) + TINY
    inverse = np.linalg.inv(known / np.outer(scale, scale) + TINY * np.eye(len(scale)))
    return np.sqrt(np.diag(inverse)) / scale * size
