"""The CASE 2 loop at 0.1 ms with ode5: compiled, hand-written C, python-control's own runner.

One command prints one table; every figure is a median of repeats taken in turn, so that a busy
machine slows all of them alike.  The results are compared before they are timed.
"""

import argparse
import os
import platform
import statistics
import subprocess
import tempfile
import time

import control as ct
import handwritten
import llvmlite
import numpy as np

from clie_blocks import paper
from clie_blocks.compiled import compile_diagram
from clie_blocks.diagrams.paper_experiment import Experiment
from clie_blocks.excitation import paper_excitation

Q_D = np.array(paper.SET_POINT)
EVERY = 100


def diagram():
    """Return the 22-state loop: linear plant, PD on measured signals, composite law."""
    return Experiment(case=2, plant="linear", velocity="measured").diagram()


def noise_rows(steps):
    """Return one row of position noise per step."""
    return np.random.default_rng(0).normal(0, np.sqrt(paper.NOISE_VARIANCE), (steps, 2))


def run_compiled(program, noise):
    """Run the compiled diagram over all rows of noise."""
    return program.run(len(noise) * paper.STEP, step=paper.STEP, every=EVERY,
                       inputs={"q_d": Q_D, "pe": paper_excitation, "noise": noise})


def run_python_control(loop, steps):
    """Run python-control's own runner at the same step, without noise: it cannot hold it."""
    times = np.arange(steps + 1) * paper.STEP
    drive = np.vstack([np.tile(Q_D[:, None], len(times)),
                       np.tile(paper_excitation(times), (2, 1)), np.zeros((2, len(times)))])
    return ct.input_output_response(
        loop, times, drive, solve_ivp_method="RK45", t_eval=times[::EVERY],
        solve_ivp_kwargs={"rtol": 1e30, "atol": 1e30, "first_step": paper.STEP,
                          "max_step": paper.STEP})


def seconds(job):
    """Return how long a job takes, in time of the processor alone."""
    start = time.process_time()
    job()
    return time.process_time() - start


def interleaved(jobs, repeats):
    """Return the times of several jobs, taken in turn."""
    times = {name: [] for name in jobs}
    for _ in range(repeats):
        for name, job in jobs.items():
            times[name].append(seconds(job))
    return times


def compile_times(loop, repeats):
    """Return cold and cached compile times, each with a fresh cache folder."""
    cold, cached = [], []
    for _ in range(repeats):
        with tempfile.TemporaryDirectory() as folder:
            os.environ["CLIE_BLOCKS_CACHE"] = folder
            cold.append(seconds(lambda: compile_diagram(loop)))
            cached.append(seconds(lambda: compile_diagram(loop)))
    return cold, cached


def table(times, steps, slow_steps):
    """Return the Markdown table of times per simulated second."""
    quick = ("hand-written C", "compiled diagram")
    scale = {name: 1 / ((steps if name in quick else slow_steps) * paper.STEP) for name in times}
    c = statistics.median(times["hand-written C"]) * scale["hand-written C"]
    lines = ["| runner | ms per simulated s | least to most | x hand-written C | x compiled |",
             "|---|---|---|---|---|"]
    ours = statistics.median(times["compiled diagram"]) * scale["compiled diagram"]
    for name, measured in times.items():
        each = [1e3 * value * scale[name] for value in measured]
        middle = statistics.median(each)
        lines.append(f"| {name} | {middle:,.3f} | {min(each):,.3f} to {max(each):,.3f} | "
                     f"{middle / c / 1e3:,.2f} | {middle / ours / 1e3:,.1f} |")
    return "\n".join(lines)


def versions():
    """Return the versions that the figures belong to."""
    compiler = subprocess.run([handwritten.compiler(), "--version"], capture_output=True,
                              text=True, check=True).stdout.splitlines()[0]
    return (f"Python {platform.python_version()}, control {ct.__version__}, numpy "
            f"{np.__version__}, llvmlite {llvmlite.__version__}, {compiler} "
            f"{' '.join(handwritten.FLAGS)}, {platform.machine()}")


def main():
    """Measure and print the table."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--duration", type=float, default=10.0, help="simulated time [s]")
    options.add_argument("--repeats", type=int, default=11)
    options.add_argument("--slow-steps", type=int, default=200,
                         help="steps of python-control's own runner")
    chosen = options.parse_args()
    steps = round(chosen.duration / paper.STEP)
    loop, noise = diagram(), noise_rows(steps)
    cold, cached = compile_times(loop, 3)
    with tempfile.TemporaryDirectory() as folder:
        c, program = handwritten.build(folder), compile_diagram(loop)
        ours = run_compiled(program, noise)
        by_hand = handwritten.simulate(c, noise, Q_D, paper.STEP, EVERY)
        difference = np.max(np.abs(ours.states.T - by_hand))
        times = interleaved({
            "hand-written C": lambda: handwritten.simulate(c, noise, Q_D, paper.STEP, EVERY),
            "compiled diagram": lambda: run_compiled(program, noise),
        }, chosen.repeats)
        quiet = run_compiled(program, np.zeros((chosen.slow_steps, 2)))
        theirs = run_python_control(loop, chosen.slow_steps)
        away = np.max(np.abs(theirs.states[:, -1] - quiet.states[:, -1]))
        plain = compile_diagram(loop, "python")
        still = np.zeros((chosen.slow_steps, 2))
        times |= interleaved({
            "compiled to plain Python": lambda: run_compiled(plain, still),
            "python-control": lambda: run_python_control(loop, chosen.slow_steps),
        }, 3)
    print(f"CASE 2 loop, {loop.nstates} states, ode5 at {paper.STEP * 1e3:g} ms, "
          f"{chosen.duration:g} s, median of {chosen.repeats} (plain Python, "
          f"python-control: {chosen.slow_steps} steps, 3)\n")
    print(table(times, steps, chosen.slow_steps))
    print(f"\nLargest difference: C {difference:.1e}, python-control {away:.1e} (without noise; "
          "its inputs are interpolated, so noise would be another signal)")
    print(f"Compile: cold {statistics.median(cold):.3f} s, cached "
          f"{1e3 * statistics.median(cached):.1f} ms")
    print(versions())


if __name__ == "__main__":
    main()
