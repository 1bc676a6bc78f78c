"""Effects of the catalogue that explain the commands of a joint down to their rounding.

The stated law with the effect in it, replayed on the logged signals, has to give every logged
command; a fault of the robot cannot be taken for one of the controller.  Effects with fewer
parameters come first, and those that explain the commands alike are one answer.
"""

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.controller.candidates import CANDIDATES, Candidate, Start
from clie_blocks.analysis.gap.controller.kernels import memory
from clie_blocks.analysis.gap.controller.replayed_joint import ReplayedJoint

LAX = 3.0  # times the limit, above which a piece of a log refutes an effect
ALIKE = 1.1  # times what the best leaves: the RMS of rounding scatters by less than a percent
NEAR = 0.5  # of what the law leaves: a start that was read from the log explains more
STEP = 1e-3  # of a parameter, for the slope of a state that stops and goes
FITS = 2  # of the starts, the best ones, from which a fit goes on
EVALUATIONS, SLOW_EVALUATIONS = 30, 8  # of a fit, at most; of one that runs sample by sample


@dataclasses.dataclass(frozen=True, eq=False)
class Found:
    """An effect that explains the commands of one joint.

    Parameters
    ----------
    candidate : Candidate
        The effect.
    values : dict of str to float
        Its free parameters.
    half : dict of str to float
        Change of each, the others following, that shows no more than rounding.
    left : float
        RMS that it leaves of the commands, in the log in which it leaves most [N m].

    """

    candidate: Candidate
    values: dict[str, float]
    half: dict[str, float]
    left: float

    @property
    def name(self) -> str:
        """The effect."""
        return self.candidate.name

    @property
    def is_of_recorder(self) -> bool:
        """Whether it says that the logged command is not the one that acted."""
        return self.candidate.effect.port == "log"

    def describe(self) -> str:
        """The effect with its parameters."""
        parts = ", ".join(f"{name.replace('_', ' ')} {value:.4g} {self.unit(name)}".removesuffix(
            " 1") for name, value in self.values.items())
        return f"{self.name.replace('_', ' ')} ({parts})"

    def unit(self, name: str) -> str:
        """Unit of a parameter."""
        return self.candidate.parameter(name).unit


