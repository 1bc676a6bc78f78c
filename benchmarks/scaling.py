"""What a run costs: against the number of blocks, of joints, the duration, and to compile."""

import os
import statistics
import tempfile
import time
import tracemalloc
from collections.abc import Callable, Sequence
from typing import Any

import control as ct
import loop
import numpy as np
from timing import markdown, seconds

from clie_blocks.compiled import Program, compile_diagram
from clie_blocks.diagrams.clie_loop import clie_loop
from clie_blocks.joints import decoupled_joints
from clie_blocks.signals import Diagram, interconnect

STEPS = 10_000
POINTS = 30


def chain(count: int) -> Diagram:
    """Return so many nonlinear first-order blocks in a row."""
    blocks = [ct.nlsys(lambda t, x, u, params: u - np.tanh(x), lambda t, x, u, params: x,
                       name=f"lag_{k}", states=1, inputs=["u"], outputs=["y"])
              for k in range(count)]
    wires = [(f"lag_{k + 1}.u", f"lag_{k}.y") for k in range(count - 1)]
    return interconnect(blocks, wires, inputs={"u": "lag_0.u"},
                        outputs={"y": f"lag_{count - 1}.y"}, name="chain")


def joints(count: int) -> Diagram:
    """Return the CLIE loop (27) of so many decoupled joints."""
    one = np.ones(count)
    return clie_loop(decoupled_joints(2 * one, 0.5 * one, 0.1 * one), 10 * one, 2 * one, 1.0,
                     velocity="exact")


def compile_times(build: Diagram) -> list[float]:
    """Return cold and cached compile times, in a fresh cache folder."""
    before = os.environ.get("CLIE_BLOCKS_CACHE")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["CLIE_BLOCKS_CACHE"] = folder
        try:
            return [seconds(lambda: compile_diagram(build)) for _ in range(2)]
        finally:
            os.environ.pop("CLIE_BLOCKS_CACHE")
            if before is not None:
                os.environ["CLIE_BLOCKS_CACHE"] = before


def per_step(diagram: Diagram) -> tuple[float, float]:
    """Return the time of one step of ode5 [s]: compiled, and python-control's six stages."""
    program = compile_diagram(diagram)
    drive = {label: 0.1 for label in program.inputs}
    job = lambda: program.run(STEPS * 1e-4, step=1e-4, inputs=drive, every=STEPS)  # noqa: E731
    job()
    ours = statistics.median(seconds(job) for _ in range(5)) / STEPS
    x, u = np.full(diagram.nstates, 0.1), np.full(diagram.ninputs, 0.1)
    points = max(2, min(POINTS, 600 // len(diagram.syslist)))
    theirs = seconds(lambda: [diagram.dynamics(0.0, x, u) for _ in range(points)]) / points
    return ours, 6 * theirs


def sizes(title: str, counts: Sequence[int], build: Callable[[int], Diagram]) -> str:
    """Return a table of costs against a size."""
    rows = []
    for count in counts:
        diagram = build(count)
        cold, cached = compile_times(diagram)
        ours, theirs = per_step(diagram)
        rows.append([count, diagram.nstates, f"{1e6 * ours:.3f}", f"{1e3 * theirs:,.1f}",
                     f"{theirs / ours:,.0f}", f"{cold:.2f}", f"{1e3 * cached:.0f}"])
    return markdown([title, "states", "compiled, us per step", "python-control, ms per step",
                     "ratio", "compile cold, s", "cached, ms"], rows)


def durations(program: Program, values: Sequence[int] = (1, 10, 100)) -> str:
    """Return a table of time and memory against the duration."""
    rows = []
    for duration in values:
        drive = loop.inputs(np.zeros((1, 2))[0])
        for every in (1, 100):
            call: dict[str, Any] = {
                "step": loop.STEP, "every": every, "inputs": drive, "log": "theta_hat"}
            tracemalloc.start()
            start = time.process_time()
            program.run(duration, **call)
            taken, peak = time.process_time() - start, tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
            rows.append([duration, every, f"{1e3 * taken / duration:.2f}", f"{peak / 1e6:,.1f}"])
    return markdown(["simulated s", "steps per row", "ms per simulated s", "peak memory, MB"],
                    rows)
