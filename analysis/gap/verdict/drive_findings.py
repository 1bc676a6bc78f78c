"""Faults of drives whose torque is measured beside its command, before any model of the joint."""

import itertools
from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from clie_blocks.analysis.gap.method import Method
from clie_blocks.analysis.gap.method.verdict import VerdictMethod
from clie_blocks.analysis.gap.problem import torque_path
from clie_blocks.analysis.gap.problem.torque_path import TorquePath
from clie_blocks.analysis.gap.verdict.evidence import Row, Table
from clie_blocks.analysis.gap.verdict.posterior import LIKELY, marginals, of_known, posterior
from clie_blocks.analysis.gap.verdict.signal_finding import SignalFinding, entry
from clie_blocks.analysis.records import Record

_DRIVE_EFFECTS = {torque_path.TIMING: ("actuator_lag", "time_delay"),
                  torque_path.GAIN: ("torque_gain_error",),
                  torque_path.LIMIT: ("actuator_saturation",),
                  torque_path.DEAD_ZONE: ("dead_zone",)}
_DRIVE_PARAMETERS = {"actuator_lag": ("lag", "s"), "time_delay": ("delay", "s"),
                     "torque_gain_error": ("error", "1"), "actuator_saturation": ("limit", "N m"),
                     "dead_zone": ("width", "N m")}


def drive_findings(records: Sequence[Record], method: Method, left_out: Collection[str],
                   ) -> Iterator[SignalFinding]:
    """Delay, gain, limit and dead zone of the drives whose torque is measured."""
    by_effect: dict[str, list[_Shown]] = {}
    for k in range(records[0].n):
        for shown in _of_drive(records, k, method, left_out):
            by_effect.setdefault(shown.effect, []).append(shown)
    for effect, rows in by_effect.items():
        _, joints, probability, value, half = map(np.array, zip(*rows))
        name, unit = _DRIVE_PARAMETERS[effect]
        yield SignalFinding(effect, tuple(joints.tolist()), float(probability.min()),
                            {name: entry(value, unit, value - half, value + half)})


class _Shown(NamedTuple):
    """An effect of one drive, with its parameter and the half width of its interval."""

    effect: str
    joint: int
    probability: float
    value: float
    half: float


def _of_drive(records: Sequence[Record], k: int, method: Method, left_out: Collection[str],
              ) -> list[_Shown]:
    """Effects of one drive that are likely.

    The odds of the verdict tell which of the elements a path needs.  They count as far as paths
    explain at all what is measured beyond the command: the rest is something else, of which what
    was found may be but the image.
    """
    paths = _paths_of_drive(records, k, method.verdict)
    if not paths:
        return []
    excess = {held: (path.rms_error / path.noise) ** 2 - 1.0 for held, path in paths.items()}
    rows = [Row(held, left, float(len(held))) for held, left in excess.items() if held]
    known = marginals(of_known(posterior(Table(excess[()], 0.0, 0, (), rows),
                                          method.calibration)))
    explained = 1.0 - max(min(excess.values()), 0.0) / max(excess[()], method.calibration.floor)
    odds = {name: explained * probability for name, probability in known.items()}
    likely = tuple(element for element in torque_path.ELEMENTS if odds.get(element, 0.0) >= LIKELY)
    return [_shown(paths[likely], element, k, odds[element], left_out) for element in likely
            if not set(_DRIVE_EFFECTS[element]) <= set(left_out)]


def _paths_of_drive(records: Sequence[Record], k: int, method: VerdictMethod,
                    ) -> dict[tuple[str, ...], TorquePath]:
    """Paths by the elements that they hold, for all sets of those that act at all."""
    whole = torque_path.pooled_torque_path(records, k, tuple(torque_path.ELEMENTS))
    if whole is None:
        return {}
    acting = [element for element in torque_path.ELEMENTS
              if _acts(whole, element, records[0].sample_time, method)]
    sets = itertools.chain.from_iterable(
        itertools.combinations(acting, count) for count in range(len(acting) + 1))
    paths = {held: torque_path.pooled_torque_path(records, k, held) for held in sets}
    return {held: path for held, path in paths.items() if path is not None}


def _acts(path: TorquePath, element: str, period: float, method: VerdictMethod) -> bool:
    """Whether an element of a fitted path differs from what a sound drive has."""
    half = path.half_widths
    if element == torque_path.TIMING:
        return path.total_delay - half["total_delay"] > period
    if element == torque_path.GAIN:
        return abs(path.gain - 1.0) > max(half["gain"], method.gain_error)
    if element == torque_path.LIMIT:
        return 0.0 < half["limit"] < path.limit
    return path.width > half["width"] > 0.0


def _shown(path: TorquePath, element: str, k: int, probability: float,
           left_out: Collection[str]) -> _Shown:
    """Effect that an element of a path is."""
    effects = [name for name in _DRIVE_EFFECTS[element] if name not in left_out]
    if element == torque_path.TIMING:
        effect = effects[0] if path.lag > path.delay else effects[-1]
        return _Shown(effect, k, probability, path.total_delay, path.half_widths["total_delay"])
    value = {torque_path.GAIN: path.gain - 1.0, torque_path.LIMIT: path.limit,
             torque_path.DEAD_ZONE: path.width}[element]
    parameter = {torque_path.GAIN: "gain", torque_path.LIMIT: "limit"}.get(element, "width")
    return _Shown(effects[0], k, probability, value, path.half_widths[parameter])
