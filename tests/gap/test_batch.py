"""Many trials on other workers: a Dask cluster, and a run that was killed."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from clie_blocks.analysis.gap import batch
from clie_blocks.analysis.gap.calibration.robots import draw_cases

DONE = {"verdict", "effects", "set_90", "seconds"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory, write_trial):
    place = tmp_path_factory.mktemp("many")
    for seed in (3, 4, 5):
        write_trial(
            draw_cases(1, seed, ["coulomb"], ["none"], duration=6.0)[0], place / f"t-{seed}"
        )
    return place


def test_a_dask_cluster_diagnoses(folder):
    distributed = pytest.importorskip("distributed", reason="dask[distributed] is not installed")
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=False,
                                  dashboard_address=None) as local:
        with batch.cluster(local.scheduler_address) as executor:
            waiting = batch.find_tasks([folder])[:2]
            found = dict(batch.diagnose_all(waiting, executor=executor))
    assert set(found) == {"t-3", "t-4"}
    assert all(set(told) >= DONE for told in found.values())


def test_a_killed_run_continues(folder, tmp_path):
    kept = tmp_path / "kept.parts"
    command = [
        sys.executable,
        "-m",
        "clie_blocks.analysis.gap.command",
        str(folder),
        "-o",
        str(kept),
    ]
    run = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    limit = time.monotonic() + 120.0
    while not list(kept.glob("*.json")) and run.poll() is None and time.monotonic() < limit:
        os.sched_yield()
    run.send_signal(signal.SIGKILL)
    run.wait()
    before = {path.name: path.stat().st_mtime_ns for path in kept.glob("*.json")}
    assert before and all(json.loads((kept / name).read_text()) for name in before)
    found = dict(batch.diagnose_all(batch.find_tasks([folder]), folder=kept))
    assert len(found) == 3 and all(set(told) >= DONE for told in found.values())
    assert all((kept / name).stat().st_mtime_ns == when for name, when in before.items())
