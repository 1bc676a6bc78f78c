"""Models with recorded commands are in the stated loop again, or nearer to the measured motion."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.fitting.hypothesis import build_hypothesis
from clie_blocks.analysis.gap.fitting.recorded_commands import (
    has_feedback,
    with_recorded_commands,
)
from clie_blocks.analysis.gap.simulation.closed_loop import constants


def errors(problem):
    """Errors of a model with a third too little inertia in the first log, slow ones [rad]."""
    at = build_hypothesis(problem, ())
    light = at.with_values({**at.values, "inertia": at.values["inertia"] / 1.5})
    error = light.error(0, dithered=False)
    window = np.ones(200) / 200
    return np.stack([np.convolve(column, window, "valid") for column in error.T])


@pytest.fixture(scope="module")
def unheld(healthy):
    """Problem of a healthy robot, of which the models get no noise."""
    return healthy.with_logs(
        lambda log: dataclasses.replace(log, dither=np.zeros_like(log.q)))


def test_with_the_gains_of_the_law_a_model_is_in_the_stated_loop(unheld):
    """The recorded command contains the feedback of the measured motion, which cancels."""
    same = with_recorded_commands(unheld, 1.0, 1.0)
    stated, recorded = errors(unheld), errors(same)
    assert np.abs(stated).max() > 1e-4
    assert np.abs(recorded - stated).max() < 0.02 * np.abs(stated).max()


@pytest.mark.parametrize("gain", [2.0, 3.0])
def test_a_stiffer_feedback_keeps_a_wrong_model_nearer_to_the_measured_motion(unheld, gain):
    stiff = with_recorded_commands(unheld, gain**2, gain)
    assert np.std(errors(stiff)) < 1.5 / gain**2 * np.std(errors(unheld))


def test_the_recorded_command_is_what_the_law_would_give_along_the_measured_motion(healthy):
    for gain in (0.3, 2.0):
        following = with_recorded_commands(healthy, gain, gain)
        assert following.quiet
        assert constants(following)["kp"] == pytest.approx(gain * healthy.law.kp)
        for log, recorded in zip(following.logs, healthy.logs):
            commands = following.law.replay(log.q, log.q_d, log.pe)
            assert np.allclose(commands, recorded.u, atol=1e-12)


def test_a_law_without_damping_or_of_a_loop_of_the_user_has_no_such_feedback(healthy):
    undamped = dataclasses.replace(healthy.law, kd=0.0 * healthy.law.kd)
    assert has_feedback(healthy)
    assert not has_feedback(dataclasses.replace(healthy, law=undamped))
    assert not has_feedback(dataclasses.replace(healthy, law=object()))
