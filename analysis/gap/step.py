"""One step of a fit: damped Gauss-Newton that knows what the datasheet allows."""

import numpy as np

from clie_blocks.analysis.gap.hypothesis import SOFTNESS

DAMPING = 1e-4
FACTOR = 2.5  # by which a step may change a time or a range
BOUNDS = 4  # rounds of finding which bounds of the datasheet a step ends beyond


def step(at, here, damping=DAMPING, keys=None):
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

    """
    used = [i for i, entry in enumerate(at.open) if keys is None or entry.key in keys]
    gram, right = here.normal
    delta = change([at.open[i] for i in used], at, gram[np.ix_(used, used)], right[used],
                    damping)
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


def change(entries, at, gram, right, damping=DAMPING):
    """Change of each number, over its size, that is best with the datasheet's bounds.

    What a datasheet allows costs nothing, so a bound counts where the step ends beyond it.
    """
    size, here = (np.array(x) for x in zip(*((entry.size, at.get(entry)) for entry in entries)))
    centre, allowed = np.array([(entry.centre or 0.0, entry.tolerance or np.inf)
                                for entry in entries]).T
    side = np.sign(at.stray()[[at.open.index(entry) for entry in entries]])
    for _ in range(BOUNDS):
        slope = np.abs(side) * size / allowed / SOFTNESS
        beyond = ((here - centre) / allowed - side) / SOFTNESS
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
