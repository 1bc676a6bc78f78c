"""Every runner on the CASE 2 loop of the paper, and what ours costs: one command, one document.

    python benchmarks/compare.py            writes docs/benchmarks.md
    python benchmarks/compare.py -o FILE

Runners that are not installed are left out: numba, casadi, pathsim, bdsim, drake and jaxonomy are
compared with, never needed.
"""

import argparse
import functools
import importlib
import os
import platform
import subprocess
import tempfile
import time
import types
from collections.abc import Sequence
from importlib import metadata
from typing import Any

import control as ct
import handwritten
import loop
import numpy as np
import scaling
from handwritten import CProgram
from timing import Job, interleaved, markdown, ratio, seconds

from clie_blocks import paper
from clie_blocks.compiled import Program, compile_diagram, reduce
from clie_blocks.output import run_main, write

STEPS, SLOW_STEPS, RUNS = 50_000, 50, 64
PEERS = ("numba", "casadi", "pathsim", "bdsim", "drake", "jaxonomy")
C, OURS = "C by hand", "**compiled diagram, one set**"


def importable(name: str) -> types.ModuleType | None:
    """Return a module, or None where it or what it needs is missing."""
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


def python_control(diagram: ct.NonlinearIOSystem, steps: int) -> ct.TimeResponseData:
    """Run python-control's own runner at our step, without noise: it cannot hold it."""
    times = np.arange(steps + 1) * loop.STEP
    return adaptive(diagram, times, "RK45", first_step=loop.STEP, max_step=loop.STEP, rtol=1e30,
                    atol=1e30)


def adaptive(diagram: ct.NonlinearIOSystem, times: np.ndarray, method: str,
             **options: float) -> ct.TimeResponseData:
    """Run python-control's own runner without noise."""
    drive = np.vstack([np.tile(loop.Q_D[:, None], len(times)),
                       np.tile(loop.paper_excitation(times), (2, 1)), np.zeros((2, len(times)))])
    return ct.input_output_response(diagram, times, drive, solve_ivp_method=method,
                                    t_eval=times[[0, -1]], solve_ivp_kwargs=options)


def quick_jobs(program: Program, c: CProgram, noise: np.ndarray) -> dict[str, Job]:
    """Return the runners that are near C, by name."""
    duration = STEPS * loop.STEP
    gamma, b = np.geomspace(1, 100, RUNS), np.linspace(0.8, 1.2, RUNS)[:, None]
    sets = {"update.gamma": gamma, "plant.b": b * paper.THETA.reshape(3, 2)[1]}
    call: dict[str, Any] = {
        "step": loop.STEP, "inputs": loop.inputs(noise), "params": sets, "threads": 1}
    error = {"error": reduce.mean_square("plant.q", minus="model.q", start=0.5)}
    jobs = {
        C: lambda: handwritten.simulate(c, noise, loop.Q_D, loop.STEP, loop.EVERY),
        OURS: lambda: loop.run(program, noise),
        f"**batch of {RUNS}, per set**": lambda: program.batch(
            duration, log=[], every=100, **call),
        "**the same, mean square error of every step**": lambda: program.batch(
            duration, reduce=error, **call),
        "**derivatives, 13 parameters**": lambda: program.sensitivities(
            "*", duration, loop.STEP, inputs=loop.inputs(noise), every=loop.EVERY),
        "**run with stop conditions**": lambda: program.run(
            duration, loop.STEP, inputs=loop.inputs(noise), every=loop.EVERY,
            stop={"plant.q": (-9, 9)})}
    if numba_loop := importable("numba_loop"):
        jobs["numba by hand"] = lambda: numba_loop.simulate(noise)
    if casadi_loop := importable("casadi_loop"):
        jobs["CasADi graph, its virtual machine"] = functools.partial(
            casadi_loop.simulator(len(noise)), noise)
    if jaxonomy_loop := importable("jaxonomy_loop"):
        jobs["Jaxonomy by hand, no noise"] = jaxonomy_loop.simulator(len(noise))
    return jobs


