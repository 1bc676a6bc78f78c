"""Held commands are found by their length and interval, also where a harmonic stands out more."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.search.held_packets import best_hold

PERIOD = 1e-3  # s
SAMPLES = 18000, 15000, 14000


@dataclasses.dataclass
class StiffJoint:
    """A joint whose error is the torque that a drive adds, with some noise."""

    u: list[np.ndarray]
    back: list[np.ndarray]
    torque: list[np.ndarray]
    period: float = PERIOD
    least: float = 0.0

    @property
    def fitted(self):
        """Logs that are fitted: all but the last."""
        return range(len(self.u) - 1)

    def drop(self, torques):
        """Drop of chi^2 by a torque per fitted log."""
        return sum(2 * added @ torque - added @ added
                   for added, torque in zip(torques, self.torque))


def joint_with_holds(seed, length, interval):
    """Joint whose commands are held for so many samples at an interval [samples]; first samples.
    """
    rng = np.random.default_rng(seed)
    u, torque, starts = [], [], rng.uniform(2.0, interval, len(SAMPLES))
    for j, (count, start) in enumerate(zip(SAMPLES, starts)):
        t = PERIOD * np.arange(count)
        lines = np.geomspace(0.06, 3.0, 9) * rng.uniform(0.9, 1.1, 9)
        turns = 0.1 * t[None] + t[None] ** 2 / 30 if j == 0 else np.outer(lines, t)
        command = np.sin(2 * np.pi * turns + rng.uniform(0, 6, (len(turns), 1))).sum(axis=0)
        held = command.copy()
        for first in np.arange(start, count - length, interval).round().astype(int):
            held[first:first + length] = command[first - 1]
        u.append(command)
        torque.append(held - command + 0.02 * rng.standard_normal(count))
    return StiffJoint(u, torque, torque), starts


@pytest.mark.parametrize("seed, length, interval", [
    (3, 41, 449.1), (7, 47, 1360.3), (11, 11, 779.0), (17, 18, 304.0), (25, 28, 84.4)])
def test_the_interval_and_the_length_of_holds_are_those_of_the_drive(seed, length, interval):
    joint, starts = joint_with_holds(seed, length, interval)
    found = best_hold(joint).values
    assert found["interval"] / PERIOD == pytest.approx(interval, rel=2e-3)
    assert found["hold"] / PERIOD == pytest.approx(length, abs=0.15 * length)
    late = (found["phase"] + starts / interval + 0.5) % 1.0 - 0.5
    assert np.abs(late) * interval == pytest.approx(0.0, abs=0.5 * length)
