"""From excess to odds: the thresholds of the verdict that are, in part, learned."""

import dataclasses
import json
from pathlib import Path
from typing import TypeVar

import numpy as np

from clie_blocks.analysis.gap.method.threshold import threshold
from clie_blocks.errors import ClieError

SCHEMA_VERSION = 5  # of method.json
STORED = Path(__file__).with_name("method.json")

Excess = TypeVar("Excess", float, np.ndarray)


@dataclasses.dataclass(frozen=True)
class Calibration:
    """What turns excess into odds; the values that are learned stand in ``method.json``."""

    sharpness: float = threshold(6.0, "nats", "per factor e of excess")
    floor: float = threshold(0.05, "excess per sample", "a right model may leave this much")
    misfit: float = threshold(
        0.0002, "share of the whole excess",
        "a right model may leave this much: strong effects change the motion in ways that no "
        "kernel matches to the last digit")
    parameter_cost: float = threshold(1.0, "nats", "cost of one parameter of a hypothesis")
    cause_cost: float = threshold(
        3.0, "nats",
        "cost of each further cause: a real joint holds some three of sixty names, so that the "
        "odds of any one beside others are one to twenty; it is not learned from how often trials "
        "hold several")
    fair_share: float = threshold(
        0.0025, "share of the whole excess",
        "a further cause that removes less pays `shortfall_cost` for what it falls short: the "
        "excess is a square, and a twentieth of the gap is worth a name")
    shortfall_cost: float = threshold(
        4.0, "nats",
        "cost per factor e that a further cause falls short of `fair_share`")
    futile_odds: float = threshold(
        100.0, "odds", "against a hypothesis that is not worth its fit")
    healthy: float = threshold(
        0.5, "excess per sample",
        "a robot or a model that leaves less has no gap to explain: no cause is searched, no fit "
        "is extended or started again, no difference counts")
    unexplained_share: float = threshold(
        0.2, "share of the whole excess",
        "an unknown effect would leave this much")
    unexplained_least: float = threshold(
        2.0, "excess per sample",
        "least excess that counts as unexplained")
    free_torque_cost: float = threshold(
        8.0, "nats",
        "cost of a free torque of pose, speed and load, as an unknown effect has")
    free_torque_slack: float = threshold(
        0.03, "share of the whole excess",
        "a free torque may explain this much of what a right cause leaves: a real machine holds "
        "more than its main cause")
    free_torque_share: float = threshold(
        0.5, "share of what a hypothesis leaves",
        "a free torque that leaves more says nothing of an unknown effect")
    pose_torque_share: float = threshold(
        0.0025, "share of the whole excess",
        "least that a soft stop leaves where torques of the pose take its place: one that "
        "begins in the middle of the travel leaves 0.012 with a sine, and 0.0025 with a "
        "sine and a spring")
    confounder_cost: float = threshold(
        2.0, "nats",
        "cost of a hypothesis with a confounder outside the library, against that confounder")
    parametric_cost: float = threshold(
        1.0, "nats",
        "cost of a joint model outside its datasheet, against an effect that explains it")
    wrong_number_cost: float = threshold(
        2.0, "nats",
        "cost of a wrong number of the robot file, against an effect that explains as much: of "
        "about seven numbers the one that does best is taken")
    prior_violation_cost: float = threshold(
        4.0, "nats",
        "cost of parameters beyond the datasheet, for a hypothesis that does not speak of them")
    contamination: float = threshold(
        0.05, "probability", "that the model of the evidence is wrong")
    contamination_bluntness: float = threshold(
        5.0, "factor",
        "the odds are this much less sharp where the model of the evidence is wrong")
    leader_uncertainty: float = threshold(
        0.2, "probability",
        "the leading cause gives this much to the others where even the best leaves much")

    def score(self, excess: Excess, nominal_excess: float) -> Excess:
        """Logarithm of the odds of a hypothesis by what it leaves, but for a constant [nats].

        What is left of the excess of the nominal model is misfit rather than noise, so the odds
        go with its logarithm, above what a right model may leave.
        """
        tolerated = self.floor + self.misfit * max(nominal_excess, 0.0)
        return -self.sharpness * np.log(np.maximum(excess, 0.0) + tolerated)

    def shortfall(self, gain: float) -> float:
        """Cost of a further cause for the share of the whole excess that it removes [nats]."""
        removed = min(max(gain, 1e-6), self.fair_share)
        return self.shortfall_cost * np.log(self.fair_share / removed)

    def gained_in_health(self, excess: float, fewer: float, nominal_excess: float) -> float:
        """Part of what a further cause gains that a healthy robot leaves, too: no gap [nats].

        `fewer` is what the causes leave without it.
        """
        blunt = dataclasses.replace(self, floor=max(self.floor, self.healthy))
        whole, beyond = (one.score(excess, nominal_excess) - one.score(fewer, nominal_excess)
                         for one in (self, blunt))
        return max(float(whole - beyond), 0.0)

    def score_of_none(self, nominal_excess: float, violation: float = 0.0, violations: int = 0,
                      ) -> float:
        """Score of no cause at all: of what a nominal model leaves beyond a healthy robot.

        `violation` is the part of it beyond the datasheet, that of so many parameters.
        """
        left = max(nominal_excess - violation - self.healthy, 0.0) + violation
        return self.score(left, nominal_excess) - self.prior_violation_cost * bool(violations)

    def cannot_pay_off(self, excess: float, nominal_excess: float) -> bool:
        """Whether no further cause could outweigh its cost, however little it would leave.

        `excess` is that of the best hypothesis, `nominal_excess` that of the nominal model.
        """
        gain = self.score(0.0, nominal_excess) - self.score(excess, nominal_excess)
        share = excess / max(nominal_excess, excess, self.floor)
        cost = (self.shortfall(share) + self.cause_cost + self.parameter_cost
                + self.gained_in_health(0.0, excess, nominal_excess))
        return bool(gain < cost - np.log(self.futile_odds))


    def cannot_lead(self, excess: float, nominal_excess: float) -> bool:
        """Whether two causes cannot be likelier than none, however little they would leave.

        `excess` is that of the best hypothesis; the nominal model keeps to the datasheet.
        """
        score = (self.score(0.0, nominal_excess) - 2.0 * self.parameter_cost - self.cause_cost
                 - self.gained_in_health(0.0, excess, nominal_excess))
        return bool(score < self.score_of_none(nominal_excess) - np.log(self.futile_odds))


def load_calibration(path: Path = STORED) -> Calibration:
    """Return the calibration that is stored with the package, or in another file.

    Raises
    ------
    ClieError
        If the file is of another schema, whose values mean something else.

    """
    if not path.is_file():
        return Calibration()
    stored = json.loads(path.read_text())
    if stored["schema_version"] != SCHEMA_VERSION:
        raise ClieError(f"{path} is of schema {stored['schema_version']}, this verdict reads "
                        f"schema {SCHEMA_VERSION}: python -m "
                        "clie_blocks.analysis.gap.calibration.learn")
    return Calibration(**stored["values"])
