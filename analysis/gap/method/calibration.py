"""From excess to odds: the parameters of the verdict, some of them learned."""

import dataclasses
import json
from pathlib import Path

import numpy as np

from clie_blocks.analysis.gap.method.threshold import threshold
from clie_blocks.errors import ClieError

SCHEMA_VERSION = 4  # of method.json
STORED = Path(__file__).with_name("method.json")
RARE = 100.0  # odds against a hypothesis that is not worth its fit


@dataclasses.dataclass(frozen=True)
class Calibration:
    """Parameters that turn excess into odds; what is learned of them stands in ``method.json``."""

    sharpness: float = threshold(6.0, "nats", "per factor e of excess")
    floor: float = threshold(0.05, "excess per sample", "a right model may leave this much")
    misfit: float = threshold(
        0.0002, "share of the whole excess",
        "a right model may leave this much: strong effects change the motion in ways that no "
        "kernel matches to the last digit")
    price: float = threshold(1.0, "nats", "cost of one parameter of a hypothesis")
    second: float = threshold(
        4.0, "nats",
        "cost of each further cause: one pair of two dozen causes is a priori rarer than one "
        "cause alone by about this; it is not learned from how often trials hold pairs")
    share: float = threshold(
        0.01, "share of the whole excess",
        "a further cause that removes less pays `slight` for what it falls short")
    slight: float = threshold(
        4.0, "nats",
        "cost per factor e that a further cause falls short of `share`")
    healthy: float = threshold(0.5, "excess per sample", "a healthy robot may have this much")
    unexplained_share: float = threshold(
        0.2, "share of the whole excess",
        "an unknown effect would leave this much")
    unexplained_least: float = threshold(
        2.0, "excess per sample",
        "least excess that counts as unexplained")
    structure: float = threshold(
        8.0, "nats",
        "cost of a free torque of pose, speed and load, as an unknown effect has")
    slack: float = threshold(
        0.03, "share of the whole excess",
        "a free torque may explain this much beside a right cause: a real machine holds more "
        "than its main cause")
    alike: float = threshold(
        0.0025, "share of the whole excess",
        "least that a soft stop leaves where torques of the pose take its place: one that "
        "begins in the middle of the travel leaves 0.012 beside a sine, and 0.0025 beside a "
        "sine and a spring")
    foreign: float = threshold(
        2.0, "nats",
        "cost of a hypothesis with a confounder outside the library, against that confounder")
    parametric: float = threshold(
        1.0, "nats",
        "cost of a joint model outside its datasheet, against an effect that explains it")
    beyond: float = threshold(
        4.0, "nats",
        "cost of parameters beyond the datasheet, for a hypothesis that does not speak of them")
    lapse: float = threshold(
        0.05, "probability",
        "the model of the evidence is wrong (contamination)")
    blunt: float = threshold(
        5.0, "factor",
        "the odds are this much less sharp where the model of the evidence is wrong")
    doubt: float = threshold(
        0.2, "probability",
        "the leading cause gives this much to the others where even the best leaves much")

    def small_gain_cost(self, gained: float) -> float:
        """Cost of a further cause for the share of the whole excess that it removes [nats]."""
        return self.slight * np.log(self.share / min(max(gained, 1e-6), self.share))

    def cannot_pay_off(self, left: float, nothing: float) -> bool:
        """Whether no further cause could outweigh its cost, however little it would leave.

        `left` is the excess of the best hypothesis, `nothing` that of the refitted nominal model.
        """
        tolerated = self.floor + self.misfit * max(nothing, 0.0)
        gain = self.sharpness * np.log1p(max(left, 0.0) / tolerated)
        share = left / max(nothing, left, self.floor)
        return gain < self.small_gain_cost(share) + self.second + self.price - np.log(RARE)


def load_calibration(path: Path = STORED) -> Calibration:
    """Return the calibration that is stored with the package, or in another file.

    Raises
    ------
    ClieError
        If the file is of another schema, whose parameters mean something else.

    """
    if not path.is_file():
        return Calibration()
    stored = json.loads(path.read_text())
    if stored["schema_version"] != SCHEMA_VERSION:
        raise ClieError(f"{path} is of schema {stored['schema_version']}, this verdict reads "
                        f"schema {SCHEMA_VERSION}: python -m "
                        "clie_blocks.analysis.gap.calibration.learn")
    return Calibration(**stored["numbers"])
