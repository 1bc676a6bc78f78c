"""Laws of the library that a robot may run under, from what its file states: simple ones first.

Each is a controller as a robot file states it, with neutral values for what is to be found, so
that a law that is found can be stated in one or two lines.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterator
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records.controller_section import Controller

FLAT = 20  # samples in a row at the largest command, from which it is a limit
AT_LIMIT = 1.0 - 1e-6  # of that command
UNLIMITED = 1e9  # N m
SLOWEST_OUTER = 10  # samples of the inner loop of a cascade per sample of the outer one
CORNERS = (0.03, 0.3)  # rad per sample, from which a low-pass is looked for
NOTCHES = (0.05, 0.15, 0.4, 1.0)  # rad per sample, likewise a notch
WIDTH = 0.02  # rad/s, over which a friction that is fed forward changes its sign
NEUTRAL: dict[str, float] = {"model_mass": 1.0, "model_rotor": 1.0, "model_friction": 1.0}
OF_ACCELERATION = {"kp": "1/s^2", "ki": "1/s^3", "kd": "1/s", "feedforward_velocity": "1/s"}
# Models of the robot within a law, in words, and which shares of the stated numbers are found: the
# damping of a reference is in the velocity that is fed forward.
MODELS = (("gravity", "the weight of the links", ("mass",)),
          ("inverse_dynamics", "inverse dynamics at the reference", ("mass", "rotor")),
          ("pd_plus", "the dynamics of PD+", ("mass", "rotor")),
          ("computed_torque", "computed torque", ("mass", "rotor", "friction")))
# Parameter of a block -> field of the controller, and key in it where it is a table.
FIELDS: dict[str, tuple[str, str | None]] = {
    "kp": ("kp", None), "ki": ("ki", None), "kd": ("kd", None), "kv": ("kv", None),
    "dead_band": ("dead_band", None), "punch": ("punch", None),
    "command_rate": ("command_rate", None),
    **{f"feedforward_{key.removesuffix('_rad_s')}": ("feedforward", key)
       for key in ("velocity", "acceleration", "coulomb", "width_rad_s")},
    **{f"{place}_{key.removesuffix('_rad_s')}": (f"{place}_filter", key)
       for place in ("error", "command") for key in ("lowpass_rad_s", "notch_rad_s",
                                                     "notch_width")},
    **{f"model_{key}": ("model_shares", key) for key in ("mass", "rotor", "friction")}}
# Keys of a robot file, of the fields that are not named as their key.
KEYS = {"kp": "Kp", "ki": "Ki", "kd": "Kd", "kv": "Kv", "saturation": "saturation_nm",
        "dead_band": "dead_band_rad", "punch": "punch_nm", "command_rate": "command_rate_nm_s",
        "highpass": "velocity_filter_highpass_rad_s", "lowpass": "velocity_filter_lowpass_rad_s",
        "discretisation": "velocity_filter_discretisation"}
STATED = ("law", "kp", "ki", "kd", "kv", "velocity_of", "compensation", "model_shares",
          "feedforward", "reference_rate", "error_filter", "command_filter", "dead_band", "punch",
          "command_rate", "position_every", "anti_windup", "velocity_filter", "highpass",
          "lowpass", "discretisation", "saturation")


@dataclasses.dataclass(frozen=True, eq=False)
class Variant:
    """A law to try.

    Parameters
    ----------
    name : str
        What it has beyond the base, in words; empty for its gains alone.
    controller : Controller
        With neutral values for what is to be found.
    choices : int
        How much it chooses beyond its numbers.
    start : Controller or None
        From which its numbers are found, where the neutral ones are too far from them.

    """

    name: str
    controller: Controller
    choices: int = 0
    start: Controller | None = None


def as_base(controller: Controller, problem: Problem) -> Controller:
    """Controller with an integral gain to be found, and with the limit that the commands show."""
    zero = np.zeros(problem.n)
    changes: dict[str, Any] = {}
    if controller.law in ("pd", "pid"):
        changes = {"law": "pid", "ki": zero if controller.ki is None else controller.ki}
    if controller.law == "cascade" and controller.ki is None:
        changes = {"ki": zero}
    seen = limits_seen(problem)
    stated = np.inf if controller.saturation is None else controller.saturation
    if np.any(seen < stated):
        changes["saturation"] = np.minimum(np.minimum(seen, stated), UNLIMITED)
    return dataclasses.replace(controller, **changes)


def limits_seen(problem: Problem) -> np.ndarray:
    """Largest command of each joint where it stays there, shape (n,) [N m]; infinite elsewhere."""
    found = np.full(problem.n, np.inf)
    for k in range(problem.n):
        largest = max(float(np.abs(log.u[:, k]).max()) for log in problem.logs)
        for log in problem.logs:
            at_top = np.abs(log.u[:, k]) >= largest - max(
                0.5 * problem.law.resolution[k], (1.0 - AT_LIMIT) * largest)
            runs = np.convolve(at_top, np.ones(min(FLAT, len(at_top))), "valid")
            moves = np.ptp(log.u[:, k]) > 0.0
            if largest > 0.0 and moves and runs.max() >= FLAT:
                found[k] = largest
    return found


def tiers(base: Controller, problem: Problem) -> Iterator[list[Variant]]:
    """Laws to try, in the order in which they are: the next ones where none of these ran."""
    yield list(_gains(base, problem))
    yield list(_feedforward(base))
    yield [*_outer_rates(base), *_dead_bands(base, problem), *_friction(base)]
    if problem.n > 1 or problem.links.has_gravity:  # of one rotor feedforward is all the dynamics
        yield list(_models(base, problem))
    yield list(_filters(base, problem.period))
    yield [*_velocities(base, problem.period), *_others(base, problem)]


def _gains(base: Controller, problem: Problem) -> Iterator[Variant]:
    yield Variant("", base, start=_at_its_limit(base, problem))
    if base.saturation is not None:
        for hold, words in (("none", "an integral that winds up"),
                            ("conditional", "an integral that is held at the limit")):
            if hold != (base.anti_windup or "conditional"):
                one = dataclasses.replace(base, anti_windup=hold)
                yield Variant(words, one, 1, _at_its_limit(one, problem))
    if base.law == "pid" and base.velocity_of != "error":
        yield Variant("the velocity of the error", dataclasses.replace(
            base, velocity_of="error"), 1)


def _at_its_limit(base: Controller, problem: Problem) -> Controller | None:
    """PID with the gains that its command shows between the times at which it is limited.

    Where a limit holds an integral, no small change of a gain shows which samples it holds, so
    that the integral counts only within such a time.
    """
    if base.saturation is None or base.law != "pid":
        return None
    gains = np.zeros((3, problem.n))
    for k in range(problem.n):
        parts = [part for log in problem.logs for part in _between_limits(
            log, problem, k, AT_LIMIT * float(base.saturation[k]))]
        if not parts:
            return None
        every = np.concatenate(parts)
        gains[:, k] = np.linalg.lstsq(every[:, :-1], every[:, -1], rcond=None)[0]
    kp, ki, kd = np.maximum(gains, 0.0)
    return dataclasses.replace(base, kp=kp, ki=ki, kd=kd)


def _between_limits(log: Log, problem: Problem, k: int, limit: float) -> Iterator[np.ndarray]:
    """Error, its sum, less of the velocity, and command of a joint, less their means, by part."""
    error, u = log.q_d[:, k] - log.law_q[:, k], log.u[:, k] - log.pe[:, k]
    rate = problem.stated_law.rate(log.law_q)[:, k]
    table = np.stack([error, problem.period * np.cumsum(error), -rate, u], axis=1)
    free = np.abs(log.u[:, k]) < limit - problem.law.resolution[k]
    free[:FLAT] = False
    edges = np.flatnonzero(np.diff(np.concatenate([[False], free, [False]]).astype(int)))
    for start, stop in edges.reshape(-1, 2):
        if stop - start >= FLAT:
            yield table[start:stop] - table[start:stop].mean(axis=0)


def _fed_forward(base: Controller, rate: str, *more: str) -> Controller:
    n = joints_of(base)
    given = {key: np.zeros(n) for key in ("velocity", "acceleration", *more)}
    if "coulomb" in more:
        given["width_rad_s"] = np.full(n, WIDTH)
    return dataclasses.replace(base, feedforward=given | dict(base.feedforward or {}),
                               reference_rate=rate)


def _rates(base: Controller) -> tuple[str, ...]:
    stated = base.reference_rate
    return tuple(dict.fromkeys(filter(None, (stated, "trajectory", "difference", "filtered"))))


def _feedforward(base: Controller) -> Iterator[Variant]:
    for rate in _rates(base):
        yield Variant("feedforward", _fed_forward(base, rate), int(rate == "filtered"))
    if base.saturation is not None and (base.anti_windup or "conditional") == "conditional":
        yield Variant("feedforward and an integral that winds up", dataclasses.replace(
            _fed_forward(base, "trajectory"), anti_windup="none"), 1)


def _friction(base: Controller) -> Iterator[Variant]:
    for rate in _rates(base)[:2]:
        yield Variant("feedforward", _fed_forward(base, rate, "coulomb"), 1)


def _outer_rates(base: Controller) -> Iterator[Variant]:
    if base.law != "cascade":
        return
    for every in range(1, SLOWEST_OUTER + 1):
        if every != int(base.position_every or 1):
            yield Variant(f"a position loop at each {every} samples",
                          dataclasses.replace(base, position_every=every), 1)


def _dead_bands(base: Controller, problem: Problem) -> Iterator[Variant]:
    """Law with a dead band where small errors give no command, and larger ones do."""
    if base.law == "cascade":
        return
    found = [_dead_band_of(problem, k) for k in range(problem.n)]
    if any(each is None for each in found):
        return
    band, kp, punch = np.transpose([each for each in found if each is not None])
    zero = np.zeros(problem.n)
    yield Variant("a dead band", dataclasses.replace(base, dead_band=zero, punch=zero),
                  start=dataclasses.replace(base, dead_band=band, punch=punch, kp=kp))


def _dead_band_of(problem: Problem, k: int) -> tuple[float, float, float] | None:
    """Half the dead band of a joint [rad], gain, and punch; None where it has none."""
    error, u = (np.concatenate([getattr(log, name)[:, k] - getattr(log, other)[:, k]
                                for log in problem.logs])
                for name, other in (("q_d", "law_q"), ("u", "pe")))
    least = max(float(problem.law.resolution[k]), 1e-6 * float(np.abs(u).max()))
    idle, largest = np.abs(u) < least, np.abs(u).max()
    if np.count_nonzero(idle) < FLAT or np.all(idle):
        return None
    band = 0.5 * (np.abs(error[idle]).max() + np.abs(error[~idle]).min())
    acts = ~idle & (np.abs(u) < AT_LIMIT * largest)
    columns = np.stack([error, np.sign(error)], axis=1)[acts]
    kp, offset = np.linalg.lstsq(columns, u[acts], rcond=None)[0]
    return (float(band), float(kp), max(float(offset + kp * band), 0.0)) if kp > 0.0 else None


def _filters(base: Controller, period: float) -> Iterator[Variant]:
    n = joints_of(base)
    fed = [base, _fed_forward(base, "trajectory"), _fed_forward(base, "difference")]
    for corner in CORNERS:
        table = {"lowpass_rad_s": np.full(n, corner / period)}
        for one in fed:
            words = "" if one is base else " and feedforward"
            yield Variant(f"a low-pass of the command{words}",
                          dataclasses.replace(one, command_filter=table), 1)
        yield Variant("a low-pass of the error",
                      dataclasses.replace(base, error_filter=table), 1)


def _velocities(base: Controller, period: float) -> Iterator[Variant]:
    """Other ways to form the velocity of the joint, with feedforward of the reference."""
    plain = dataclasses.replace(base, velocity_filter=None, highpass=None, lowpass=None,
                                discretisation=None)
    for one in (plain, _fed_forward(plain, "trajectory")):
        words = "" if one is plain else " and feedforward"
        for name in ("difference", "two_tap"):
            if name != base.velocity_filter:
                yield Variant(f"the velocity as {name}{words}",
                              dataclasses.replace(one, velocity_filter=name), 1)
        for name in ("tustin", "backward"):
            yield Variant(f"a filtered velocity{words}", dataclasses.replace(
                one, velocity_filter="two_corner", highpass=0.5 / period, lowpass=0.2 / period,
                discretisation=name), 1)


def _models(base: Controller, problem: Problem) -> Iterator[Variant]:
    robot = problem.robot
    if robot is None or robot.motor.inertia is None or base.law == "cascade":
        return
    for form, words, shares in MODELS:
        if form == "gravity" and not problem.links.has_gravity:
            continue
        of_law = base
        if form == "computed_torque":
            per_inertia = {name: value / problem.nominal.inertia for name in ("kp", "ki", "kd")
                           if (value := getattr(base, name)) is not None}
            of_law = dataclasses.replace(base, **per_inertia)
        yield Variant(words, dataclasses.replace(
            of_law, compensation=form, reference_rate="trajectory",
            feedforward={"velocity": np.zeros(problem.n)} | dict(base.feedforward or {}),
            model_shares={key: np.ones(problem.n) for key in shares}), 1)


def _others(base: Controller, problem: Problem) -> Iterator[Variant]:
    n, period = problem.n, problem.period
    change = np.max([np.abs(np.diff(log.u, axis=0)).max(axis=0) for log in problem.logs], axis=0)
    change = change - problem.law.resolution  # by which rounding enlarges it
    if np.all(change > 0.0):
        limited = dataclasses.replace(base, command_rate=change / period)
        yield Variant("a limit of its rate", limited, 1, start=limited)  # seldom met in a piece
    for notch in NOTCHES:
        yield Variant("a notch in the command", dataclasses.replace(base, command_filter={
            "notch_rad_s": np.full(n, notch / period), "notch_width": np.full(n, 0.5)}), 1)


def held_numbers(controller: Controller, keys: Collection[str]) -> set[str]:
    """Parameters of a block, of those that have these keys, that its controller does not state."""
    held = set()
    for key in keys:
        field, entry = FIELDS.get(key, (None, None))
        value = None if field is None else getattr(controller, field)
        if field is not None and (value is None or (entry is not None and entry not in value)):
            held.add(key)
    return held


def units_of(controller: Controller) -> dict[str, str]:
    """Unit of each parameter that the block of a controller may have."""
    from clie_blocks.controllers import dead_band, feedforward, limits, signal_filters

    return {
        "kp": "N m/rad", "ki": "N m/(rad s)", "kd": "N m s/rad", "kv": "N m s/rad",
        "highpass": "rad/s", "lowpass": "rad/s", "compensation": "1",
        **dict.fromkeys(NEUTRAL, "1"),
        **{key: unit for part in (dead_band, feedforward, limits, signal_filters)
           for key, (unit, _) in part.BOUNDS.items()},
        **({"kp": "1/s"} if controller.law == "cascade" else {}),
        **(OF_ACCELERATION if controller.compensation == "computed_torque" else {})}


def with_numbers(controller: Controller, values: dict[str, np.ndarray]) -> Controller:
    """Controller with the values (n,) of parameters of its block."""
    changes: dict[str, Any] = {}
    tables: dict[str, Any] = {}
    for key, value in values.items():
        field, entry = FIELDS.get(key, (None, None))
        if field is None:
            continue
        if entry is None:
            changes[field] = value
        elif getattr(controller, field) is not None:
            tables.setdefault(field, dict(getattr(controller, field)))[entry] = value
    return dataclasses.replace(controller, **changes, **tables)


def statement(controller: Controller, stated: Controller) -> tuple[str, ...]:
    """Lines of [controller] by which a law is stated, where it differs from what is stated."""
    lines = []
    if controller.law == "pid" and stated.law != "pid" and not np.any(controller.ki):
        controller = dataclasses.replace(controller, law="pd", ki=None)
    for field in STATED:
        value = getattr(controller, field)
        if value is None or _same(value, getattr(stated, field)) or _is_idle(field, value):
            continue
        lines.append(f"{KEYS.get(field, field)} = {_toml(field, value)}")
    return tuple(lines)


def joints_of(controller: Controller) -> int:
    """Number of joints of a controller with gains."""
    return 0 if controller.kp is None else controller.kp.size


def _same(one: object, other: object) -> bool:
    if other is None:
        return False
    if isinstance(one, (str, float, int)):
        return one == other
    if isinstance(one, dict):
        return isinstance(other, dict) and one.keys() == other.keys() and all(
            np.array_equal(one[key], other[key]) for key in one)
    return bool(np.array_equal(np.asarray(one), np.asarray(other)))


def _is_idle(field: str, value: Any) -> bool:
    """Whether a value changes nothing, as a gain of zero."""
    if isinstance(value, dict):
        return all(not np.any(x) for key, x in value.items() if key != "width_rad_s")
    return field in ("ki", "punch", "dead_band") and not np.any(value)


def _toml(field: str, value: object) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, dict):
        used = {key: x for key, x in value.items() if np.any(x)}
        if "coulomb" not in used:
            used.pop("width_rad_s", None)
        return "{ " + ", ".join(f"{key} = {_toml(field, x)}" for key, x in used.items()) + " }"
    numbers = [f"{float(x):.5g}" for x in np.atleast_1d(np.asarray(value, float))]
    return numbers[0] if np.ndim(np.asarray(value)) == 0 else f"[{', '.join(numbers)}]"


