"""Which robots were used for what: those that report are none of those that taught."""

import json
from importlib import resources

DEVELOPED = range(1000, 4000)  # seeds of `clie blind` on which the method was developed
OWN = "own_robots"  # the engine of the calibration, which no blind trial comes from


def taught():
    """Return what thresholds and maps were learned from, as rows of use, engine, robots, seeds."""
    rows = [("development of the method", "MuJoCo", "-",
             f"{DEVELOPED.start} to {DEVELOPED.stop - 1}")]
    path = resources.files("clie_blocks.analysis.gap").joinpath("calibration.json")
    if path.is_file():
        told = json.loads(path.read_text())
        rows.append(("thresholds and probability map", OWN, str(told["robots"]),
                     str(told["seed"])))
        rows += [("thresholds and probability map", "MuJoCo", "-", f"{study}, of these seeds")
                 for study in told.get("studies", ())]
    return rows


def disjoint(seeds):
    """Whether no seed of a study made robots that the method or its calibration has seen."""
    return not any(seed in DEVELOPED for seed in seeds)
