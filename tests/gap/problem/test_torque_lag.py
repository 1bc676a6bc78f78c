"""Torques that are late, early or low-passed, in closed form."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clie_blocks.analysis.gap.problem.torque_lag import TorqueLag

PERIOD = 1e-3
TIME = PERIOD * np.arange(3000)
INNER = slice(100, -100)


def tone(time, rate):
    return np.sin(rate * time)[:, None]


@given(age=st.floats(-0.03, 0.03), rate=st.floats(1.0, 30.0))
def test_a_late_torque_is_brought_back_to_its_instant(age, rate):
    logged = tone(TIME - age, rate)
    error = TorqueLag(age).compensated(logged, PERIOD) - tone(TIME, rate)
    assert np.abs(error[INNER]).max() < (rate * PERIOD) ** 2  # of the lines between samples


@given(constant=st.floats(1e-3, 0.02), rate=st.floats(1.0, 30.0))
def test_the_torque_before_a_low_pass_is_restored(constant, rate):
    size, phase = 1.0 / np.hypot(1.0, constant * rate), np.arctan(constant * rate)
    logged = size * np.sin(rate * TIME - phase)[:, None]
    restored = TorqueLag(time_constant=constant).compensated(logged, PERIOD)
    assert np.abs((restored - tone(TIME, rate))[INNER]).max() < (rate * PERIOD) ** 2


def test_lags_add_and_say_what_they_are():
    both = TorqueLag(3e-3) + TorqueLag(-1e-3, 5e-3)
    assert both.seconds == pytest.approx(7e-3) and not both.is_skew
    assert both.correction.check == "torque.filtered" and "32 Hz" in both.correction.what
    late, early = TorqueLag(4e-3), TorqueLag(-4e-3)
    assert late.correction.effect == "channel_skew" and late.is_skew
    assert early.correction.check == "position.late" and not early.correction.effect
