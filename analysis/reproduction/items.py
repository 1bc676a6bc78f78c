"""The paper's values against ours, each with a verdict that follows from the difference alone."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks import paper
from clie_blocks.analysis.reproduction.runs import (
    READINGS,
    estimates,
    excitation_levels,
    signed_mean_error,
    tracking_mse,
)
from clie_blocks.analysis.theory.bounds import (
    ControlledJoints,
    disturbance_norm,
    theorem_2,
    theorem_4,
    ultimate_bound,
)
from clie_blocks.excitation import paper_excitation

REPRODUCED = "reproduced"
UNSTATED = "only under an unstated reading"
ERRATUM = "printed value contradicts its definition"
MISSED = "not reproduced"
PICTURE = "no number printed"
ROW_TOLERANCE = 4e-4  # all six entries of a row of Table 2


@dataclass(frozen=True)
class Item:
    """One printed value, or row of values, and ours.

    Parameters
    ----------
    place, name : str
        Where it stands and what it is.
    printed : tuple of float
        As printed; empty where only a picture is.
    ours : tuple of float
        As computed; the mean over seeds.
    tolerance : float
        Half a unit of the last printed digit, or what `reading` states.
    reading : str
        What was assumed.
    literal : bool
        Whether the paper states this reading.
    erratum : str
        Key of the erratum that explains a difference.
    spread : tuple of float
        Standard deviation over the seeds, if there are several.

    """

    place: str
    name: str
    printed: tuple[float, ...]
    ours: tuple[float, ...]
    tolerance: float
    reading: str = "as defined"
    literal: bool = True
    erratum: str = ""
    spread: tuple[float, ...] = ()

    @property
    def difference(self) -> tuple[float, ...]:
        """Ours minus printed, entry by entry."""
        return tuple(o - p for o, p in zip(self.ours, self.printed))

    @property
    def verdict(self) -> str:
        """One of the five verdicts, from the difference."""
        if not self.printed:
            return PICTURE
        if max(map(abs, self.difference)) <= self.tolerance:
            return REPRODUCED if self.literal else UNSTATED
        return ERRATUM if self.erratum else MISSED

    def as_dict(self) -> dict[str, Any]:
        """Return the item for JSON."""
        return {**self.__dict__, "difference": self.difference, "verdict": self.verdict}


def bound_items() -> list[Item]:
    """mu_0, the norm of eta and the constants of Theorems 2 and 4."""
    joints = ControlledJoints.from_theta(paper.THETA, paper.KP, paper.KD)
    items = [_item("section 5.1", "||eta||", paper.ETA_NORM,
                   disturbance_norm(joints, paper_excitation)[0], 2e-4,
                   reading="largest norm over time; tolerance: rounding of Table 2")]
    for gains, mu_0 in paper.MU_0.items():
        other = ControlledJoints.from_theta(paper.THETA, *gains)
        items.append(_item("(18)", f"mu_0 at Kp, Kd = {gains[0]:g}, {gains[1]:g}", mu_0,
                           ultimate_bound(other, paper.ETA_NORM).mu_0, 5e-5))
    second = theorem_2(joints, paper.EPS_NORM[1])
    items += [_item("Theorem 2", "k_1", paper.K_1_PRINTED, second.k_1, 5e-3, erratum="k_1"),
              _item("Theorem 2", "k_1", paper.K_1_PRINTED, second.k_1_printed, 5e-3,
                    reading="K_bar without its -I", literal=False),
              _item("Theorem 2", "k_2", paper.K_2, second.k_2, 0.5),
              _item("(31)", "sqrt(2) k_2 eps_bar", paper.BOUND_31, second.threshold, 5e-7)]
    for case, bound in paper.BOUND_46.items():
        fourth = theorem_4(joints, paper.ALPHA[case], paper.EPS_NORM[case])
        items += [_item("Theorem 4", f"k_3, CASE {case}", paper.K_3_PRINTED, fourth.k_3, 5e-3,
                        erratum="k_3"),
                  _item("Theorem 4", f"k_4, CASE {case}", paper.K_4, fourth.k_4, 0.5),
                  _item("(46)", f"right side, CASE {case}", bound, fourth.threshold, 5e-7)]
    return items


def table_2_items(seeds: Sequence[int], advance: Callable[[float], None] = lambda runs: None,
                  ) -> list[Item]:
    """The rows of Table 2, one per case and reading, over seeds where a reading has noise.

    `advance` is called after each reading with the number of runs done.
    """
    items = []
    for case, printed in paper.THETA_HAT.items():
        for reading in READINGS:
            used = seeds if reading.noisy else seeds[:1]
            rows = estimates(reading, case, used)
            items.append(_item(
                "Table 2", f"CASE {case}", printed, np.mean(rows, axis=0), ROW_TOLERANCE,
                reading=reading.name, literal=reading.literal,
                spread=np.std(rows, axis=0, ddof=1) if len(used) > 1 else ()))
            advance(len(used))
    return items


def table_3_items() -> list[Item]:
    """Tracking errors and mean estimation errors of Table 3, joint by joint."""
    items = []
    for case, follows in paper.TRACKING_MSE.items():
        plus, minus = tracking_mse(case), tracking_mse(case, printed_sign=True)
        for k, printed in enumerate(paper.TRACKING_MSE_PRINTED[case]):
            name = f"mean squared error, joint {k + 1}, CASE {case}"
            items += [
                _item("Table 3", name, printed, plus[k], 5e-11, reading="+D_hat in (50)",
                      erratum="tracking_exponent"),
                _item("Table 3", f"{name}, exponent e-4", follows[k], minus[k], 5e-8,
                      reading="-D_hat in (50), as printed", erratum="sign_in_50"),
                _item("Table 3", f"{name}, exponent e-4", follows[k], plus[k], 5e-8,
                      reading="+D_hat in (50), from rest at zero, start included, no noise",
                      literal=False)]
        items.append(_item("Table 3", f"mean of eps, CASE {case}", paper.EPS_MEAN[case],
                           signed_mean_error(case), 5e-8,
                           reading="matched plant, estimates of Table 2 frozen"))
    return items


def figure_3_items() -> list[Item]:
    """The peaks of Fig. 3, and the smallest eigenvalue that it does not show."""
    with_pe, without = excitation_levels()[0], excitation_levels(0.0)[0]
    return [Item("Fig. 3", f"(49) and smallest eigenvalue of (28), {start:g}-{end:g} s", (),
                 (one.weighted, one.smallest, other.weighted, other.smallest), 0.0,
                 reading="with the excitation (48), then without any", literal=True)
            for (start, end), one, other in zip(paper.WINDOWS, with_pe, without)]


def _item(place: str, name: str, printed: ArrayLike, ours: ArrayLike, tolerance: float,
          spread: ArrayLike = (), **options: Any) -> Item:
    printed, ours, spread = (tuple(map(float, np.atleast_1d(value)))
                             for value in (printed, ours, spread))
    return Item(place, name, printed, ours, tolerance, spread=spread, **options)
