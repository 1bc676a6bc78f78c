"""What a command contains beyond the stated law: terms that are known by name, or just what it is.

A law as it is stated may lack a term.  Those that controllers commonly have are linear in known
signals, and count where they explain the command down to its rounding.  Whatever a term is, the
command was recorded, so that a model can follow it: with the residual of the law on the measured
positions as excitation, the model gets the recorded command plus the law's feedback on its error.
Its prediction error is then the same filter of missing torques and of sensor noise as before.
"""

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.gap.controller.law_residual import known_samples
from clie_blocks.analysis.gap.problem.law import StatedLaw
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.robot_loop.links import gravity_torque

WEIGHT = "share of the weight of the links"
UNITS = {"Kp": "N m/rad", "Kd": "N m s/rad", "reference velocity": "N m s/rad",
         "reference acceleration": "N m s^2/rad", "integral part": "N m/(rad s)",
         "constant": "N m", WEIGHT: "1"}
REMEDY = 'state compensation = "gravity" in [controller]'  # of a weight that no one stated
NAMES = {"reference velocity": "control_law_form", "integral part": "hidden_integral"}
MOST_TERMS = 2  # beyond gains: more explain a command by their number
RATES = ("filtered", "direct", "difference")  # ways to form the velocity of the reference
SAME_GAIN = 0.02  # of Kd: a gain on the reference velocity that is Kd
CLOSE = 3.0  # times the limit: what a part of the samples leaves where a weight explains them
FEW = 20  # samples of which one is in that part
RANK = 1e-10  # of the largest singular value: below it, numbers of links do not show in a weight
AT_LIMIT = 1.0 - 1e-9  # of the limit of a command


