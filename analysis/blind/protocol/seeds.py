"""Which robots were used for what: those that report are none of those that trained."""

import json
from collections.abc import Sequence
from importlib import resources
from typing import Any

# seeds of `clie blind` on which the method was developed; those of two digits, and from 10001 on,
# were published before they were opened for it
DEVELOPMENT_SEEDS = (
    range(41, 46), range(51, 56), range(61, 66), range(71, 76), range(1000, 10000),
    range(10001, 10003), range(10004, 10006))
# of studies that were published, and opened since
OPENED_SEEDS = (22469, 29531, 34141, 38207, 46271, 47123, 48611, 52931, 53617, 55127, 55811,
                57037, 58231, 63719, 64901, 66587, 67421, 68903, 71203, 74687, 75941, 76819, 83117,
                86413, 88069, 91733)
OWN_ENGINE = "own_robots"  # the engine of the calibration, which no blind trial comes from
CALIBRATED = "thresholds and probability map"


def training_sources() -> list[tuple[str, str, str, str]]:
    """Return what thresholds and maps were learned from, as rows of use, engine, robots, seeds."""
    facts = _calibration_facts()
    rows = [("development of the method", "MuJoCo", "-",
             ", ".join([*map(_span, DEVELOPMENT_SEEDS), *map(str, OPENED_SEEDS)]))]
    if facts:
        rows.append((CALIBRATED, OWN_ENGINE, str(facts["robots"]), str(facts["seed"])))
    if calibration_seeds():
        rows.append((CALIBRATED, "MuJoCo", str(facts["trials"]),
                     ", ".join(map(str, calibration_seeds()))))
    return rows


def _span(seeds: range) -> str:
    """First and last seed of a range."""
    return f"{seeds.start} to {seeds.stop - 1}" if len(seeds) > 1 else str(seeds.start)


def calibration_seeds() -> list[int]:
    """Return the seeds of `clie blind` whose opened trials trained the calibration."""
    return _calibration_facts().get("seeds", [])


def are_fresh(seeds: Sequence[int]) -> bool:
    """Whether no seed of a study made robots that the method or its calibration has seen."""
    seen = (*DEVELOPMENT_SEEDS, OPENED_SEEDS, calibration_seeds())
    return not any(seed in used for seed in seeds for used in seen)


def were_opened(seeds: Sequence[int]) -> bool:
    """Whether a study was published before its robots were looked at, as they were since."""
    return set(seeds) <= set(OPENED_SEEDS)


def _calibration_facts() -> dict[str, Any]:
    """Return what the stored calibration says of its origin; nothing if it was set by hand."""
    path = resources.files("clie_blocks.analysis.gap.method").joinpath("method.json")
    return json.loads(path.read_text()) if path.is_file() else {}
