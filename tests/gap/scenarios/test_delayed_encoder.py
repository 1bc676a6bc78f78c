"""A delay of the encoder: the same as one of the drive, unless joints are coupled."""

import dataclasses

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.blind.engine.robot import draw_robot, draw_truth  # noqa: E402
from clie_blocks.analysis.gap.causes import CAUSES, drive, sensor  # noqa: E402
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis  # noqa: E402
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit  # noqa: E402
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal  # noqa: E402
from clie_blocks.analysis.gap.method.method import METHOD  # noqa: E402
from clie_blocks.analysis.gap.problem.problem import Problem  # noqa: E402
from clie_blocks.analysis.gap.search.screening import screen_causes  # noqa: E402

ROWS, DELAY = 6000, 4.3e-3  # samples, s


@pytest.fixture(scope="module")
def arm(engine_arm):
    """Problem of an arm of two, gears 1.8 and 29, whose first encoder is delayed."""
    rng = np.random.default_rng(40)
    body = draw_robot(rng, "arm", True)
    truth = {**draw_truth(rng, body), "late": np.array([DELAY, 0.0])}
    return Problem.from_logs(*engine_arm(rng, body, truth, ROWS), [])


def delayed(problem, cause, joints, time):
    member = Member(cause, joints, {"delay": np.full(2, time)}, {"delay": np.full(2, 1e-3)})
    return build_hypothesis(problem, (member,))


def positions(problem, cause, joints):
    """Simulated run of an arm that no weight moves, with a delay of seven samples."""
    model = delayed(problem, cause, joints, 7 * problem.period)
    return model.simulator.run(problem.fit[0], model.of_log(0), dithered=False)[0]


def test_delays_of_all_encoders_are_those_of_all_drives_and_of_one_are_not(arm):
    weightless = dataclasses.replace(arm, links=dataclasses.replace(arm.links, has_gravity=False))
    kinds = drive.TIME_DELAY, sensor.ENCODER_DELAY
    of_all = [positions(weightless, cause, (0, 1)) for cause in kinds]
    of_one = [positions(weightless, cause, (0,)) for cause in kinds]
    moved = np.ptp(of_all[0], axis=0)
    assert (np.abs(of_all[0] - of_all[1]).max(axis=0) < 1e-9 * moved).all()
    assert (np.abs(of_one[0] - of_one[1]).max(axis=0) > 1e-3 * moved).any()


def test_the_delay_of_an_encoder_is_measured_and_one_of_the_drive_cannot_explain_it(arm):
    residuals, _ = fit_nominal(arm, METHOD)
    of_drive, of_encoder = (fit(delayed(residuals.problem, cause, (0,), 2e-3), residuals, 12)
                            for cause in (drive.TIME_DELAY, sensor.ENCODER_DELAY))
    assert of_encoder.excess < 0.3
    assert of_drive.excess > 10.0
    times = of_encoder.hypothesis.values[f"{sensor.ENCODER_DELAY.block}.delay"]
    assert times[0] == pytest.approx(DELAY, abs=3e-5)
    assert times[1] == 0.0


def test_an_encoder_delay_is_screened_where_joints_push_one_another(arm):
    residuals, nominal = fit_nominal(arm, METHOD)
    assert sensor.ENCODER_DELAY in CAUSES
    columns = screen_causes(residuals, nominal, (sensor.ENCODER_DELAY,)).columns
    assert {column.joint for column in columns} == {0, 1}


def test_an_encoder_delay_is_not_screened_where_a_delayed_drive_says_it_all(arm):
    apart = dataclasses.replace(arm, links=dataclasses.replace(arm.links, has_coupling=False))
    residuals, nominal = fit_nominal(apart, METHOD)
    assert not screen_causes(residuals, nominal, (sensor.ENCODER_DELAY,)).columns
