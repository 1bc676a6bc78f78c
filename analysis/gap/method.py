"""From fitted hypotheses to probabilities, sets and one verdict.

Each hypothesis is judged by the excess of its chi^2 over the noise, relative to the samples of one
joint.  A true cause leaves next to nothing; what it does leave is misfit, not noise, so the odds
follow the logarithm of the excess rather than chi^2 itself.  `none` wins where the refitted
nominal model leaves little, `unknown` where nothing in the library removes most of the excess, or
where a free torque of pose, speed and load removes much of what the best hypothesis leaves, or
the likeliest.
"""

import dataclasses
import json
from pathlib import Path

import numpy as np

from clie_blocks.errors import ClieError

SCHEMA_VERSION = 4  # of method.json
STORED = Path(__file__).with_name("method.json")
RARE = 100.0  # odds against a hypothesis that is not worth its fit


@dataclasses.dataclass(frozen=True)
class Calibration:
    """Numbers that turn excess into odds; learned by `calibrate`.

    Parameters
    ----------
    sharpness : float
        Nats per factor e of excess.
    floor : float
        Excess per sample that a right model may leave.
    misfit : float
        Share of the whole excess that a right model may leave: strong effects bend the motion in
        ways that no kernel matches to the last digit.
    price : float
        Nats per number of a hypothesis.
    second : float
        Nats that each further cause costs: one pair of two dozen causes is rarer, a priori, than
        one cause alone by about this; it is not learned from how often trials hold pairs.
    share, slight : float
        A further cause that removes less than this share of the whole excess costs `slight` nats
        per factor e that it falls short.
    healthy : float
        Excess per sample that a healthy robot may have.
    unexplained_share : float
        Share of the excess that something unknown would leave.
    unexplained_least : float
        Least excess per sample that counts as unexplained.
    structure : float
        Nats that a free torque of pose, speed and load costs, as what something unknown does.
    slack : float
        Share of the whole excess that a free torque may explain beside a right cause: a real
        machine holds more than its main cause.
    alike : float
        Share of the whole excess that a soft stop leaves, at least, where torques of the pose
        take its place: one that begins in the middle of the travel leaves 0.012 beside a sine,
        and 0.0025 beside a sine and a spring.
    foreign : float
        Nats that a hypothesis with a foreign rival costs against that rival, see `rivals`.
    parametric : float
        Nats that a joint model outside its datasheet costs, against an effect that explains it.
    beyond : float
        Nats that numbers beyond the datasheet cost a hypothesis that does not speak of them.
    lapse : float
        Share of robots on which the odds are not to be trusted, for what nobody thought of.
    blunt : float
        How many times less sharp the odds are on these.
    doubt : float
        Probability that the leading cause gives to the others where even the best leaves much.

    """

    sharpness: float = 6.0
    floor: float = 0.05
    misfit: float = 2e-4
    price: float = 1.0
    second: float = 4.0
    share: float = 0.01
    slight: float = 4.0
    healthy: float = 0.5
    unexplained_share: float = 0.2
    unexplained_least: float = 2.0
    structure: float = 8.0
    slack: float = 0.03
    alike: float = 0.0025
    foreign: float = 2.0
    parametric: float = 1.0
    beyond: float = 4.0
    lapse: float = 0.05
    blunt: float = 5.0
    doubt: float = 0.2


def load_calibration(path=STORED):
    """Return the calibration that is stored with the package, or in another file.

    Raises
    ------
    ClieError
        If the file is of another schema, whose numbers mean something else.

    """
    if not path.is_file():
        return Calibration()
    kept = json.loads(path.read_text())
    if kept["schema_version"] != SCHEMA_VERSION:
        raise ClieError(f"{path} is of schema {kept['schema_version']}, this verdict reads schema "
                        f"{SCHEMA_VERSION}: python -m clie_blocks.analysis.gap.calibration.learn")
    return Calibration(**kept["numbers"])


def small_gain_cost(gained, c):
    """What a further cause costs for the share of the whole excess that it removes [nats]."""
    return c.slight * np.log(c.share / min(max(gained, 1e-6), c.share))


def cannot_pay_off(left, nothing, calibration):
    """Whether no further cause could outweigh what it costs, however little it would leave.

    Parameters
    ----------
    left, nothing : float
        Excess of the best hypothesis, and of the refitted nominal model.
    calibration : Calibration
        The numbers.

    """
    c = calibration
    tolerated = c.floor + c.misfit * max(nothing, 0.0)
    gain = c.sharpness * np.log1p(max(left, 0.0) / tolerated)
    share = left / max(nothing, left, c.floor)
    return gain < small_gain_cost(share, c) + c.second + c.price - np.log(RARE)
