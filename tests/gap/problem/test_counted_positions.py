"""Positions between the counts of a coarse encoder, and what a diagnosis makes of them."""

import dataclasses

import numpy as np
import pytest
from catalogue_robot import CatalogueRobot
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from clie_blocks.analysis.gap import diagnose, read
from clie_blocks.analysis.gap.problem.counted_positions import between_counts
from clie_blocks.effects import LIBRARY
from clie_blocks.measurement import quantized

STEP = 4e-3  # rad
TIME = np.arange(0.0, 12.0, 1e-3)
ROBOT = CatalogueRobot(noise=1e-5)


def coarse_logs(*effects):
    """Logs of the robot with another encoder than its file states."""
    return dataclasses.replace(ROBOT, resolution=STEP).records([one() for one in effects])


def diagnosed(folder, *effects):
    found = diagnose(read(ROBOT.write(folder, coarse_logs(*effects))))
    return found, {row["effect"]: row["probability"] for row in found.to_dict()["effects"]}


@pytest.mark.parametrize("speed, share", [(0.05, 0.3), (0.5, 0.2), (3.0, 0.7)])
def test_changes_of_a_count_tell_a_smooth_motion_better_than_counts(speed, share):
    q = speed * np.sin(2.0 * TIME) + 0.05 * speed * np.sin(11.0 * TIME)
    counted = quantized(q, STEP)
    between = between_counts(counted, STEP)
    assert np.std(between - q) < share * np.std(counted - q)


def test_noise_at_a_change_does_not_make_the_motion_swing():
    q = 0.25 * np.sin(3.0 * TIME)
    noise = 0.04 * STEP * np.random.default_rng(5).standard_normal(len(q))
    between = between_counts(quantized(q + noise, STEP), STEP)
    assert np.std(between - q) < 1.6 * np.std(between_counts(quantized(q, STEP), STEP) - q)


@given(arrays(float, st.integers(2, 300), elements=st.floats(-0.02, 0.02)))
@settings(max_examples=100, deadline=None)
def test_no_position_is_farther_from_its_count_than_half_a_step(q):
    counted = quantized(q, STEP)
    assert np.all(np.abs(between_counts(counted, STEP) - counted) <= STEP / 2 * (1 + 1e-9))


def test_a_joint_that_stays_within_a_count_is_where_the_count_says():
    still = np.full(100, 3 * STEP)
    assert np.array_equal(between_counts(still, STEP), still)


def test_a_coarse_encoder_alone_leaves_nothing_and_most_of_the_gap_is_its_counts(tmp_path):
    found, probability = diagnosed(tmp_path)
    assert probability["encoder_quantization"] > 0.9
    assert found.ranking[0].names == ("none",)
    assert found.reduction.after < 0.5 * found.reduction.before
    assert found.to_dict()["verdict"] == "effect"


@pytest.mark.slow
@pytest.mark.parametrize("name, numbers", [
    ("coulomb", {"level": 1.5}), ("time_delay", {"delay": 0.01})])
def test_what_a_coarse_encoder_does_not_explain_is_named_beside_it(name, numbers, tmp_path):
    found, probability = diagnosed(tmp_path, lambda: LIBRARY[name](**numbers))
    assert probability["encoder_quantization"] > 0.9
    family = found.to_dict()["families"]
    assert max(probability[name], family[LIBRARY[name].family]) > 0.8
    assert max(probability, key=lambda one: (one != "encoder_quantization") * probability[one],
               ) == name
