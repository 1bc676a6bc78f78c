"""Effects of the catalogue that a log shows in its commands, and where to look for each."""

import dataclasses
from collections.abc import Callable, Iterator

import numpy as np

from clie_blocks.analysis.gap.controller.replayed_joint import ReplayedJoint
from clie_blocks.effects import LIBRARY
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter

LONGEST_DELAY = 0.25  # s, that is looked for
LAGS = np.geomspace(1e-4, 0.3, 12)  # s, from which a lag is refined
CORNERS = np.geomspace(0.5, 5e3, 9)  # rad/s, likewise the corner of a derivative
WIDTHS = np.geomspace(3e-4, 3.0, 9)  # rad/s, over which a compensated friction changes its sign
CLAMPED = 0.02  # of the samples, at least: at the largest torque that an integral may give
AT_CLAMP = 0.98  # of that torque
VISIBLE = 4.0  # times the rounding of a command, from which it is beyond doubt another one
STEADY = 50  # samples over which the growth of an integral is measured

Start = dict[str, float]
"""Values of the free parameters from which a fit begins."""


@dataclasses.dataclass(frozen=True, eq=False)
class Candidate:
    """An effect with the parameters that are looked for; the others change nothing.

    Parameters
    ----------
    name : str
        The effect.
    free : tuple of str
        Its parameters that are found.
    starts : callable
        ``starts(joint)``, where to look.
    held : dict of str to float
        Parameters that keep a value of their own.
    fresh : bool
        Its state takes a sample in before it is read.
    linear : tuple of str
        Those of its parameters to which the command is proportional: a regression starts them.
    near : bool
        Where to look is read from the log, so that a start which leaves much refutes it.
    whole : bool
        A piece of a log does not show it: its state depends on all that was before.

    """

    name: str
    free: tuple[str, ...]
    starts: Callable[[ReplayedJoint], Iterator[Start]]
    held: dict[str, float] = dataclasses.field(default_factory=dict)
    fresh: bool = False
    linear: tuple[str, ...] = ()
    near: bool = False
    whole: bool = False

    @property
    def effect(self) -> Effect:
        """The effect in the catalogue."""
        return LIBRARY[self.name]

    def parameter(self, name: str) -> Parameter:
        """One of its parameters."""
        return next(p for p in self.effect.parameters if p.name == name)

    def values(self, found: Start) -> dict[str, float]:
        """Every parameter of the effect."""
        return {**{p.name: p.default for p in self.effect.parameters}, **self.held, **found}


def _delays(joint: ReplayedJoint) -> Iterator[dict[str, float]]:
    for half in range(1, 2 * round(LONGEST_DELAY / joint.period) + 1):
        yield {"delay": 0.5 * half * joint.period}


def _skews(joint: ReplayedJoint) -> Iterator[Start]:
    return ({"skew": start["delay"]} for start in _delays(joint))


def _speeds(joint: ReplayedJoint) -> Iterator[Start]:
    """Speed of the set-point that the command follows, while it is not the logged one."""
    visible = VISIBLE * joint.limit / max(joint.kp, np.finfo(float).tiny)
    steps = []
    for log in joint.logs:
        behind = joint.setpoint_behind(log)[:, 0]
        away = (np.abs(behind) > visible) & log.used
        steps.append(np.abs(np.diff(log.signals["q_d"][:, 0] + behind))[away[1:] & away[:-1]])
    every = np.concatenate(steps)
    if every.size and every.size * np.median(every) > visible:
        yield {"speed": float(np.median(every)) / joint.period}


def _lags(joint: ReplayedJoint) -> Iterator[Start]:
    return ({"lag": float(lag)} for lag in LAGS)


def _corners(joint: ReplayedJoint) -> Iterator[Start]:
    return ({"share": 0.0, "corner": float(corner)} for corner in CORNERS)


def _at(**start: float) -> Callable[[ReplayedJoint], Iterator[Start]]:
    return lambda joint: iter((start,))


def _integral(joint: ReplayedJoint) -> Iterator[Start]:
    yield {"ki": joint.kp}


def _clamped_integral(joint: ReplayedJoint) -> Iterator[Start]:
    """Clamp at which what the law leaves rests, and the gain with which it grows elsewhere."""
    left = [np.where(log.used, joint.left(log)[:, 0], 0.0) for log in joint.logs]
    clamp = float(max(np.abs(x).max() for x in left))
    if np.mean(np.concatenate([np.abs(x) > AT_CLAMP * clamp for x in left])) < CLAMPED:
        return
    sums, growths = [], []
    for log, x in zip(joint.logs, left):
        error = joint.period * np.cumsum(log.signals["q_d"] - log.signals["q"])
        inside = np.abs(x) < 0.9 * clamp
        steady = np.convolve(inside & log.used, np.ones(STEADY + 1), "valid") > STEADY
        sums.append((error[STEADY:] - error[:-STEADY])[steady])
        growths.append((x[STEADY:] - x[:-STEADY])[steady])
    growth, total = np.concatenate(growths), np.concatenate(sums)
    gain = float(growth @ total) / max(float(total @ total), np.finfo(float).tiny)
    if gain > 0.0:
        yield {"ki": gain, "clamp": clamp}


def _frictions(joint: ReplayedJoint) -> Iterator[Start]:
    return ({"friction": 0.0, "width": float(width)} for width in WIDTHS)


def _weights_and_frictions(joint: ReplayedJoint) -> Iterator[Start]:
    return ({"weight": 0.0, **start} for start in _frictions(joint))


UNCLAMPED = {"clamp": 1e4}  # N m, the upper bound
CANDIDATES: tuple[Candidate, ...] = (
    Candidate("gain_error", ("kp_error",), _at(kp_error=0.0)),
    Candidate("gain_error", ("kd_error",), _at(kd_error=0.0)),
    Candidate("sensor_gain", ("error",), _at(error=0.0)),
    Candidate("hidden_integral", ("ki",), _integral, UNCLAMPED),
    Candidate("hidden_integral", ("ki",), _integral, UNCLAMPED, fresh=True),
    Candidate("hidden_compensation", ("weight",), _at(weight=0.0)),
    Candidate("velocity_estimate_lag", ("lag",), _lags),
    Candidate("velocity_estimate_lag", ("lag",), _lags, fresh=True),
    Candidate("setpoint_slew", ("speed",), _speeds, near=True),
    Candidate("setpoint_delay", ("delay",), _delays, near=True),
    Candidate("in_loop_delay", ("delay",), _delays, near=True),
    Candidate("channel_skew", ("skew",), _skews, near=True),
    Candidate("gain_error", ("kp_error", "kd_error"), _at(kp_error=0.0, kd_error=0.0)),
    Candidate("sensor_gain", ("error", "bias"), _at(error=0.0, bias=0.0)),
    Candidate("control_law_form", ("share", "corner"), _corners, linear=("share",)),
    Candidate("hidden_integral", ("ki", "clamp"), _clamped_integral, near=True, whole=True),
    Candidate("hidden_integral", ("ki", "clamp"), _clamped_integral, fresh=True, near=True,
              whole=True),
    Candidate("hidden_compensation", ("friction", "width"), _frictions,
              linear=("friction",)),
    Candidate("hidden_compensation", ("weight", "friction", "width"), _weights_and_frictions,
              linear=("weight", "friction")))
FOUND_IN_COMMANDS = tuple(dict.fromkeys(one.name for one in CANDIDATES))
