"""What a logger keeps: quantities of the robot, poorer as the condition says."""

import dataclasses
import functools

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.blind.laws.arm import Arm  # noqa: E402
from clie_blocks.analysis.blind.laws.run import SOUND, Effect, Reference  # noqa: E402
from clie_blocks.analysis.blind.poor_logs.kinds import CONDITIONS, CONTENTS, Condition  # noqa: E402
from clie_blocks.analysis.blind.poor_logs.logger import Controller, Encoder, log, run  # noqa: E402
from clie_blocks.analysis.blind.poor_logs.motion import PickAndPlace  # noqa: E402

ARM = Arm(*np.array([[0.8], [0.3], [0.02], [0.05], [10.0]]))
SPEED = 20.0  # rad/s, of its loop
CONTROLLER = Controller(ARM.inertia * SPEED**2 / ARM.gear, 1.4 * ARM.inertia * SPEED / ARM.gear,
                        500.0, 200.0, 1e-6)
ENCODER = Encoder(1e-4, 2e-5)
PLAIN = Condition(seconds=3.0)
STEP = 1e-3  # s, of differences


@functools.cache
def experiment(effect=SOUND, acts_on="q"):
    return run(ARM, CONTROLLER, ENCODER, Reference(np.random.default_rng(3), 1, 1.5),
               np.random.default_rng(4), PLAIN, acts_on, effect)


def kept(content, **changes):
    return log(experiment(), CONTENTS[content], dataclasses.replace(PLAIN, **changes),
               np.array([0.4]), np.random.default_rng(5))


def test_the_torque_turns_the_arm_by_its_inertia():
    """Torque less damping, integrated twice through the inertia, is the motion."""
    signals = experiment()
    torque, period = ARM.gear * signals["torque"][:, 0], PLAIN.period
    q, dq, moved = 0.0, 0.0, []
    for one in torque:
        moved.append(q)
        dq += period * (one - ARM.damping[0] * dq) / ARM.inertia[0]
        q += period * dq
    np.testing.assert_allclose(moved, signals["q"][:, 0], atol=0.02 * np.ptp(signals["q"]))


def test_a_late_drive_delivers_what_was_commanded_before():
    signals = experiment(effect=Effect("time_delay", 0, 4.0))
    np.testing.assert_array_equal(signals["torque"][4:], signals["command"][:-4])
    np.testing.assert_array_equal(signals["torque"][:4], 0.0)


@pytest.mark.parametrize("acts_on", ["q", "q_motor"])
def test_a_loose_gear_lies_between_the_encoders(acts_on):
    lost = 0.02
    signals = experiment(effect=Effect("backlash", 0, lost), acts_on=acts_on)
    twist = signals["q"] - signals["q_motor"]
    travel = np.subtract(*np.percentile(twist, (95.0, 5.0)))
    assert travel == pytest.approx(lost, rel=0.1)


def test_the_contents_keep_what_they_say():
    for name, content in CONTENTS.items():
        assert set(kept(name)) == {"time", "q", *content.signals}
    signals, both = experiment(), kept("both")
    np.testing.assert_array_equal(both["u"], signals["command"])
    error = both["tau"] - signals["torque"]
    assert 0.8 < error.std() / (5e-3 * 0.4) < 1.2


def test_rates_and_uneven_rows_keep_their_stamps():
    signals = experiment()
    slow = kept("command", every=5)
    np.testing.assert_array_equal(slow["q"], signals["q"][::5])
    uneven = kept("command", is_jittered=True)
    steps = np.rint(np.diff(uneven["time"]) / PLAIN.period).astype(int)
    assert {1, 2, 3} < set(steps) and 0.005 < np.mean(steps > 3) < 0.05
    at = np.rint(uneven["time"] / PLAIN.period).astype(int)
    np.testing.assert_array_equal(uneven["u"], signals["command"][at])


def test_coarse_channels_are_the_torques_or_else_the_positions():
    steps = np.unique(kept("command", is_coarse=True)["u"]) / (0.02 * 0.4)
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-6)
    degrees = 10.0 * np.rad2deg(kept("neither", is_coarse=True)["q"])
    np.testing.assert_allclose(degrees, np.rint(degrees), atol=1e-6)
    np.testing.assert_array_equal(kept("command", is_coarse=True)["q"], experiment()["q"])


def test_a_filter_takes_the_noise_of_the_measured_torque():
    plain, filtered = kept("measured"), kept("measured", is_filtered=True)
    assert np.diff(filtered["u"], axis=0).std() < 0.5 * np.diff(plain["u"], axis=0).std()
    np.testing.assert_array_equal(plain["q"], filtered["q"])
    assert not np.array_equal(kept("command", is_filtered=True)["q"], plain["q"])


def test_pick_and_place_stands_still_for_most_of_the_time():
    motion = PickAndPlace(np.random.default_rng(6), 2, 60.0)
    times = np.arange(0.0, 60.0, STEP)
    position, velocity, acceleration = (np.array(part) for part in zip(*map(motion, times)))
    assert np.mean(np.abs(velocity).max(axis=1) == 0.0) > 0.6
    np.testing.assert_allclose(np.gradient(position, STEP, axis=0), velocity, atol=1e-3)
    np.testing.assert_allclose(np.gradient(velocity, STEP, axis=0), acceleration, atol=1.0)


def test_the_noise_of_the_noisiest_logs_is_twenty_times_the_usual():
    assert CONDITIONS["noise"].noise[1] == 20.0
    signals = run(ARM, CONTROLLER, Encoder(2e-3, 2e-5), lambda t: (np.zeros(1),) * 3,
                  np.random.default_rng(1), PLAIN)
    assert np.diff(signals["q"][:, 0]).std() / np.sqrt(2.0) == pytest.approx(2e-3, rel=0.1)
