"""The folder of a trial: fixed for published seeds, readable, silent about its label."""

import dataclasses
import gzip
import hashlib

import numpy as np
import pytest

from clie_blocks.analysis.blind.engine.experiments import draw_experiments
from clie_blocks.analysis.blind.engine.robot import (
    draw_robot,
    draw_truth,
)
from clie_blocks.analysis.blind.population.files import robot_text, write_trial
from clie_blocks.analysis.records import read_trial
from clie_blocks.analysis.records.two_encoders import other_encoder, with_law_encoder


@pytest.mark.parametrize(("index", "digest"), [
    (21, "7970eb4378625790"), (40, "228a19bcd8c6df18"), (82, "639312a9b7efd7a2"),
    (89, "924e55f30130e184")])
def test_robots_and_experiments_of_a_published_seed_stay_what_they_were(index, digest):
    """Healthy robots of seed 41, which chance alone decides; nothing is simulated."""
    rng = np.random.default_rng([41, index, 0])
    robot = draw_robot(rng)
    draw_truth(rng, robot)
    text = robot_text(robot, draw_experiments(rng, robot))
    assert hashlib.sha256(text.encode()).hexdigest().startswith(digest)


def test_a_trial_is_read_by_the_package_and_does_not_reveal_its_label(healthy_trial, tmp_path):
    _, trial = healthy_trial
    write_trial(trial, tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "log-1.csv.gz", "log-2.csv.gz", "log-3.csv.gz", "robot.toml"]
    robot, records = read_trial(tmp_path)
    assert robot.n == trial.robot.n and len(records) == 3
    for record, (q, u) in zip(records, trial.runs):
        np.testing.assert_allclose(record.q, q, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(record.u, u, rtol=0.0, atol=1e-9)
    head = gzip.decompress((tmp_path / "log-1.csv.gz").read_bytes()).split(b"\n")[0].decode()
    assert head == ",".join(["time"] + [f"{name}{k + 1}" for name in ("q", "u", "qd", "pe")
                                        for k in range(robot.n)])


def test_the_file_of_a_spatial_arm_does_not_describe_its_links():
    rng = np.random.default_rng(4)
    robot = draw_robot(rng, "spatial")
    text = robot_text(robot, draw_experiments(rng, robot))
    assert "[links]" not in text and "gravity = false" in text and "coupling = false" in text
    assert np.all(robot.rotor * robot.ratio**2 > robot.link)


@pytest.mark.parametrize("on_motor", [False, True])
def test_a_trial_with_two_encoders_is_read_with_both(healthy_trial, tmp_path, on_motor):
    _, trial = healthy_trial
    robot = dataclasses.replace(trial.robot, encoder_on_motor=on_motor, two_encoders=True)
    (q, _), *_ = trial.runs
    one = dataclasses.replace(trial, robot=robot, runs=trial.runs[:1], others=[q + 1e-3])
    write_trial(one, tmp_path)
    stated, records = read_trial(tmp_path)
    record, = with_law_encoder(records, stated)
    assert record.q == pytest.approx(q, abs=1e-8)
    assert other_encoder(record) == pytest.approx(q + 1e-3, abs=1e-8)
