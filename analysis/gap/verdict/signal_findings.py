"""Causes that the way of a command shows by itself, before any model of the joint is fitted.

A nominal servo acts on its goal at once, a nominal drive gives what it is asked for.  Where
a log holds both ends of that way, what lies between them is measured, and stands beside the
causes that the motion is searched for.  Of a goal the same odds tell whether the delay is needed:
lag alone, lag with delay, lag with dry friction, and lag with both are judged on logs that they
were not fitted to.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.problem import position_path, torque_path
from clie_blocks.analysis.gap.verdict.evidence import Row, Table
from clie_blocks.analysis.gap.verdict.posterior import LIKELY, UNKNOWN, posterior

CERTAIN = 0.97  # what two logged signals, or the replay of the law, establish without a model
MADE_OF_STEPS = 0.7  # share of the sensor's noise that its steps make
FELT = 0.01  # error of a gain that is one
HYPOTHESES = {"setpoint_delay": ("time_delay",), "coulomb": ("coulomb",),
              "both": ("coulomb", "time_delay")}
LATE = ("setpoint_delay", "both")


@dataclasses.dataclass(frozen=True, eq=False)
class SignalFinding:
    """A cause that lies on the way of a command.

    Parameters
    ----------
    effect : str
        Name in the vocabulary.
    joints : tuple of int
        Where it was found.
    probability : float
        Of the cause.
    parameters : dict
        Number -> ``value``, ``unit`` and ``interval``, an entry per joint.
    share : float
        Of the gap, where that is told.
    left : dict
        What is left of each joint's motion by what is said to be there [rad]: arrays by name of
        `position_path.EXPLAINED_BY`.

    """

    effect: str
    joints: tuple
    probability: float
    parameters: dict
    share: float = 0.0
    left: dict = dataclasses.field(default_factory=dict)

    def as_dict(self):
        """Row of the JSON answer."""
        return {"effect": self.effect, "joint": [k + 1 for k in self.joints],
                "probability": self.probability, "parameters": self.parameters}


def signal_findings(records, bench, check, calibration, left_out=frozenset()):
    """Causes on the way of the command; none where the law is stated and its command logged.

    Parameters
    ----------
    records : list of Record
        Logs as `preparation.prepared` gives them.
    bench : Bench
        Noise of the joints.
    check : ControllerCheck
        Steps of the logged positions.
    calibration : Calibration
        Numbers of the odds.
    left_out : set of str
        Effects that are known not to be there: none is named, none explains a motion.

    Returns
    -------
    tuple of PathCause
        Surest first.

    """
    found = ()
    if all(findings_of_position_path(record) for record in records):
        found = (*_late_goals(records, bench.noises, calibration, left_out),
                 *_coarse_positions(bench, check))
    elif all(findings_of_torque_path(record) for record in records):
        found = _late_torques(records, left_out)
    return tuple(cause for cause in found if cause.effect not in left_out)


def established_names(check, left_out=frozenset()):
    """Causes that the check of the controller establishes.

    Parameters
    ----------
    check : ControllerCheck
        Its result.
    left_out : set of str
        Effects that are not to be named.

    Returns
    -------
    tuple of PathCause
        The filter that ran, and the steps that the encoder makes.

    """
    found = (
        ("velocity_filter_mismatch", tuple(check.wrong),
         lambda at: {"highpass": _entry(check.corners[0, at], "rad/s"),
                     "lowpass": _entry(check.corners[1, at], "rad/s")}),
        ("encoder_quantization", tuple(check.coarse),
         lambda at: {"step": _entry(check.step[at], "rad")}))
    return tuple(SignalFinding(effect, joints, CERTAIN, numbers(list(joints)))
                 for effect, joints, numbers in found if joints and effect not in left_out)


def with_signal_findings(said, paths):
    """Verdict where the way of the command shows causes of its own.

    Parameters
    ----------
    said : str
        Verdict on the motion.
    paths : tuple of PathCause
        What the way of the command shows.

    """
    return "effect" if paths and said in ("none", "not_identifiable") else said


def findings_of_position_path(record):
    """Whether the position error stands for a command that was not logged."""
    return (_of_no_law(record) and record.u is not None and record.qd is not None
            and np.array_equal(record.u, record.qd - record.q))


def findings_of_torque_path(record):
    """Whether commands act as excitation, and what came of them was measured."""
    return (_of_no_law(record) and not record.robot.controller.kp.any()
            and record.u is not None and record.tau is not None)


def _of_no_law(record):
    """Whether a law was put in the place of an unknown one."""
    law = record.robot and record.robot.controller
    return bool(law and law.velocity_filter == "difference" and law.kd is not None
                and not np.any(law.kd))


def _late_goals(records, noises, calibration, left_out):
    """The delay of a servo's goals, where the odds are for one."""
    ways = ["lag", *(way for way, names in HYPOTHESES.items() if left_out.isdisjoint(names))]
    joints = tuple(int(k) for k in np.flatnonzero(np.ptp(records[0].qd, axis=0) > 0))
    late_ways = [way for way in ways if way in LATE]
    if not joints or not late_ways:
        return ()
    found = [position_path.paths_by_hypothesis(records[0], k, ways) for k in joints]
    unseen = records[1:] or records
    left = {name: np.array([_unexplained_share(unseen, k, of[name]) for k, of in zip(joints, found)])
            for name in ways}
    sigma = np.array([noises[k].sigma for k in joints])
    excess = {name: float(np.sum(rms**2 / sigma**2 - 1.0)) for name, rms in left.items()}
    likely = needed_causes(excess, calibration)
    if likely < LIKELY:
        return ()
    best = min(late_ways, key=excess.get)
    times = {"time": _times(of[best] for of in found)}
    late = [position_path.dead_times(records[0], k) for k in joints]
    if all(times_of.size for times_of in late):
        times["dead_time"] = _dead_times(late, records[0].sample_time)
    return (SignalFinding("time_delay", joints, likely, times, _share(excess), left),)


