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


@pytest.mark.slow
def test_a_dask_cluster_diagnoses(folder):
    distributed = pytest.importorskip("distributed", reason="dask[distributed] is not installed")
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=False,
                                  dashboard_address=None) as local:
        with batch.cluster(local.scheduler_address) as executor:
            waiting = batch.find_tasks([folder])[:2]
            found = dict(batch.diagnose_all(waiting, executor=executor))
    assert set(found) == {"t-3", "t-4"}
    assert all(set(told) >= DONE for told in found.values())


@pytest.mark.slow
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


def test_a_result_is_made_anew_where_any_file_below_the_folder_changes(tmp_path):
    folder = tmp_path / "recording"
    (folder / "data").mkdir(parents=True)
    (folder / "data" / "part-0.parquet").write_bytes(b"rows")
    log = folder / "log.csv"
    log.write_text("time,q1\n")
    tasks = [batch.Task("folder", (str(folder),)), batch.Task("log", (str(log),))]

    def digests():
        return [batch.digest_of_inputs(task, batch.Options()) for task in tasks]

    first = digests()
    (folder / ".half-written").write_text("of a run that was killed")
    assert digests() == first
    (folder / "data" / "part-0.parquet").write_bytes(b"other rows")
    second = digests()
    assert second[0] != first[0] and second[1] == first[1]
    (folder / "robot.toml").write_text("joints = 1\n")
    assert digests()[1] != second[1]
