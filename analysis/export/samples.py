"""Domain randomisation: corrections drawn from what the logs leave uncertain."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from clie_blocks.analysis.export.correction import Correction
from clie_blocks.analysis.export.exported import Exported
from clie_blocks.analysis.export.isaac_events import isaac_events
from clie_blocks.analysis.export.mujoco_target import export_mujoco
from clie_blocks.effects.effect import Setting
from clie_blocks.errors import ClieError
from clie_blocks.output import to_json

BAND = (0.05, 0.95)  # quantiles of the ranges
NEVER_NEGATIVE = ("inertia", "beside_links", "damping", "gear", "gain", "torque")


@dataclasses.dataclass(frozen=True)
class Samples:
    """Corrections drawn together, so that what goes together stays together.

    Parameters
    ----------
    numbers : tuple of str
        What was drawn: ``joint.NAME.KEY`` and ``effect.PLACE.PARAMETER.JOINT``.
    values : ndarray, shape (samples, numbers)
        The draws, within the bounds of the effects.
    correlation : ndarray, shape (numbers, numbers)
        By which they were drawn.
    corrections : tuple of Correction
        One per draw.

    """

    numbers: tuple[str, ...]
    values: np.ndarray
    correlation: np.ndarray
    corrections: tuple[Correction, ...]

    def plain(self, correction: Correction) -> dict[str, Any]:
        """Ranges, correlations and draws as plain data."""
        low, high = np.quantile(self.values, BAND, axis=0)
        return {"schema_version": 1, "count": len(self.values), "quantiles": BAND,
                "numbers": [{"number": key, "meaning": _meaning(key, correction),
                             "identified": _at(correction, key), "low": low[k], "high": high[k],
                             "standard_deviation": self.values[:, k].std()}
                            for k, key in enumerate(self.numbers)],
                "correlation": self.correlation, "samples": self.values}


def draw(correction: Correction, count: int, seed: int = 0) -> Samples:
    """Draw corrections from a normal distribution around the identified one.

    Parameters
    ----------
    correction : Correction
        What was identified, with its uncertainty.
    count : int
        How many.
    seed : int
        Of the random numbers: the same seed gives the same draws.

    Raises
    ------
    ClieError
        If nothing is uncertain, or fewer than two are wanted.

    """
    uncertainty = correction.uncertainty
    numbers = tuple(uncertainty["numbers"])
    if not numbers:
        raise ClieError("the answer holds no uncertainty, so there is nothing to draw; its "
                        "parameters have no intervals, as in a diagnosis without a fit")
    if count < 2:
        raise ClieError(f"--samples {count}: two or more make a range, 64 are usual")
    covariance = np.array(uncertainty["covariance"], float)
    centre = np.array([_at(correction, key) for key in numbers])
    low, high = np.transpose([_bounds(correction, key) for key in numbers])
    drawn = np.random.default_rng(seed).multivariate_normal(centre, covariance, count,
                                                            method="eigh")
    values = np.clip(drawn, low, high)
    spread = np.sqrt(np.diag(covariance))
    return Samples(numbers, values, covariance / np.outer(spread, spread),
                   tuple(_with(correction, numbers, row) for row in values))


def with_samples(exported: Exported, correction: Correction, samples: Samples,
                 model: Any = None, renamed: Mapping[str, str] | None = None,
                 step: float | None = None) -> Exported:
    """Return an export with the samples.

    They are JSON, of MuJoCo also a model each, and of Isaac Lab an event term that draws them.
    """
    files = {**exported.files, "samples.json": to_json(samples.plain(correction))}
    notes = exported.notes
    if exported.target == "isaac":
        files["corrected_events.py"], told = isaac_events(
            correction.renamed(renamed or {}),
            [one.renamed(renamed or {}) for one in samples.corrections],
            correction.period if step is None else step)
        notes = (*notes, *told)
    if exported.target == "mujoco":
        for place, one in enumerate(samples.corrections):
            found = export_mujoco(one, model, renamed)
            files |= {f"samples/{place:03d}/{name}": content
                      for name, content in found.files.items()
                      if not name.endswith((".original.xml", ".diff"))}
    return dataclasses.replace(exported, files=files, notes=notes)


def _at(correction: Correction, key: str) -> float:
    """Identified value of a number."""
    kind, rest = key.split(".", 1)
    if kind == "joint":
        name, field = rest.rsplit(".", 1)
        return float(getattr(correction.joints[correction.index(name)], field))
    place, parameter, k = rest.split(".")
    return float(np.ravel(correction.effects[int(place)].values[parameter])[int(k)])


def _bounds(correction: Correction, key: str) -> tuple[float, float]:
    if key.startswith("joint."):
        return (0.0 if key.rsplit(".", 1)[1] in NEVER_NEGATIVE else -np.inf), np.inf
    _, place, name, _ = key.split(".")
    parameter = next(one for one in correction.effects[int(place)].effect.parameters
                     if one.name == name)
    return parameter.lower, parameter.upper


def _meaning(key: str, correction: Correction) -> str:
    """A number in words."""
    kind, rest = key.split(".", 1)
    if kind == "joint":
        name, field = rest.rsplit(".", 1)
        return f"{field} of {name}, joint side"
    place, parameter, k = rest.split(".")
    setting = correction.effects[int(place)]
    unit = next(one.unit for one in setting.effect.parameters if one.name == parameter)
    count = np.size(setting.values[parameter])
    where = f" at {correction.names[int(k)]}" if count == len(correction.joints) else ""
    return f"{parameter} of {setting.name}{where}, in the model [{unit}]"


def _with(correction: Correction, numbers: Sequence[str], row: np.ndarray) -> Correction:
    """Correction with other numbers."""
    joints = {joint.name: joint for joint in correction.joints}
    values = [{key: np.array(value, float) for key, value in one.values.items()}
              for one in correction.effects]
    for key, value in zip(numbers, row, strict=True):
        kind, rest = key.split(".", 1)
        if kind == "joint":
            name, field = rest.rsplit(".", 1)
            changed: dict[str, Any] = {field: float(value)}
            joints[name] = dataclasses.replace(joints[name], **changed)
        else:
            place, parameter, k = rest.split(".")
            values[int(place)][parameter].reshape(-1)[int(k)] = value
    return dataclasses.replace(
        correction, joints=tuple(joints.values()),
        effects=tuple(Setting(one.effect, chosen, one.joints, one.name)
                      for one, chosen in zip(correction.effects, values, strict=True)))
