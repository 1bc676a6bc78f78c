"""The clock that is found beats as that of the drive does."""

import numpy as np
import pytest
from scipy.signal import lfilter

from clie_blocks.analysis.gap.search.beating_clock import best_beat
from clie_blocks.analysis.gap.search.drive_errors import DriveErrors

PERIOD = 1e-3  # s
SAMPLES = 12000, 10000, 9000
LOOP = [0.0, 1e-3, 9e-4], np.poly([0.97 * np.exp(0.04j), 0.97 * np.exp(-0.04j)]).real


class SoftJoint(DriveErrors):
    """A joint whose error is the response of a resonant loop to what its drive adds."""

    period, least, fitted = PERIOD, 0.0, range(len(SAMPLES) - 1)

    def columns(self, j, torque):
        return lfilter(*LOOP, torque, axis=0)


def joint_with_beat(seed, spread, beat, noise=0.02):
    """Joint with commands of an age that grows to a spread [s] and falls back; its phases."""
    rng = np.random.default_rng(seed)
    phases = rng.uniform(0.0, 1.0, len(SAMPLES))
    u, errors, torque = [], [], []
    for j, (count, phase) in enumerate(zip(SAMPLES, phases)):
        t = PERIOD * np.arange(count)
        lines = np.geomspace(0.1, 6.0, 9) * rng.uniform(0.9, 1.1, 9)
        turns = 0.1 * t[None] + t[None] ** 2 / 8 if j == 0 else np.outer(lines, t)
        command = np.sin(2 * np.pi * turns + rng.uniform(0, 6, (len(turns), 1))).sum(axis=0)
        added = np.interp(t - spread * ((beat * t + phase) % 1.0), t, command) - command
        u.append(command)
        errors.append(lfilter(*LOOP, added) + 1e-4 * rng.standard_normal(count))
        torque.append(added + noise * rng.standard_normal(count))
    fitted = np.concatenate(errors[:-1])
    none = np.zeros((len(fitted), 0))
    return SoftJoint(None, None, errors, 0, u, torque, torque, none, fitted), phases


@pytest.mark.parametrize("seed, spread, beat", [
    (1, 1.2e-3, 1.7), (2, 9e-3, 7.8), (3, 3e-3, 0.6), (4, 0.05, 1.3), (5, 4e-4, 23.4)])
def test_the_beat_and_its_spread_are_those_of_the_drive(seed, spread, beat):
    joint, phases = joint_with_beat(seed, spread, beat)
    found = best_beat(joint).values
    assert found["beat"] == pytest.approx(beat, abs=0.1 / (PERIOD * SAMPLES[0]))
    assert found["spread"] == pytest.approx(spread, rel=0.1)
    late = (found["phase"] - phases + 0.5) % 1.0 - 0.5
    assert late == pytest.approx(0.0, abs=0.05)


def test_no_beat_is_found_in_noise():
    joint, _ = joint_with_beat(6, 0.0, 1.0)
    assert best_beat(joint).drop < 0.05 * joint.target @ joint.target