@dataclasses.dataclass(frozen=True, eq=False)
class NamedJoint:
    """A joint whose commands an effect of the catalogue explains, or several of them alike.

    Parameters
    ----------
    joint : int
        The joint.
    found : tuple of Found
        What explains them, the best one first.
    also : tuple of str
        Effects that are the same thing for these logs, by other names.

    """

    joint: int
    found: tuple[Found, ...]
    also: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The effects."""
        return (*(one.name for one in self.found), *self.also)

    @property
    def is_of_recorder(self) -> bool:
        """Whether the log is what is wrong, as far as its signals show."""
        return self.found[0].is_of_recorder

    def describe(self, name: str) -> str:
        """What explains the commands of a joint, as a sentence."""
        if len(self.found) > 1 and any(one.is_of_recorder for one in self.found):
            either = " or ".join(one.describe() for one in self.found)
            return (f"{name}: every logged command is that of the stated law with {either}; the "
                    "motion does not tell which")
        effects = " or ".join((*(one.describe() for one in self.found),
                               *(also.replace("_", " ") for also in self.also)))
        wrong = ("the log is wrong" if self.is_of_recorder else
                 "the robot file is wrong, or somebody changed the controller")
        return f"{name}: every logged command is that of the stated law with {effects}; {wrong}"


def explanations(joint: ReplayedJoint) -> list[Found]:
    """Effects with the fewest parameters that explain the commands alike, the best one first."""
    if not joint.limit:
        return []
    piece = joint.piece()
    for _, same in itertools.groupby(CANDIDATES, lambda one: len(one.free)):
        fits = [_explanation(one, joint, piece) for one in same]
        found = [fit for fit in fits if fit is not None]
        if found:
            return _alike(found)
    return []


def _alike(found: Sequence[Found]) -> list[Found]:
    """The best explanation, and the others that leave hardly more; each effect once."""
    ordered = sorted(found, key=lambda one: one.left)
    best: dict[str, Found] = {}
    for one in ordered:
        best.setdefault(one.name, one)
    return [one for one in best.values() if one.left <= ALIKE * ordered[0].left]


def _explanation(candidate: Candidate, joint: ReplayedJoint, piece: ReplayedJoint) -> Found | None:
    """An effect where it explains all commands of a joint; a piece of a log refutes most."""
    part = joint if candidate.whole else piece
    starts = [_with_amplitudes(candidate, start, part) for start in candidate.starts(part)]
    tried = sorted(((_rms(candidate, start, part), start) for start in starts),
                   key=lambda pair: pair[0])
    if not tried or np.isinf(tried[0][0]):
        return None
    if candidate.near and tried[0][0] > NEAR * part.rms_left():
        return None
    best = min((refined(candidate, start, part) for _, start in tried[:FITS]),
               key=lambda found: found.left)
    if best.left > LAX * joint.limit or (candidate.whole and _is_idle(best)):
        return None  # what is idle in a piece of a log may still show in all of it
    found = best if candidate.whole else refined(candidate, best.values, joint)
    return None if found.left > joint.limit or _is_idle(found) else found


def refined(candidate: Candidate, start: Start, joint: ReplayedJoint) -> Found:
    """An effect fitted to all commands of a joint, from near where it is."""
    values, half = _fitted(candidate, start, joint)
    return Found(candidate, values, half, _rms(candidate, values, joint))


def _is_idle(found: Found) -> bool:
    """Whether a parameter may as well have its neutral value: one with fewer then says it all."""
    neutral = {name: found.candidate.parameter(name).neutral for name in found.values}
    return any(rest is not None and abs(found.values[name] - rest) <= found.half[name]
               for name, rest in neutral.items())


def _with_amplitudes(candidate: Candidate, start: Start, joint: ReplayedJoint) -> Start:
    """Start whose linear parameters, zero so far, leave least of the commands."""
    if not candidate.linear:
        return start
    wait = memory(candidate.effect, candidate.values(start), joint.period)

    def residual(values: Start) -> np.ndarray:
        return np.concatenate(joint.residuals(candidate.effect, candidate.values(values),
                                              candidate.fresh, wait))

    left, scale = residual(start), joint.limit
    columns = np.stack([left - residual({**start, name: scale}) for name in candidate.linear], 1)
    found = np.linalg.lstsq(columns, left, rcond=None)[0] * scale
    return {**start, **dict(zip(candidate.linear, map(float, found)))}


def _rms(candidate: Candidate, values: Start, joint: ReplayedJoint) -> float:
    """RMS in the log in which most is left."""
    parts = joint.residuals(candidate.effect, candidate.values(values), candidate.fresh)
    return max((float(np.sqrt(np.mean(part**2))) for part in parts if part.size), default=np.inf)


def _fitted(candidate: Candidate, start: Start, joint: ReplayedJoint) -> tuple[Start, Start]:
    """Values near a start that leave least, and the half width of what shows no more."""
    from scipy.optimize import least_squares

    effect, parameters = candidate.effect, [candidate.parameter(name) for name in start]
    lower, upper = (np.array([getattr(p, side) for p in parameters])
                    for side in ("lower", "upper"))
    guess = np.clip(list(start.values()), lower, upper)
    wait = memory(effect, candidate.values(start), joint.period)

    def error(point: np.ndarray) -> np.ndarray:
        values = candidate.values(dict(zip(start, map(float, point))))
        return np.concatenate(joint.residuals(effect, values, candidate.fresh, wait)) / joint.limit

    fit = least_squares(error, guess, bounds=(lower, upper),
                        max_nfev=SLOW_EVALUATIONS if candidate.whole else EVALUATIONS,
                        diff_step=STEP if candidate.whole else None,
                        x_scale=np.maximum(np.abs(guess), [p.typical or 1.0 for p in parameters]))
    information = fit.jac.T @ fit.jac / len(fit.fun)
    half = np.sqrt(np.diag(np.linalg.pinv(information)))
    return dict(zip(start, map(float, fit.x))), dict(zip(start, map(float, half)))
