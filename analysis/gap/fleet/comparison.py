"""What several units of one robot have in common, and which one is odd, from their answers."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.assessment.by_log import JOINT_MODEL
from clie_blocks.analysis.gap.fleet.variation import Variation, odd_units, variation
from clie_blocks.analysis.gap.report.cause_words import joint_names, leading_rows
from clie_blocks.analysis.gap.report.wording import Answer, effect_title, join_words
from clie_blocks.errors import ClieError

COMMON = 0.5  # share of the units, above which a cause is of the model and not of a unit
LEAST = 2  # units that can be compared

Key = tuple[str, int | None, str, str]
"""Effect, joint from 1, parameter and unit."""


@dataclasses.dataclass(frozen=True, eq=False)
class FleetParameter:
    """One parameter of several units.

    Parameters
    ----------
    effect : str
        The effect that it belongs to, or the joint model.
    joint : int or None
        Counted from 1; None of the whole robot.
    name, unit : str
        Of the parameter.
    robots : tuple of str
        Units that have it.
    variation : Variation
        How it varies over these.
    odd : tuple of str
        Units whose value is not that of the others.
    common : Variation
        How it varies over the others.
    logs : dict
        Values and standard deviations of each log, by unit.

    """

    effect: str
    joint: int | None
    name: str
    unit: str
    robots: tuple[str, ...]
    variation: Variation
    odd: tuple[str, ...]
    common: Variation
    logs: Mapping[str, tuple[np.ndarray, np.ndarray]]

    def to_dict(self) -> dict[str, Any]:
        """In plain types."""
        varies = self.common
        return {"effect": self.effect, "joint": self.joint, "parameter": self.name,
                "unit": self.unit, "common": varies.mean,
                "interval": [varies.mean - varies.half, varies.mean + varies.half],
                "between_units": varies.between_units, "between_logs": varies.between_logs,
                "units_differ": varies.units_differ, "logs_differ": varies.logs_differ,
                "odd": list(self.odd), "units": [
                    {"name": robot, **dataclasses.asdict(value),
                     "logs": self.logs[robot][0], "deviations": self.logs[robot][1]}
                    for robot, value in zip(self.robots, self.variation.units)]}


@dataclasses.dataclass(frozen=True, eq=False)
class Fleet:
    """Several units of one robot.

    Parameters
    ----------
    robots : tuple of str
        Units that were diagnosed.
    causes : dict
        Unit -> its causes, each an effect and a joint from 1.
    common : tuple of (str, int)
        Causes of more than half of the units.
    parameters : tuple of FleetParameter
        Parameters of two units or more.
    joints : tuple of str
        Names of the joints.

    """

    robots: tuple[str, ...]
    causes: Mapping[str, tuple[tuple[str, int], ...]]
    common: tuple[tuple[str, int], ...]
    parameters: tuple[FleetParameter, ...]
    joints: tuple[str, ...]

    def odd(self) -> dict[str, list[str]]:
        """Units that differ from the others, each with what is odd about it."""
        found: dict[str, list[str]] = {}
        for robot in self.robots:
            own = set(self.causes[robot])
            reasons = [f"{self.title(*cause)} in this unit"
                       for cause in self.causes[robot] if cause not in self.common]
            reasons += [f"no {self.title(*cause)}" for cause in self.common if cause not in own]
            reasons += [self._deviation(one, robot) for one in self.parameters
                        if robot in one.odd]
            if reasons:
                found[robot] = reasons
        return found

    def title(self, effect: str, joint: int | None) -> str:
        """Effect and joint, as text."""
        where = "" if joint is None else f" at {self.joints[joint - 1]}"
        return f"{effect_title(effect)}{where}"

    def _deviation(self, one: FleetParameter, robot: str) -> str:
        value = one.variation.units[one.robots.index(robot)].value
        others = [unit.value for name, unit in zip(one.robots, one.variation.units)
                  if name != robot]
        return (f"{self.name_of(one)} {value:.3g} {one.unit}, the others "
                f"{min(others):.3g} to {max(others):.3g}")

    def name_of(self, one: FleetParameter) -> str:
        """Parameter with its effect and joint, as text."""
        owner = "" if one.effect == JOINT_MODEL else f"{effect_title(one.effect)} "
        where = "" if one.joint is None else f" at {self.joints[one.joint - 1]}"
        return f"{owner}{effect_title(one.name)}{where}"

    def __str__(self) -> str:
        shared = join_words(self.title(*cause) for cause in self.common)
        lines = [f"{len(self.robots)} units; common: {shared or 'no cause'}."]
        for where, differ, spread in (("unit to unit", "units_differ", "between_units"),
                                      ("log to log of a unit", "logs_differ", "between_logs")):
            varying = [f"{self.name_of(one)} by {getattr(one.common, spread):.2g} {one.unit}"
                       for one in self.parameters if getattr(one.common, differ)]
            if varying:
                lines.append(f"Differs from {where}: {join_words(varying)}.")
        lines += [f"Odd: {robot}: {'; '.join(reasons)}." for robot, reasons in self.odd().items()]
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """In plain types."""
        return {"robots": list(self.robots),
                "common": [{"effect": effect, "joint": joint} for effect, joint in self.common],
                "odd": self.odd(), "parameters": [one.to_dict() for one in self.parameters]}


def compare_units(answers: Mapping[str, Answer]) -> Fleet:
    """Compare the units of one robot.

    Parameters
    ----------
    answers : mapping of str to dict
        JSON answers by name of the unit, with the key ``by_log``; those that failed are left out.

    Raises
    ------
    ClieError
        If fewer than two units were diagnosed, or their joints differ.

    """
    known = {name: one for name, one in answers.items() if "by_log" in one}
    if len(known) < LEAST:
        raise ClieError(f"a fleet is compared from {LEAST} units on, and {len(known)} of "
                        f"{len(answers)} robots were diagnosed: name a folder with a folder of "
                        "logs for each unit")
    joints = _joints(known)
    causes = {name: _causes(one) for name, one in known.items()}
    counted = [cause for own in causes.values() for cause in own]
    common = tuple(cause for cause in dict.fromkeys(counted)
                   if counted.count(cause) > COMMON * len(known))
    return Fleet(tuple(known), causes, common, tuple(_parameters(known)), joints)


def _joints(answers: Mapping[str, Answer]) -> tuple[str, ...]:
    """Names of the joints, which all units must have."""
    first, *others = answers
    names = joint_names(answers[first])
    for other in others:
        if joint_names(answers[other]) != names:
            raise ClieError(
                f"--fleet compares units of one robot: {first} has the joints "
                f"{', '.join(names)} and {other} {', '.join(joint_names(answers[other]))}; "
                "diagnose other robots apart, or give their joints the same joint_names")
    return tuple(names)


def _causes(answer: Answer) -> tuple[tuple[str, int], ...]:
    """Causes that are likely, joint by joint; none of a robot without one."""
    if answer["verdict"] != "effect":
        return ()
    return tuple((row["effect"], int(joint)) for row in leading_rows(answer)
                 for joint in row["joint"] or ())


def _parameters(answers: Mapping[str, Answer]) -> list[FleetParameter]:
    by_key: dict[Key, dict[str, tuple[np.ndarray, np.ndarray]]] = {}
    for name, answer in answers.items():
        for row in answer["by_log"]:
            key = row["effect"], row["joint"], row["parameter"], row["unit"]
            by_key.setdefault(key, {})[name] = (np.array(row["value"], float),
                                                np.array(row["deviation"], float))
    shared = {key: units for key, units in by_key.items() if len(units) >= LEAST
              and all(_is_known(*one) for one in units.values())}
    varied = [variation(list(units.values())) for units in shared.values()]
    return [_parameter(key, units, one, odd)
            for (key, units), one, odd in zip(shared.items(), varied, odd_units(varied))]


def _parameter(key: Key, units: Mapping[str, tuple[np.ndarray, np.ndarray]], varies: Variation,
               odd: Sequence[int]) -> FleetParameter:
    """A parameter, and how it varies without its odd units, where others are left."""
    robots = tuple(units)
    sound = [one for k, one in enumerate(units.values()) if k not in odd]
    common = variation(sound) if odd and sound else varies
    return FleetParameter(*key, robots, varies, tuple(robots[k] for k in odd), common, units)


def _is_known(value: np.ndarray, deviation: np.ndarray) -> bool:
    """Whether the logs determine a parameter: a deviation of zero says that they do not."""
    return bool(np.isfinite(value).all() and np.isfinite(deviation).all()
                and np.all(deviation > 0.0))
