"""What a diagnosis costs: seconds per stage, against samples and effects, memory, and a peer.

    python benchmarks/diagnosis.py            writes docs/diagnosis_speed.md
    python benchmarks/diagnosis.py -o FILE

Every diagnosis is a process of its own on one core, from start-up to answer.
"""

import dataclasses
import json
import os
import platform
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import arm
import numpy as np
from timing import markdown, write_page

from clie_blocks import gap
from clie_blocks.analysis.gap.causes.vocabulary import searched_effects
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.stages import STAGES
from clie_blocks.output import run_main

SECONDS = 30.0
ONE_CORE = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")}
WATCHED = {  # labels of the stages, by name in `Stages`, `ExplainSteps` and `SearchSteps`
    "check_controller": "controller check", "fit_nominal": "nominal model",
    "screen": "screening", "singles": "single causes: events, orders, joints", "pairs": "pairs",
    "screen_residual": "screening of the residual", "race": "fits by simulation",
    "fit_numbers": "parameters outside their tolerance",
    "drive_gains": "gains of drives",
    "prune": "pruning of idle joints", "prune_joints": "pruning of idle joints",
    "refine_to_prior": "MAP refinement", "lack_of_fit": "test of lack of fit",
    "explain_backlash": "backlash check", "gap_reduction": "gap reduction",
    "torque_map": "torque map", "localise": "localisation",
    "next_experiment": "next experiment"}
FIRST = (
    "actuator_lag", "actuator_saturation", "asymmetric_coulomb", "backlash", "coulomb", "coupling",
    "dead_zone", "encoder_eccentricity", "encoder_quantization", "friction_drift", "gravity",
    "joint_elasticity", "load_dependent_friction", "payload", "periodic_disturbance", "presliding",
    "quadratic_drag", "spring", "step_fault", "stribeck", "time_delay", "torque_gain_error",
    "torque_ripple", "velocity_filter_mismatch")


class Stopwatch:
    """Times of the stages of a diagnosis, each without the stages that it calls."""

    def __init__(self):
        self.seconds, self._inner = {}, [0.0]

    def watched(self, name, stage):
        """Return a stage that adds its time under a name."""
        def run(*args, **kwargs):
            start = time.process_time()
            self._inner.append(0.0)
            result = stage(*args, **kwargs)
            whole, inner = time.process_time() - start, self._inner.pop()
            self._inner[-1] += whole
            self.seconds[name] = self.seconds.get(name, 0.0) + whole - inner
            return result
        return run


def watched(stages, watch):
    """Return a dataclass of stage functions in which each one that has a label is timed."""
    return dataclasses.replace(stages, **{
        field.name: watch.watched(WATCHED[field.name], getattr(stages, field.name))
        for field in dataclasses.fields(stages) if field.name in WATCHED})


def diagnose(folder, effects=()):
    """Diagnose a trial with some effects, or all; return seconds, stages, memory, answer."""
    watch = Stopwatch()
    steps = watched(dataclasses.replace(STAGES.steps, search=watched(STAGES.steps.search, watch)),
                    watch)
    stages = watched(dataclasses.replace(STAGES, steps=steps), watch)
    started = time.process_time()
    problem = watch.watched("reading", gap.read)(folder)
    found = gap.diagnose(problem, effects=effects, stages=stages)
    return {"start-up": started, "stages": watch.seconds, "seconds": time.process_time(),
            "memory": peak_memory(),
            "answer": " + ".join(found.ranking[0].names)}


def peak_memory():
    """Return the most memory this process ever held [MB], where the system tells.

    Not ``ru_maxrss``: that one a new process takes over from the one that started it.

    """
    status = Path("/proc/self/status")
    said = re.search(r"VmHWM:\s+(\d+)", status.read_text()) if status.exists() else None
    return int(said[1]) / 1024 if said else float("nan")


def apart(folder, effects=(), cache=None):
    """Return what `diagnose` says in a process of its own."""
    code = (f"import json, diagnosis; from pathlib import Path; "
            f"print(json.dumps(diagnosis.diagnose(Path({str(folder)!r}), {effects!r})))")
    surroundings = {**os.environ, **ONE_CORE}
    surroundings.pop("PYTHONDONTWRITEBYTECODE", None)  # an installed package has its bytecode
    if cache:
        surroundings |= {"CLIE_BLOCKS_CACHE": str(cache),
                         "PYTHONPYCACHEPREFIX": str(cache / "bytecode")}
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", code], env=surroundings,
                          cwd=Path(__file__).parent, check=True, capture_output=True, text=True)
    return json.loads(done.stdout.splitlines()[-1])


def stages(folder, seconds):
    """Return a table of the stages of three kinds of robot, and the least memory they need."""
    found, programs = {}, folder / "programs"
    for fault in arm.FAULTS:
        place = folder / fault.replace(" ", "-")
        place.mkdir()
        arm.write_trial(place, seconds, fault)
        found[fault] = apart(place, cache=programs), apart(place, cache=programs)
    rows = [["first run ever", *(f"{cold['seconds']:.1f}" for cold, _ in found.values())],
            ["**every further run**", *(f"**{warm['seconds']:.1f}**"
                                        for _, warm in found.values())],
            ["start-up", *(f"{warm['start-up']:.2f}" for _, warm in found.values())]]
    for name in ["reading", *dict.fromkeys(WATCHED.values())]:
        rows.append([name, *(f"{warm['stages'].get(name, 0.0):.2f}"
                             for _, warm in found.values())])
    rows.append(["sets of three causes and more, and all else", *(
        f"{warm['seconds'] - warm['start-up'] - sum(warm['stages'].values()):.2f}"
        for _, warm in found.values())])
    rows += [["peak memory, MB", *(f"{warm['memory']:.0f}" for _, warm in found.values())],
             ["answer", *(warm["answer"] for _, warm in found.values())]]
    return markdown(["processor time, s", *arm.FAULTS], rows)