def _unexplained_share(records, k, path):
    return np.sqrt(np.mean([position_path.validation_error(path, record, k)**2 for record in records]))


def needed_causes(excess, calibration):
    """Probability that goals are late, from what each explanation leaves.

    That something else may be at work, too, is a question to the motion.

    Parameters
    ----------
    excess : dict
        chi^2 beyond the noise, per sample of one joint, by name of `position_path.EXPLAINED_BY`;
        what lacks is no explanation.
    calibration : Calibration
        Numbers of the odds.

    """
    rows = [Row(names, excess[way], float(len(names))) for way, names in HYPOTHESES.items()
            if way in excess]
    told = [standing for standing in posterior(Table(excess["lag"], 0.0, 0, (), rows), calibration)
            if standing.names != (UNKNOWN,)]
    late = sum(standing.probability for standing in told if "time_delay" in standing.names)
    return late / sum(standing.probability for standing in told)


def _share(excess):
    """Share of the gap that the delay closes, on average before and after the dry friction."""
    gained = [excess[without] - excess[late] for without, late in (
        ("lag", "setpoint_delay"), ("coulomb", "both")) if late in excess]
    return float(np.clip(np.mean(gained) / excess["lag"], 0.0, 1.0))


def _times(paths):
    value, half = np.transpose([(path.delay, path.half_widths["delay"]) for path in paths])
    return _entry(value, "s", np.maximum(value - half, 0.0), value + half)


def _dead_times(late, tick):
    """Median time from the last reading under an old goal, with a 95 % interval.

    The motion began between two readings, so the interval begins one tick earlier.
    """
    value = np.array([np.median(times) for times in late])
    low, high = np.transpose([_of_median(np.sort(times)) for times in late])
    return _entry(value + tick, "s", low, high + tick)


def _of_median(ordered):
    """Values between which the median of a population lies, nineteen times of twenty."""
    reach = 0.98 * np.sqrt(ordered.size)
    first, last = (ordered.size - 1) / 2 + np.array([-reach, reach])
    return ordered[max(int(np.floor(first)), 0)], ordered[min(int(np.ceil(last)),
                                                              ordered.size - 1)]


def _coarse_positions(bench, check):
    """Steps of the position, where no file states them and they make most of the noise."""
    noise = np.array([noise.sigma for noise in bench.noises])
    coarse = ((bench.problem.resolution == 0)
              & (check.step / np.sqrt(12.0) > MADE_OF_STEPS * noise))
    at = np.flatnonzero(coarse)
    if at.size:
        yield SignalFinding("encoder_quantization", tuple(at.tolist()), CERTAIN,
                        {"step": _entry(check.step[at], "rad")})


def _late_torques(records, left_out):
    """Lag or delay, and gain, of the drives whose torque is measured."""
    either = [name for name in ("actuator_lag", "time_delay") if name not in left_out]
    driven = [torque_path.pooled_torque_path(records, k) for k in range(records[0].n)]
    found = {"actuator_lag": [], "time_delay": [], "torque_gain_error": []}
    for k, path in enumerate(driven):
        if path is None:
            continue
        if either and path.late - path.half_widths["late"] > records[0].sample_time:
            found[either[0] if path.lag > path.delay else either[-1]].append(
                (k, path.late, path.half_widths["late"]))
        if abs(path.gain - 1.0) > max(path.half_widths["gain"], FELT):
            found["torque_gain_error"].append((k, path.gain - 1.0, path.half_widths["gain"]))
    for effect, rows in found.items():
        if rows:
            joints, value, half = map(np.array, zip(*rows))
            name, unit = ("error", "1") if effect == "torque_gain_error" else ("time", "s")
            yield SignalFinding(effect, tuple(joints.tolist()), CERTAIN,
                            {name: _entry(value, unit, value - half, value + half)})


def _entry(value, unit, low=None, high=None):
    return {"value": value, "unit": unit, "interval": None if low is None else [low, high]}
