"""What logs could not have shown, per name: not every name that is missing is ruled out.

A log of normal work rests most of the time, turns round a few times, at one speed.  What would
show an effect is known: this says of each name whether any log held it.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from clie_blocks.analysis.gap.problem.law import StatedLaw
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records.checks.capability import FAST, LONG, WEIGHT_SWEEP
from clie_blocks.analysis.records.checks.excitation import motions
from clie_blocks.effects import LIBRARY

REVERSALS = 4  # of a joint, from which dry friction shows beside an offset
SLOW_SHARE = 0.05  # of the moving time at a tenth of the top speed or less
DRY = ("coulomb", "asymmetric_coulomb", "load_dependent_friction", "directional_efficiency",
       "position_dependent_friction", "backlash")
AT_LOW_SPEED = ("stribeck", "presliding", "dahl", "maxwell_slip", "rest_time_breakaway")
OF_POSE = ("gravity", "payload", "spring", "counterbalance", "base_tilt")
OF_LINKS = ("payload", "coupling", "base_tilt")
IN_TIME = ("time_delay", "actuator_lag", "joint_elasticity", "tick_jitter",
           "stiffening_elasticity", "torsional_hysteresis", "packet_hold")
OF_TURNS = ("torque_ripple", "commutation_ripple", "gear_mesh_ripple", "encoder_eccentricity",
            "kinematic_error")
OVER_TIME = ("friction_drift", "periodic_disturbance", "step_fault", "motor_heating")
OF_THE_LAW = ("gain_error", "control_law_form", "hidden_integral", "hidden_compensation",
              "in_loop_delay", "velocity_filter_mismatch", "velocity_estimate_lag")


class _Facts(NamedTuple):
    """What the logs hold at most, of any joint."""

    reversals: int
    slow_share: float
    sweep: float
    turns: float
    rate: float
    longest: float


def not_shown(problem: Problem) -> dict[str, str]:
    """Why these logs cannot show an effect, by its name; names that they can show are missing.

    Parameters
    ----------
    problem : Problem
        Its records, robot and law.

    """
    facts = _facts(problem)
    reasons: dict[str, str] = {}
    for names, why in (*_of_the_signals(problem), *_of_the_motion(problem, facts)):
        for name in names:
            reasons.setdefault(name, why)
    return dict(sorted(reasons.items()))


def _facts(problem: Problem) -> _Facts:
    records = [record for record in problem.records if len(record) > 1]
    ratio = np.asarray(problem.gear_ratio)
    moved = [one for record in records for one in motions(record, problem.robot)]
    turns = [ratio[k] * one.sweep / (2.0 * np.pi) for record in records
             for k, one in enumerate(motions(record, problem.robot))]
    return _Facts(max((one.reversals for one in moved), default=0),
                  max((one.slow_share for one in moved), default=0.0),
                  max((one.sweep for one in moved), default=0.0), max(turns, default=0.0),
                  max((1.0 / record.sample_time for record in records), default=0.0),
                  max((record.duration for record in records), default=0.0))


def _of_the_signals(problem: Problem) -> list[tuple[Sequence[str], str]]:
    """Names that no motion shows, for want of a signal or of a statement."""
    law, found = problem.law, list[tuple[Sequence[str], str]]()
    if isinstance(law, StatedLaw) and law.measured_torque:
        drives = [name for name, effect in LIBRARY.items() if effect.port == "drive"]
        found.append((drives, law.beyond_reach))
    if problem.records and any(record.u is None for record in problem.records):
        found.append((OF_THE_LAW, "no command is logged, with which a law could be compared"))
        found.append((("torque_gain_error",), "no torque is logged: a drive that gives more or "
                      "less moves as other gains, and as less or more inertia and friction"))
    elif not law.holds_joints:
        found.append((OF_THE_LAW, "no law is known"))
    if not problem.links.known:
        found.append((OF_LINKS, "the robot file states no links"))
    return found


def _of_the_motion(problem: Problem, facts: _Facts) -> list[tuple[Sequence[str], str]]:
    """Names for which the motion is too poor."""
    many = f"no joint turns round more than {facts.reversals} times in a log"
    rules: list[tuple[bool, Sequence[str], str]] = [
        (facts.reversals < REVERSALS, (*DRY, *AT_LOW_SPEED), many),
        (facts.slow_share <= SLOW_SHARE, AT_LOW_SPEED,
         f"at most {facts.slow_share:.0%} of the motion is slow"),
        (facts.sweep <= WEIGHT_SWEEP, OF_POSE, f"the widest sweep is {facts.sweep:.3g} rad"),
        (facts.rate < FAST, IN_TIME, f"logged at {facts.rate:.4g} Hz, what happens within "
         f"{1e3 / max(facts.rate, 1e-9):.3g} ms hardly shows"),
        (facts.turns <= 1.0, OF_TURNS, f"the motor makes {facts.turns:.2g} turns"),
        (facts.longest < LONG, OVER_TIME, f"the longest log has {facts.longest:.3g} s")]
    return [(names, why) for is_poor, names, why in rules if is_poor]


