"""A delay in the encoder: the same as one in the drive, until one joint pushes another."""

import dataclasses

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.blind.engine.robot import draw_robot, draw_truth  # noqa: E402
from clie_blocks.analysis.gap.causes import CAUSES, drive, sensor  # noqa: E402
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis  # noqa: E402
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import (
    fit,  # noqa: E402
)
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal  # noqa: E402
from clie_blocks.analysis.gap.method.method import METHOD  # noqa: E402
from clie_blocks.analysis.gap.problem.problem import Problem  # noqa: E402
from clie_blocks.analysis.gap.search.screening import screen_causes  # noqa: E402

ROWS, LATE = 6000, 4.3e-3


@pytest.fixture(scope="module")
def late(engine_arm):
    """Problem of an arm of two, gears 1.8 and 29, whose first encoder is late; noise as drawn."""
    rng = np.random.default_rng(40)
    body = draw_robot(rng, "arm", True)
    truth = {**draw_truth(rng, body), "late": np.array([LATE, 0.0])}
    return Problem.from_logs(*engine_arm(rng, body, truth, ROWS), [])


def delayed(asked, cause, joints, time):
    member = Member(cause, joints, {"time": np.full(2, time)}, {"time": np.full(2, 1e-3)})
    return build_hypothesis(asked, (member,))


def positions(asked, cause, joints):
    """Simulated run of an arm that no weight moves, with a delay of seven samples."""
    at = delayed(asked, cause, joints, 7 * asked.period)
    return at.simulator.run(asked.fit[0], at.of_log(0), dithered=False)[0]


def test_delays_of_all_encoders_are_those_of_all_drives_and_of_one_are_not(late):
    chain = dataclasses.replace(late.chain, has_gravity=False)
    asked = dataclasses.replace(late, chain=chain)
    kinds = drive.TIME_DELAY, sensor.ENCODER_DELAY
    both = [positions(asked, cause, (0, 1)) for cause in kinds]
    one = [positions(asked, cause, (0,)) for cause in kinds]
    moved = np.ptp(both[0], axis=0)
    assert (np.abs(both[0] - both[1]).max(axis=0) < 1e-9 * moved).all()
    assert (np.abs(one[0] - one[1]).max(axis=0) > 1e-3 * moved).any()


def test_the_late_encoder_of_the_engine_is_measured_and_the_drive_cannot_stand_for_it(late):
    bench, _ = fit_nominal(late, METHOD)
    left, times = {}, {}
    for cause in (drive.TIME_DELAY, sensor.ENCODER_DELAY):
        found = fit(delayed(bench.problem, cause, (0,), 2e-3), bench, 12)
        left[cause], times[cause] = found.excess, found.hypothesis.values[f"{cause.block}.time"]
    assert left[sensor.ENCODER_DELAY] < 0.3
    assert left[drive.TIME_DELAY] > 10.0
    assert times[sensor.ENCODER_DELAY][0] == pytest.approx(LATE, abs=3e-5)
    assert times[sensor.ENCODER_DELAY][1] == 0.0


def test_it_is_asked_only_where_a_delay_leads(late):
    bench, base = fit_nominal(late, METHOD)
    assert sensor.ENCODER_DELAY in CAUSES
    assert not screen_causes(bench, base, (sensor.ENCODER_DELAY,)).columns