def slow_jobs(diagram: ct.NonlinearIOSystem) -> dict[str, Job]:
    """Return the runners that take seconds per millisecond, by name; without noise."""
    still, plain = np.zeros((SLOW_STEPS, 2)), compile_diagram(diagram, "python")
    jobs = {"**compiled to plain Python**": lambda: loop.run(plain, still),
            "python-control, fixed step": lambda: python_control(diagram, SLOW_STEPS)}
    for name in ("pathsim", "bdsim", "drake"):
        if peer := importable(f"{name}_loop"):
            jobs[f"{name}, fixed step"] = functools.partial(
                peer.simulator(diagram), SLOW_STEPS)
    return jobs


def fixed_step(diagram: ct.NonlinearIOSystem, program: Program, c: CProgram, repeats: int) -> str:
    """Return the table of runners at the paper's step."""
    jobs = quick_jobs(program, c, loop.noise_rows(STEPS))
    times = interleaved(jobs, repeats)
    rows, milliseconds = [], 1e3 * np.median(times[C]) / (STEPS * loop.STEP)
    for name in jobs:
        share = RUNS if "batch" in name or "the same" in name else 1
        middle, low, high = (value / share for value in ratio(times, name, C))
        rows.append([name, f"{middle:.2f}", f"{low:.2f} to {high:.2f}"])
    slow = interleaved(slow_jobs(diagram) | {C: jobs[C]}, 3)
    for name in slow:
        if name != C:
            scale = STEPS / SLOW_STEPS
            middle, low, high = (scale * value for value in ratio(slow, name, C))
            rows.append([name, f"{middle:,.0f}", f"{low:,.0f} to {high:,.0f}"])
    return (markdown(["runner", "x C", "least to most"], rows)
            + f"\n\nC takes {milliseconds:.2f} ms per simulated second.")


def equal_error(diagram: ct.NonlinearIOSystem, program: Program, duration: float = 2.0) -> str:
    """Return the table of runners that may choose their steps, without noise."""
    fine = program.run(duration, 1e-4, inputs=loop.inputs(np.zeros(2)), every=1000)
    scale = np.max(np.abs(fine.states), axis=1)
    grid = np.arange(0, duration + 1e-4, 2.5e-4)  # python-control interpolates between input rows

    def theirs(system: ct.NonlinearIOSystem, method: str, tolerance: float) -> Job:
        return lambda: adaptive(system, grid, method, rtol=tolerance, atol=1e-2 * tolerance)

    def ours(step: float) -> Job:
        return lambda: program.run(duration, step, inputs=loop.inputs(np.zeros(2)),
                                   every=round(duration / step))

    flat = program.as_nlsys()
    runners = {f"python-control, {method} {tolerance:g}": theirs(diagram, method, tolerance)
               for method in ("LSODA", "RK45") for tolerance in (1e-6, 1e-8)}
    runners |= {f"**as_nlsys() in python-control, LSODA {tolerance:g}**":
                theirs(flat, "LSODA", tolerance) for tolerance in (1e-6, 1e-8)}
    runners |= {f"**ode5, {1e3 * step:g} ms**": ours(step) for step in (4e-3, 2e-3, 1e-4)}
    rows = []
    for name, job in runners.items():
        error = np.max(np.abs(job().states[:, -1] - fine.states[:, -1])
                       / np.where(scale > 0, scale, 1.0))
        taken = np.median([seconds(job) for _ in range(3)])
        rows.append([name, f"{1e3 * taken / duration:,.2f}", f"{error:.0e}"])
    return markdown(["runner", "ms per simulated s", "error at the end"], rows)


