"""One step of a fit, and the doubt that is left: both know what the datasheet allows."""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.fitting.hypothesis import SOFTNESS
from clie_blocks.analysis.gap.fitting.jacobian import central_jacobian, jacobian
from clie_blocks.analysis.gap.residual.whitening import DIVERGED

DAMPING = 1e-4
FACTOR = 2.5  # by which a step may change a time or a range
BOUNDS = 4  # rounds of finding which bounds of the datasheet a step ends beyond
TINY = 1e-9
ANYWHERE = 3.0  # inverse variance, in tolerances, of what lies anywhere within its tolerance


def damped_step(at, here, damping=DAMPING, keys=None, within=0.0):
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
    delta = best_change([at.open[i] for i in used], at, gram[np.ix_(used, used)], right[used],
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


def best_change(entries, at, gram, right, damping=DAMPING, within=0.0):
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


def standard_deviations(entries, gram, misfit):
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


CONVERGED = 1e-3
FUTILE = 0.1  # of the gain that ends a fit: foreseen to be less, a step is not simulated
LIGHT = 1e-6  # damping: a heavier one crawls where a cause and the joint model are alike
ASTRAY = 1.0  # squared sigmas beyond the datasheet from which on a fit looks twice
CAUTION = 10.0 ** np.arange(1.0, 7.0, 0.75)  # factors on a damping that failed


@dataclasses.dataclass(frozen=True, eq=False)
class Fit:
    """A fitted hypothesis and how well it does.

    Parameters
    ----------
    hypothesis : Hypothesis
        With its fitted values.
    chi2 : ndarray, shape (logs, n)
        Whitened squared error of each log (those held out included) and joint.
    samples : ndarray, shape (logs, n)
        Whitened samples.
    stray : ndarray, shape (open,)
        Distances from the datasheet [sigma].
    covariance : ndarray, shape (open, open)
        Of the open numbers, from the Jacobian: what the logs and the datasheet's bounds tell.
    spread : ndarray, shape (open,)
        Standard deviation of the open numbers, see `spread` in `step`: what is told to the user.
    iterations : int
        Steps that were kept.

    """

    hypothesis: object
    chi2: np.ndarray
    samples: np.ndarray
    stray: np.ndarray
    covariance: np.ndarray
    spread: np.ndarray
    iterations: int

    @property
    def penalty(self):
        """Squared distances from the datasheet."""
        return float(self.stray @ self.stray)

    @property
    def cost(self):
        """chi^2 on the fit logs with the datasheet's penalty."""
        return float(self.chi2[:len(self.hypothesis.problem.fit)].sum() + self.penalty)

    @property
    def total(self):
        """chi^2 on all logs with the datasheet's penalty."""
        return float(self.chi2.sum() + self.penalty)


def fit(start, bench, iterations=6):
    """Fit a hypothesis to the fit logs, then judge it on all logs.

    Where a fit ends beyond the datasheet it goes on with slopes taken to both sides: along a flat
    valley, the curvature in a slope to one side outweighs what draws it home.

    Parameters
    ----------
    start : Hypothesis
        With values to start from.
    bench : Bench
        Whitening and free responses.
    iterations : int
        Most steps.

    """
    at, damping, kept, turned, wary = start, LIGHT, 0, False, False
    here = jacobian(at, bench)
    for _ in range(iterations):
        found = _improved(at, here, bench, damping, wary)
        if found is not None:
            at, damping, wary = found
            kept += 1
        after = jacobian(at, bench)
        ended = found is None or here.cost - after.cost < _little(after)
        if ended and (turned or at.stray() @ at.stray() < ASTRAY):
            break
        if ended:
            damping, turned = LIGHT, True
        here = central_jacobian(at, bench) if turned else after
    return _validated(at, bench, kept)


def _little(here):
    """Gain of a step that ends a fit."""
    return CONVERGED * len(here.residual) + 1e-4 * here.cost


def _improved(at, here, bench, damping, wary):
    """Step that improves: ``hypothesis, next damping, wary``; None if there is none worth it.

    If the first step fails, many more cautious ones are simulated side by side.  The next first
    step is likely to fail as well: a wary fit tries it among them, and no slopes are taken there.
    """
    if predicted_gain(at, here) < FUTILE * _little(here):
        return None
    first = damped_step(at, here, damping)
    if not wary and jacobian(first, bench).cost < here.cost:
        return first, max(damping / 10, LIGHT), False
    dampings = max(damping, DAMPING) * CAUTION
    proposals = [damped_step(at, here, more) for more in dampings]
    costs = _costs([first, *proposals] if wary else proposals, bench)
    if wary and costs[0] < here.cost:
        return first, max(damping / 10, LIGHT), False
    costs = costs[-len(proposals):]
    best = int(np.argmin(costs))
    return (proposals[best], dampings[best] / 10, True) if costs[best] < here.cost else None


def predicted_gain(at, here):
    """Gain that the slopes of a hypothesis promise, were its numbers free to take any step."""
    delta, (gram, right) = best_change(at.open, at, *here.normal, LIGHT), here.normal
    stray = [entry.stray(at.get(entry) + moved * entry.size)
             for entry, moved in zip(at.open, delta)]
    before = here.residual[len(here.residual) - len(at.open):]
    return -delta @ (2 * right + gram @ delta) + before @ before - np.dot(stray, stray)


def _costs(proposals, bench):
    """Cost of each of some variants of a hypothesis, simulated side by side."""
    at = proposals[0]
    costs = [proposal.stray() @ proposal.stray() for proposal in proposals]
    for j in range(len(at.problem.fit)):
        for part in bench.residuals(at.means(j, [each.values for each in proposals]), j):
            costs = costs + (part**2).sum(axis=1)
    return costs


def _validated(at, bench, kept):
    """Fit of a hypothesis as it stands."""
    here, n, logs = jacobian(at, bench), at.problem.n, len(at.problem.logs)
    held_out = [part[0] for j in range(len(at.problem.fit), logs)
                for part in bench.residuals(at.means(j, [at.values]), j)]
    parts = [*here.parts, *held_out]
    chi2 = np.reshape([part @ part for part in parts], (logs, n))
    samples = np.reshape([float(len(part)) for part in parts], (logs, n))
    covariance = np.linalg.pinv(here.columns.T @ here.columns, hermitian=True)
    scale = np.array([entry.size for entry in at.open])
    misfit = chi2.sum() / samples.sum()
    return Fit(at, chi2, samples, at.stray(), covariance * np.outer(scale, scale),
               standard_deviations(at.open, here.normal[0], misfit), kept)


def has_diverged(found):
    """Whether the model of a fit leaves every bound in one of the logs."""
    at = found.hypothesis
    return any(np.abs(at.error(j)).max() >= DIVERGED for j in range(len(at.problem.logs)))


def excess(fit, extra=0):
    """chi^2 beyond the noise per sample of one joint, with the price of the numbers."""
    samples = fit.samples.sum()
    numbers = sum(entry.tolerance is None for entry in fit.hypothesis.open) + extra
    beyond = fit.total + numbers * np.log(samples) - samples
    return beyond / (samples / fit.hypothesis.problem.n)