@dataclasses.dataclass(frozen=True)
class Terms:
    """Terms that explain a joint's command to its rounding, with their coefficients.

    Parameters
    ----------
    joint : int
        The joint.
    coefficients : dict
        Term of `UNITS` -> coefficient.
    kd : float
        Gain on the velocity [N m s/rad].

    """

    joint: int
    coefficients: dict[str, float]
    kd: float = 0.0

    @property
    def is_velocity_error(self) -> bool:
        """Whether the gain Kd acts on the error of the velocity, and not on the velocity."""
        gain = self.coefficients.get("reference velocity", 0.0)
        return abs(gain - self.kd) < SAME_GAIN * self.kd

    @property
    def effect(self) -> str | None:
        """Effect of the catalogue that a single term is; None for what the catalogue lacks."""
        term, *others = self.coefficients
        is_form = term == "reference velocity"  # Kd on the whole error is a matter of the file
        is_named = not others and not (is_form and (self.is_velocity_error or self.kd <= 0.0))
        return NAMES.get(term) if is_named else None

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters of that effect."""
        gain = next(iter(self.coefficients.values()))
        return {"share": gain / self.kd} if self.effect == "control_law_form" else {"ki": gain}

    def describe(self, name: str) -> str:
        """The terms as a sentence."""
        parts = ", ".join(f"{term} {value:.4g} {UNITS[term]}".removesuffix(" 1")
                          for term, value in self.coefficients.items())
        error = ": Kd acts on dqd - dq" if self.is_velocity_error else ""
        remedy = f"; {REMEDY}" if list(self.coefficients) == [WEIGHT] else ""
        return (f"{name}: the command contains what the stated law does not have ({parts}{error})"
                f"; the robot file is wrong, or somebody changed the controller{remedy}")


def find_terms(problem: Problem, law: StatedLaw, limit: np.ndarray, joints: Sequence[int],
               ) -> tuple[Terms, ...]:
    """Fewest terms that explain the commands of some joints to their rounding `limit` [N m].

    Joints whose commands none of them explains are left out.
    """
    weights = _weights(problem, joints)
    found = (_terms_of(problem, law, weights, float(limit[k]), k) for k in joints)
    return tuple(terms for terms in found if terms is not None)


def find_weights(problem: Problem, law: StatedLaw, limit: np.ndarray, joints: Sequence[int],
                 carried: float) -> tuple[Terms, ...]:
    """Weights of links that explain the commands of some joints to their rounding `limit` [N m].

    They are those of links with any numbers; of the stated weight, the law carries a share.
    """
    weights = _weights(problem, joints)
    found = (_other_weight(problem, law, weights, k, float(limit[k]), carried) for k in joints)
    return tuple(terms for terms in found if terms is not None)


def with_recorded_commands(problem: Problem, joints: Sequence[int]) -> Problem:
    """Problem whose models follow the recorded commands of some joints."""
    law, at = problem.stated_law, list(joints)

    def following(log: Log) -> Log:
        beyond = np.zeros_like(log.pe)
        beyond[:, at] = command_beyond_law(law, log)[:, at]
        return log.following(beyond)

    return problem.with_logs(following)


def with_unknown_law(problem: Problem) -> Problem:
    """Problem of a machine that is driven by its recorded commands, under no law."""
    law = problem.stated_law.pd
    zero = np.zeros(problem.n)
    open_loop = dataclasses.replace(law, kp=zero, kd=zero, saturation=zero + np.inf)
    driven = problem.with_logs(lambda log: log.following(log.u - log.pe))
    return dataclasses.replace(driven, law=open_loop)


def command_beyond_law(law: StatedLaw, log: Log) -> np.ndarray:
    """Logged command less that of the law without limits, (N, n) [N m]; 0 where both meet one."""
    free = dataclasses.replace(law, saturation=np.full_like(law.saturation, np.inf))
    unlimited = free.commands(log)
    limited = np.clip(unlimited, -law.saturation, law.saturation)
    both = (np.abs(log.u) >= AT_LIMIT * law.saturation) & (limited == np.clip(
        log.u, -law.saturation, law.saturation))
    return np.where(both, 0.0, log.u - unlimited)


def _terms_of(problem: Problem, law: StatedLaw, weights: Sequence[np.ndarray], limit: float,
              k: int) -> Terms | None:
    gains = ((), ("Kp", "Kd"))
    for count, beside in itertools.product(range(1, MOST_TERMS + 1), gains):
        for variant in RATES:
            for names in itertools.combinations(tuple(UNITS)[2:], count):
                terms = _fitted(problem, law, weights, k, (*beside, *names), variant, limit)
                if terms is not None:
                    return terms
    return _other_weight(problem, law, weights, k, limit)


def _other_weight(problem: Problem, law: StatedLaw, weights: Sequence[np.ndarray], k: int,
                  limit: float, carried: float = 0.0) -> Terms | None:
    """Weight of links with other numbers than the stated ones; its changes beside theirs.

    Of the stated weight, the law already carries a share.  Only changes within a log count: what
    an integral held when it began is not known.
    """
    if not any(weight[:, k].any() for weight in weights):
        return None
    for few, most in ((FEW, CLOSE * limit), (1, limit)):
        parts = []
        for log, weight in zip(problem.logs, weights):
            rows = np.flatnonzero(_usable(log, law, k))[::few]
            parts.append(_changes(np.column_stack((
                _weight_columns(problem, log.q[rows], k), weight[rows, k],
                command_beyond_law(law, log)[rows, k]))))
        every = np.concatenate(parts)
        if not len(every):
            return None
        columns, stated, beyond = every[:, :-2], every[:, -2], every[:, -1]
        values = np.linalg.lstsq(columns, beyond, rcond=RANK)[0]
        if max(np.sqrt(np.mean((part[:, -1] - part[:, :-2] @ values) ** 2))
               for part in parts if len(part)) > most:
            return None
    if not stated.any():
        return None
    share = float(stated @ columns @ values / (stated @ stated))
    return Terms(k, {WEIGHT: carried + share}, float(law.kd[k]))


def _changes(x: np.ndarray) -> np.ndarray:
    """Columns less their means; none of no rows."""
    return x - x.mean(axis=0) if len(x) else x


def _weights(problem: Problem, joints: Sequence[int]) -> list[np.ndarray]:
    """Weight of the stated links along each log, on the side of the command (N, n) [N m].

    Zeros where no links are stated; not computed where no joint asks for it.
    """
    logs = problem.logs if joints else ()
    if not problem.links.known:
        return [np.zeros_like(log.q) for log in logs]
    return [gravity_torque(problem.links, log.q) / problem.gear_ratio for log in logs]


def _weight_columns(problem: Problem, q: np.ndarray, k: int) -> np.ndarray:
    """Weight at joint k of each link of 1 kg, and of 1 kg at 1 m along each axis of its frame."""
    links, columns = problem.links, []
    for j, place in itertools.product(range(problem.n), np.vstack([np.zeros(3), np.eye(3)])):
        com = np.zeros((problem.n, 3))
        com[j] = place
        unit = dataclasses.replace(links, mass=np.eye(problem.n)[j], com=com)
        columns.append(gravity_torque(unit, q)[:, k] / problem.gear_ratio[k])
    return np.stack(columns, axis=1)


def _fitted(problem: Problem, law: StatedLaw, weights: Sequence[np.ndarray], k: int,
            names: Sequence[str], variant: str,
            limit: float) -> Terms | None:
    """Coefficients of some terms, where they leave no more than rounding in any log."""
    parts = [_regression(log, weight, law, k, names, variant)
             for log, weight in zip(problem.logs, weights)]
    columns, beyond = (np.concatenate(side) for side in zip(*parts))
    scale = np.sqrt(np.mean(columns**2, axis=0))
    if not np.all(scale > 0.0):
        return None
    scaled = np.linalg.lstsq(columns / scale, beyond, rcond=None)[0] / scale
    left = [np.sqrt(np.mean((part - column @ scaled) ** 2)) for column, part in parts]
    if max(left) > limit:
        return None
    stated = {"Kp": law.kp[k], "Kd": law.kd[k]}
    coefficients = {name: float(value + stated.get(name, 0.0))
                    for name, value in zip(names, scaled)}
    return Terms(k, coefficients, coefficients.get("Kd", float(law.kd[k])))


def _regression(log: Log, weight: np.ndarray, law: StatedLaw, k: int, names: Sequence[str],
                variant: str) -> tuple[np.ndarray, np.ndarray]:
    """Terms as columns, and the command beyond the law, where filters are known."""
    usable = _usable(log, law, k)
    columns = np.stack([_column(log, weight, law, k, name, variant) for name in names], axis=1)
    return columns[usable], command_beyond_law(law, log)[usable, k]


def _usable(log: Log, law: StatedLaw, k: int) -> np.ndarray:
    """Samples in which the filters of a law are known and its command is within its limit."""
    return known_samples(log, law) & (np.abs(log.u[:, k]) < AT_LIMIT * law.saturation[k])


def _column(log: Log, weight: np.ndarray, law: StatedLaw, k: int, name: str,
            variant: str) -> np.ndarray:
    error, period = log.q_d[:, k] - log.q[:, k], law.period
    if name == "Kp":
        return error
    if name == "Kd":
        return -law.rate(log.q)[:, k]
    if name == "constant":
        return np.ones(len(log))
    if name == WEIGHT:
        return weight[:, k]
    if name == "integral part":
        return period * np.cumsum(error)
    rate = _reference_rate(log, law, k, variant)
    return rate if name == "reference velocity" else np.gradient(rate, period)


def _reference_rate(log: Log, law: StatedLaw, k: int, variant: str) -> np.ndarray:
    """Velocity of the reference: as that of the position, as it is, or as a difference."""
    reference = log.q_d[:, k]
    if variant == "filtered":
        return law.rate(log.q_d)[:, k]
    if variant == "direct":
        return np.gradient(reference, law.period)
    return np.diff(reference, prepend=reference[0]) / law.period
