"""The runners that we compare with compute what the compiled diagram computes."""

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest

from clie_blocks.compiled import compile_diagram
from clie_blocks.errors import ClieError

FOLDER = Path(__file__).parents[2] / "benchmarks"
STEPS = 300


@pytest.fixture
def load(monkeypatch):
    """Import a file of the benchmarks; skip where what it compares with is not installed."""
    if not FOLDER.is_dir():
        pytest.skip("the benchmarks are beside the tests only in a checkout")
    monkeypatch.syspath_prepend(str(FOLDER))

    def load(name, needs=None):
        if needs:
            pytest.importorskip(needs)
        return importlib.import_module(name)
    yield load
    for file in FOLDER.glob("*.py"):
        sys.modules.pop(file.stem, None)


def test_hand_written_c_is_the_same_loop(load, tmp_path):
    loop, handwritten = load("loop"), load("handwritten")
    try:
        run = handwritten.build(tmp_path)
    except ClieError as missing:
        pytest.skip(str(missing))
    noise = loop.noise_rows(STEPS)
    ours = loop.run(compile_diagram(loop.diagram()), noise).states.T
    theirs = handwritten.simulate(run, noise, loop.Q_D, loop.STEP, loop.EVERY)
    np.testing.assert_allclose(theirs, ours, rtol=1e-10, atol=1e-13)


@pytest.mark.parametrize("peer", ["numba", "casadi"])
@pytest.mark.slow
def test_peers_are_the_same_loop(load, peer):
    loop, module = load("loop"), load(f"{peer}_loop", peer)
    noise = loop.noise_rows(STEPS)
    ours = loop.run(compile_diagram(loop.diagram()), noise).states[:, -1]
    theirs = module.simulate(noise) if peer == "numba" else module.simulator(STEPS)(noise)
    np.testing.assert_allclose(theirs, ours, rtol=1e-10, atol=1e-13)


@pytest.mark.slow
def test_jaxonomy_is_the_same_loop(load):
    loop, module = load("loop"), load("jaxonomy_loop", "jaxonomy")
    still = np.zeros((STEPS, 2))
    ours = loop.run(compile_diagram(loop.diagram()), still).states[:, -1]
    np.testing.assert_allclose(module.simulator(STEPS)(), ours, rtol=1e-10, atol=1e-13)


@pytest.mark.parametrize("peer, needs", [("pathsim", "pathsim"), ("bdsim", "bdsim"),
                                         ("drake", "pydrake")])
@pytest.mark.slow
def test_block_diagram_tools_are_the_same_loop(load, peer, needs):
    loop, module = load("loop"), load(f"{peer}_loop", needs)
    diagram = loop.diagram()
    ours = compile_diagram(diagram).run(2e-3, loop.STEP, inputs=loop.inputs(np.zeros(2)))
    theirs = module.simulator(diagram)(20)
    np.testing.assert_allclose(np.sort(theirs), np.sort(ours.states[:, -1]), rtol=1e-10,
                               atol=1e-13)  # each tool has an order of its own


def test_jobs_take_turns_and_ratios_are_of_neighbours(load):
    timing, calls = load("timing"), []
    times = timing.interleaved({name: lambda name=name: calls.append(name) for name in "ab"}, 2)
    assert calls == ["a", "b"] * 3 and len(times["a"]) == 2  # the first round only warms up
    middle, low, high = timing.ratio({"c": [1, 2, 4], "x": [10, 22, 36]}, "x", "c")
    assert (middle, low, high) == (10, 9, 11)
    assert timing.markdown(["a", "b"], [[1, 2]]).splitlines() == [
        "| a | b |", "| --- | --- |", "| 1 | 2 |"]
