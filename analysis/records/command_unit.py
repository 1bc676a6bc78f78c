"""What one unit of a command is worth in N m or N, as far as the robot file says."""

from __future__ import annotations

import numpy as np

from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.robot_sections import Motor
from clie_blocks.analysis.records.units import FORCES

NO_MOTOR = Motor()
REMEDIES = {
    "A": "state [motor] torque_constant_nm_a, the torque per ampere",
    "V": "state [motor] torque_gain, the torque or force per volt, or torque_constant_nm_a and "
         "resistance_ohm",
    "duty": "state [motor] torque_constant_nm_a and resistance_ohm, and [controller] supply_v",
    "%": "state [motor] torque_gain, the torque per percent of rated",
    "u": "state the unit of u, as in [units] u = \"N m\" or a header u1 [N m], and where it is "
         "no torque [motor] torque_gain, the torque per unit of u"}


def force_per_command(record: Record) -> np.ndarray | None:
    """Torque [N m] or force [N] per unit of command, shape (n,); None where one is not known."""
    motor = NO_MOTOR if record.robot is None else record.robot.motor
    factors = [_factor(motor, unit, k) for k, unit in enumerate(record.units["u"])]
    return None if None in factors else np.array(factors, float)


def _factor(motor: Motor, unit: str, k: int) -> float | None:
    gain = None if motor.torque_gain is None else float(motor.torque_gain[k])
    if unit in FORCES:
        return 1.0 if gain is None else gain
    if gain is not None and gain != 1.0:  # one says of torques that they arrive
        return gain
    constant = None if motor.torque_constant is None else float(motor.torque_constant[k])
    if unit == "A":
        return constant
    if unit == "V" and constant is not None and motor.resistance is not None:
        return constant / float(motor.resistance[k])
    return None


def missing_force(record: Record) -> str | None:
    """Why torques of a record are not known in N m or N, and what to state; None if they are."""
    for k, unit in enumerate(record.units["q"]):
        if unit not in ("rad", "m"):
            return (f"the position of {record.joints[k]} is in {unit}, neither an angle nor a "
                    "length: log it in rad or m")
    if force_per_command(record) is not None:
        return None
    unit = next(unit for unit in record.units["u"] if unit not in FORCES)
    if unit in ("rad", "m"):
        return ("no command was logged, and the position error stands for it: log the command u "
                "and state its unit")
    what = "the unit of u is not stated" if unit == "u" else f"u is in {unit}, not a torque"
    return f"{what}: {REMEDIES.get(unit, REMEDIES['u'])}"
