"""Held commands by their length and interval, and steps of a torque by their size."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.search.held_packets import best_hold
from clie_blocks.analysis.gap.search.torque_steps import best_step
from clie_blocks.measurement import quantized

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


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("share", [0.01, 0.035, 0.08, 0.15])
def test_a_step_is_found_of_commands_that_are_mostly_small(seed, share):
    rng = np.random.default_rng(seed)
    u = [0.1 * rng.standard_normal(count).cumsum() / np.sqrt(count)
         + np.exp(-rng.uniform(5, 40) * (np.linspace(0, 1, count) - rng.uniform()) ** 2 * 400)
         for count in SAMPLES]
    step = share * max(np.abs(one).max() for one in u)
    torque = [quantized(one, step) - one + 0.2 * step * rng.standard_normal(len(one)) for one in u]
    found = best_step(StiffJoint(u, torque, torque)).values
    assert found["resolution"] == pytest.approx(step, rel=5e-3)
