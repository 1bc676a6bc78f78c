"""Example logs with their robot files, as data of the package: `clie example`."""

from pathlib import Path

FOLDER = Path(__file__).parent
EXAMPLES = {
    "friction-arm": "an arm of two joints, one of which has a friction that its model has not",
    "healthy-arm": "the same arm without that friction: its model is right",
    "leg-without-torque": "a leg in space whose logs hold positions only; one of its joints rubs",
    "servo-arm": "a desk arm of six servos, of which set-points and positions are known; one rubs"}
