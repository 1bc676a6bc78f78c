"""Robots of another engine whose law damps the velocity that the drive measures and logs."""

import dataclasses

import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from law_robots import RIGHT, STATED_PD, Robot, cascade, pd, pid  # noqa: E402

from clie_blocks import gap  # noqa: E402

LAG = 5e-3  # s, ten times what the difference of two samples is late
SENSED = {"sensor_lag": LAG}


def exact(text):
    return text.replace('velocity_filter = "difference"', 'velocity_filter = "exact"')


@pytest.mark.slow
@pytest.mark.parametrize("robot, effect, answer", [
    (Robot(lambda: pid(60.0), exact(RIGHT["pid"])), "", "none"),
    (Robot(lambda: cascade(18.0, 1.7, 8.0),
           exact(RIGHT["cascade with a slower outer loop"]).replace("position_every = 4\n", "")),
     "", "none"),
    (Robot(pd, STATED_PD), "coulomb", "coulomb")], ids=["pid", "cascade", "pd, not stated"])
def test_the_lag_of_the_velocity_is_no_fault_of_the_robot(tmp_path, robot, effect, answer):
    dataclasses.replace(robot, options=SENSED).write(tmp_path, effect, logs=3)
    diagnosis = gap.diagnose(gap.read(tmp_path))
    assert answer in diagnosis.ranking[0].names
    assert not diagnosis.controller.unexplained
