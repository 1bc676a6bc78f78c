"""The benchmark of the diagnosis measures whole diagnoses, and its peer fits the same model."""

import dataclasses
import importlib
import sys
from pathlib import Path

import numpy as np
import pytest

from clie_blocks import gap

FOLDER = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def benchmark(monkeypatch):
    if not FOLDER.is_dir():
        pytest.skip("the benchmarks are beside the tests only in a checkout")
    monkeypatch.syspath_prepend(str(FOLDER))
    yield importlib.import_module("diagnosis")
    for file in FOLDER.glob("*.py"):
        sys.modules.pop(file.stem, None)


@pytest.fixture
def trial(benchmark, tmp_path):
    benchmark.arm.write_trial(tmp_path, 4.0, "one effect")
    return tmp_path


@pytest.mark.slow
def test_every_fault_of_the_benchmark_moves_the_arm(benchmark, tmp_path):
    positions = {}
    for fault in benchmark.arm.FAULTS:
        folder = tmp_path / fault
        folder.mkdir()
        benchmark.arm.write_trial(folder, 4.0, fault)
        positions[fault] = gap.read(folder).logs[0].q
    one, *others = positions.values()
    assert all(np.abs(one - other).max() > 20 * benchmark.arm.NOISE for other in others)


@pytest.mark.slow
def test_a_diagnosis_apart_finds_the_fault_and_its_stages_add_up(benchmark, trial, tmp_path):
    benchmark.apart(trial, cache=tmp_path / "programs")  # compiles, which is no stage
    found = benchmark.apart(trial, cache=tmp_path / "programs")
    assert "coulomb" in found["answer"]
    spent = found["start-up"] + sum(found["stages"].values())
    assert 0.8 * found["seconds"] < spent <= found["seconds"]
    assert found["memory"] < 1000.0


def test_stopwatch_counts_no_second_twice(benchmark):
    watch = benchmark.Stopwatch()
    inner = watch.watched("inner", lambda: sum(range(200_000)))
    watch.watched("outer", lambda: [inner() for _ in range(5)])()
    assert watch.seconds["outer"] < 0.5 * watch.seconds["inner"]


def test_peer_simulates_the_same_loop(benchmark, trial):
    from clie_blocks.analysis.gap.fitting.hypothesis import build_hypothesis

    asked = gap.read(trial)
    at = build_hypothesis(asked, ())
    log = asked.fit[1]
    log = dataclasses.replace(log, q=log.q[:300], q_d=log.q_d[:300], pe=log.pe[:300],
                              dither=log.dither[:300])
    theirs = benchmark.simulated(at, log, {})
    (ours,) = at.simulator.positions(log, [at.of_log(0)], dithered=False)
    np.testing.assert_allclose(theirs, ours, rtol=0, atol=1e-12)