def growth(folder, seconds, fault="one effect"):
    """Return a table of seconds and memory against samples, and against effects."""
    rows = []
    for times, effects in ((1, ()), (2, ()), (4, ()), (2, FIRST)):
        place = folder / f"times-{times}"
        if not place.is_dir():
            place.mkdir()
            arm.write_trial(place, times * seconds, fault)
        for _ in range(2):  # the first run compiles
            found = apart(place, effects, folder / "programs")
        work = found["seconds"] - found["start-up"]
        rows.append([f"3 x {times * seconds:g} s", str(len(effects) or len(searched_effects())),
                     f"{found['seconds']:.1f}", f"{work:.1f}", f"{work / times:.1f}",
                     f"{found['memory']:.0f}"])
    return markdown(["logs", "effects", "s", "s without start-up", "the same per 3 x "
                     f"{seconds:g} s", "peak memory, MB"], rows)


def peer(folder, seconds):
    """Return a table: the joint model alone, fitted by us and by python-control with scipy."""
    from clie_blocks.analysis.gap.fitting.hypothesis import build_hypothesis
    from clie_blocks.analysis.gap.fitting.nominal import fit_nominal

    place = folder / "peer"
    place.mkdir()
    arm.write_trial(place, seconds, "one effect")
    asked = gap.read(place)
    fit_nominal(asked, METHOD)
    start = time.process_time()
    fit_nominal(asked, METHOD)
    ours = time.process_time() - start
    start = time.process_time()
    found = python_control_fit(asked, build_hypothesis(asked, ()))
    theirs = time.process_time() - start
    return markdown([f"fit of the joint model, logs of {seconds:g} s", "s"],
                    [["input_output_response with least_squares, two logs", f"{theirs:.1f}"],
                     ["ours, twice, with the noise model, validated on the third log",
                      f"{ours:.3f}"],
                     ["ratio", f"{theirs / ours:,.0f}"],
                     ["simulations of the peer", found.nfev + found.njev * len(found.x)]])


def python_control_fit(asked, at):
    """Closed-loop output error of the joint model with python-control's own runner."""
    from scipy.optimize import least_squares

    names = "inertia", "damping", "load"
    size = np.concatenate([np.maximum(np.abs(at.values[name]), 0.1) for name in names])

    def error(x):
        values = dict(zip(names, (x * size).reshape(3, -1)))
        return np.concatenate([simulated(at, log, values) - log.q.T
                               for log in asked.fit], axis=1).ravel() / arm.NOISE

    start = np.concatenate([at.values[name] for name in names]) / size
    return least_squares(error, start, max_nfev=5)


def simulated(at, log, values):
    """Return the positions (n, N) that python-control's own runner gives for a log."""
    import control as ct

    block, n = at.simulator.block.system, at.problem.n
    time = at.problem.period * np.arange(len(log))
    still = np.zeros((n, len(log)))
    start = np.zeros(block.nstates)
    start[at.simulator.block.layout.slices["q"]] = log.start
    return ct.input_output_response(
        block, time, np.vstack([log.q_d.T, log.pe.T, still]), start,
        params={**at.of_log(0), **values, "start": log.start, "first": still[:, 0]}).outputs[:n]


def document(seconds=SECONDS, peer_seconds=1.0):
    """Return the page."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        parts = [stages(folder, seconds), growth(folder, seconds / 2), peer(folder, peer_seconds)]
    return PAGE.format(seconds=seconds, rate=arm.RATE, stages=parts[0], growth=parts[1],
                       peer=parts[2], machine=machine(), load=load(),
                       leaders=METHOD.search.leaders,
                       python=platform.python_version())


def load():
    """Say how busy the machine is: work beside it takes caches and shared cores."""
    cores, busy = os.cpu_count(), os.getloadavg()[1]
    return (f"The machine has {cores} cores and a load of {busy:.0f}" + (
        ": other programs ran, which makes these times longer." if busy > 1.5 else "."))


def machine():
    """Name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.machine()


PAGE = """\
# Computing time of a diagnosis

Written by `python benchmarks/diagnosis.py`; do not edit.

A two-link arm with known gravity and coupling, three logs of {seconds:g} s at {rate} Hz, the whole
library.  Each diagnosis is a separate process on one core of {machine},
Python {python}; seconds are those of the processor, from start-up to answer.  The logs come from
the simulator of the diagnosis itself, so they do not measure its accuracy.
{load}

## Stages

{stages}

The first run compiles the programs of the hypotheses; later runs read them from disk.  Second and
third causes are fitted only if they are predicted to remove a fair share of the remaining excess;
the events and orders that are sought anew in what each leading fit leaves cost most there.

## Samples, effects and memory

{growth}

The fewer effects are those with which the diagnosis began.  It fits the best {leaders} of them
whatever their number, so that with more of them only the search before becomes slower.

## A peer

The same sampled loop, joint model alone, with python-control's `input_output_response` inside
scipy's `least_squares`, limited to five evaluations of the Jacobian.

{peer}
"""


def main(argv=None):
    """Write the page."""
    write_page(__doc__, "diagnosis_speed.md", document, argv)


if __name__ == "__main__":
    run_main(main)
