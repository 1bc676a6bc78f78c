"""Which robots were used for what: those that report are none of those that taught."""

import json
from importlib import resources

# seeds of `clie blind` on which the method was developed; those of two digits were published
DEVELOPED = (
    range(41, 46), range(51, 56), range(61, 66), range(71, 76), range(1000, 10000))
OWN = "own_robots"  # the engine of the calibration, which no blind trial comes from
LEARNED = "thresholds and probability map"


def taught():
    """Return what thresholds and maps were learned from, as rows of use, engine, robots, seeds."""
    told = _told()
    rows = [("development of the method", "MuJoCo", "-",
             ", ".join(f"{seeds.start} to {seeds.stop - 1}" for seeds in DEVELOPED))]
    if told:
        rows.append((LEARNED, OWN, str(told["robots"]), str(told["seed"])))
    if learned():
        rows.append((LEARNED, "MuJoCo", str(told["trials"]), ", ".join(map(str, learned()))))
    return rows


def learned():
    """Return the seeds of `clie blind` whose opened trials taught the calibration."""
    return _told().get("seeds", [])


def disjoint(seeds):
    """Whether no seed of a study made robots that the method or its calibration has seen."""
    seen = (*DEVELOPED, learned())
    return not any(seed in some for seed in seeds for some in seen)


def _told():
    """What the calibration says of itself; empty where the numbers are those set by hand."""
    path = resources.files("clie_blocks.analysis.gap.method").joinpath("method.json")
    return json.loads(path.read_text()) if path.is_file() else {}
