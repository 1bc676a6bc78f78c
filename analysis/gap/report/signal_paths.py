"""What lies on the way of a command: late goals of servos, late and weak torques of drives."""

import numpy as np

from clie_blocks.analysis.gap.report.wording import effect_title, number, with_prefix
from clie_blocks.analysis.report.document import Section, Table

OF_GOALS = (
    "The command of these servos is not logged, so the way from goal to motion is fitted as a "
    "whole to the first log and judged on the others. A delay and dry friction hide each other: "
    "without friction in the model the delay cannot be seen, and without the delay friction "
    "takes its place. The dead time is what a reader of the log sees: from the last reading under "
    "an old goal to the first one beyond 5 % of a step, with lag, friction and the clock. The "
    "models of the motion hold each position error for one sample, which acts like the delay; a "
    "simulator whose servo holds nothing needs the delay itself.")
OF_TORQUES = (
    "The measured torque is compared with the commanded one, without a model of the robot. The "
    "motion was not asked, and the models of the motion do not hold it.")
LEFT = {"lag": "left with a lag alone", "setpoint_delay": "and a late goal",
        "coulomb": "and dry friction", "both": "and both"}


def signal_paths_section(diagnosis, units):
    """Causes on the way of the command; None where there are none."""
    if not diagnosis.paths:
        return None
    joints = diagnosis.problem.joints
    rows = tuple(row for cause in diagnosis.paths for row in _numbers(cause, joints))
    tables = [Table(("cause", "joint", "value", "95 % interval", "unit"), rows)]
    tables += [_left(cause, joints, units) for cause in diagnosis.paths if cause.left]
    of_goals = any(cause.left for cause in diagnosis.paths)
    of_torques = any(cause.effect in ("actuator_lag", "torque_gain_error")
                     for cause in diagnosis.paths)
    text = ((OF_GOALS,) if of_goals else ()) + ((OF_TORQUES,) if of_torques else ())
    return Section("On the way of the command", text, tables=tuple(tables))


def _numbers(cause, joints):
    for name, entry in cause.parameters.items():
        low, high = entry["interval"] or np.full((2, len(cause.joints)), np.nan)
        for place, k in enumerate(cause.joints):
            known = np.isfinite(low[place])
            yield (f"{effect_title(cause.effect)}: {effect_title(name)}", joints[k],
                   number(entry["value"][place], 4),
                   f"{number(low[place])} .. {number(high[place])}" if known else "-",
                   entry["unit"])


def _left(cause, joints, units):
    return Table(("joint", *LEFT.values()), tuple(
        (joints[k], *(with_prefix(cause.left[way][place], units["q"]) for way in LEFT))
        for place, k in enumerate(cause.joints)),
        "RMS error on logs that were not fitted, by what the servo is said to have.")