def threads_table(program: Program) -> str:
    """Return the table of threads: the least time on the wall, when most cores were free."""
    noise = loop.noise_rows(10_000)
    call: dict[str, Any] = {
        "step": loop.STEP, "inputs": loop.inputs(noise), "log": [], "every": 100,
        "params": {"update.gamma": np.geomspace(1, 100, RUNS)}}
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (
        os.cpu_count() or 1)
    times = interleaved({count: functools.partial(program.batch, 1.0, threads=count, **call)
                         for count in sorted({1, 2, cores})}, 100, time.perf_counter)
    rows = [[count, f"{1e3 * min(taken) / RUNS:.3f}", f"{min(times[1]) / min(taken):.2f}"]
            for count, taken in times.items()]
    return markdown(["threads", "ms per set and simulated s, on the wall", "gain"], rows)


def versions() -> str:
    """Return what the figures belong to."""
    packages = []
    for name in ("control", "numpy", "scipy", "llvmlite", *PEERS):
        try:
            packages.append(f"{name} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            packages.append(f"{name} not installed")
    compiler = subprocess.run([handwritten.compiler(), "--version"], capture_output=True,
                              text=True, check=True).stdout.splitlines()[0]
    load = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"
    return (f"Python {platform.python_version()}, {', '.join(packages)}; {compiler} "
            f"{' '.join(handwritten.FLAGS)}; {_processor()}, {os.cpu_count()} cores, load {load} "
            "while measuring.")


def _processor() -> str:
    try:
        with open("/proc/cpuinfo") as file:
            return next(line.split(":")[1].strip() for line in file if "model name" in line)
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def document(repeats: int) -> str:
    """Measure everything and return the document."""
    diagram = loop.diagram()
    program, c_folder = compile_diagram(diagram), tempfile.TemporaryDirectory()
    with c_folder as folder:
        c = handwritten.build(folder)
        noise = loop.noise_rows(STEPS)
        ours, by_hand = loop.run(program, noise), handwritten.simulate(
            c, noise, loop.Q_D, loop.STEP, loop.EVERY)
        difference = np.max(np.abs(ours.states.T - by_hand))
        fixed = fixed_step(diagram, program, c, repeats)
    return TEXT.format(
        states=diagram.nstates, step=loop.STEP * 1e3, difference=difference, fixed=fixed,
        repeats=repeats, slow=SLOW_STEPS, equal=equal_error(diagram, program),
        threads=threads_table(program), durations=scaling.durations(program),
        blocks=scaling.sizes("blocks", (10, 20, 50, 100, 200), scaling.chain),
        joints=scaling.sizes("joints", (1, 2, 5, 10, 20, 50), scaling.joints),
        versions=versions())


TEXT = """\
# Benchmarks

Written by `python benchmarks/compare.py`; do not edit.

The CASE 2 loop of the paper: {states} states, Dormand-Prince at {step:g} ms.  Bold rows are this
package.  Times are those of the processor; every ratio is the median over {repeats} repeats taken
in turn with C, so that a busy machine slows all alike.

## The same fixed step, held noise

{fixed}

C and the compiled diagram differ by at most {difference:.0e} in any state.  Plain Python,
python-control, PathSim, bdsim and Drake take {slow} steps, three times, without noise: most of
them cannot hold a noise sample over a step.  Jaxonomy takes all steps, without noise too.

## Free choice of steps, no noise

{equal}

## Threads

{threads}

The least of 100 repeats, for a thread gains only what other work leaves of its core.

## Duration and memory

{durations}

## Number of blocks

A chain of nonlinear first-order blocks.

{blocks}

## Number of joints

The CLIE loop of the paper's Fig. 2 with law (27) for decoupled joints.

{joints}

## Versions

{versions}
"""


def main(argv: Sequence[str] | None = None) -> None:
    """Measure and write the document."""
    options = argparse.ArgumentParser(description=__doc__,
                                      formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("-o", "--output", default="docs/benchmarks.md", metavar="FILE")
    options.add_argument("--repeats", type=int, default=7)
    arguments = options.parse_args(argv)
    start = time.perf_counter()
    path = write(arguments.output, document(arguments.repeats))
    print(f"{path}  ({time.perf_counter() - start:.0f} s)")


if __name__ == "__main__":
    run_main(main)
