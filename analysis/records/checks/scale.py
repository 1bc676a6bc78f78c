"""Check of the scale of command and position together: the inertia that they show."""

from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.records.checks.excitation import shown_inertias
from clie_blocks.analysis.records.checks.finding import Finding
from clie_blocks.analysis.records.checks.stability import nominal_joints
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.units import DEGREE

FAR = 3.0  # factor between shown and stated inertia that no fault of a robot makes
FARTHEST = FAR**3  # the same, that another log excuses
NEAR = 1.5  # factor within which a cause explains it
OWN = 0.5  # share of the rotor in a joint's inertia from which coupling does not matter


def check_scale(record: Record, robot: Robot | None, others: Sequence[Record] = (),
                ) -> list[Finding]:
    """Findings on torques and angles that contradict the stated inertia of every joint.

    What no known unit explains is none of units where another log of the robot shows the stated
    inertia: a slow motion shows friction that comes and goes as inertia, too, and a soft gear
    that is driven where it swings takes hardly any torque.
    """
    ratio = inertia_ratios(record, robot)
    known = ratio[np.isfinite(ratio)]
    if robot is None or known.size == 0 or not ((known > FAR).all() or (known < 1 / FAR).all()):
        return []
    if known[0] > FAR and robot.links.mass is None and robot.tree is None:
        return []  # links that the file does not have
    k = int(np.flatnonzero(np.isfinite(ratio))[0])
    hints = _hints(robot, k, float(ratio[k]))
    if not hints and 1 / FARTHEST < ratio[k] < FARTHEST and any(
            _agrees(inertia_ratios(other, robot)) for other in others):
        return []
    return [Finding(
        "error", "units.inertia", f"By its command it has {ratio[k]:.3g} times the stated "
        f"inertia{', as if ' + ' or '.join(hints) if hints else ''}.",
        "Command, position or inertia are in another unit, or on another side of the gear.",
        "State the units in the header, as u1[mNm] or q1[deg], or in [units]; bring torques to "
        "the motor side; check [motor] inertia_kgm2 and gear_ratio.", joint=record.joints[k])]


def inertia_ratios(record: Record, robot: Robot | None) -> np.ndarray:
    """Inertia that command and motion show over the stated one, shape (n,); NaN where unknown.

    Only torques in N m are compared, and only joints whose rotor outweighs their links, where
    there are other joints that move with them.  Links in space push a joint by more than its own
    inertia does: there all of the rotors must outweigh their links.
    """
    unknown = np.full(record.n, np.nan)
    nominal = nominal_joints(robot)
    if nominal is None or robot is None or record.u is None or set(record.units["u"]) != {"N m"}:
        return unknown
    motor = robot.motor
    if motor.inertia is None or motor.gear_ratio is None:
        return unknown
    stated = 1 / nominal[1]
    own = motor.inertia * motor.gear_ratio >= OWN * stated
    if robot.tree is not None:
        own = np.full(record.n, own.all())
    shown = shown_inertias(record, robot)
    return np.where(own | (record.n == 1), shown / stated, unknown)


def _agrees(ratio: np.ndarray) -> bool:
    """Whether a log shows the stated inertia at one of the joints."""
    return bool(np.any((ratio > 1 / FAR) & (ratio < FAR)))


def _hints(robot: Robot, k: int, ratio: float) -> list[str]:
    gear, peak = robot.motor.gear_ratio, robot.motor.peak_torque
    known = {"q were in degrees": DEGREE, "u were in mN m": 1e3, "u were in kN m": 1e-3}
    if gear is not None and gear[k] > FAR:
        known["u were on the joint side of the gear"] = float(gear[k])
        known["q were on the motor side of the gear"] = float(1 / gear[k])
    if peak is not None:
        known["u were in percent of the peak torque"] = float(100 / peak[k])
    return [text for text, factor in known.items() if 1 / NEAR < ratio / factor < NEAR]
