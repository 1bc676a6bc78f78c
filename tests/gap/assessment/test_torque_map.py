"""What repeats along the travel: a table of torque, found on robots that other code simulates."""

import json

import numpy as np
import pytest

from clie_blocks.analysis.gap.assessment.torque_map import corrected_error, torque_map
from clie_blocks.analysis.gap.calibration.plant import simulate as run
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.robot_sections import Encoder, Motor
from clie_blocks.output import to_json

TIME = 1e-3 * np.arange(8000)
WAVY = 2.0  # times 6e-3 kp sin(9 q), where that is positive
KP, KD, INERTIA = 40.0, 8.0, 0.5
MOTIONS = (0.6 * np.sin(2 * np.pi * 0.5 * TIME), 0.6 * np.sin(2 * np.pi * 0.33 * TIME)
           + 0.1 * np.sin(2 * np.pi * 1.7 * TIME))


def model_of(**physics):
    """Refitted nominal model of one axis with chosen physics, and its bench."""
    robot = Robot(
        n=1, name="axis", motor=Motor(gear_ratio=[1.0], inertia=[INERTIA], viscous_friction=[
            INERTIA], inertia_tolerance=0.01, viscous_friction_tolerance=0.15,
            torque_offset_tolerance=[0.4]),
        controller=Controller(law="pd", kp=[KP], kd=[KD], highpass=200.0, lowpass=300.0,
                              discretisation="tustin", sample_time=1e-3,
                              command_resolution=[2e-4 * KP]),
        encoder=Encoder(resolution=[1e-5]))
    lanes = [{"q_d": q_d, "pe": 0.0 * q_d, "weight": 0.0, "offset": 0.0, "inertia": INERTIA,
              "damping": INERTIA, "start": q_d[0], "kp": KP, "kd": KD, "lsb": 1e-5,
              "sigma": 5e-5, **physics} for q_d in MOTIONS]
    q, u = run(lanes, np.random.default_rng(2))
    records = [Record(time=TIME, q=q[:, [j]], u=u[:, [j]], qd=MOTIONS[j][:, None],
                      pe=np.zeros((TIME.size, 1)), joints=robot.joints, robot=robot)
               for j in range(2)]
    bench, base = fit_nominal(Problem.from_logs(robot, records), METHOD)
    return base.hypothesis, bench


@pytest.fixture(scope="module")
def wavy():
    """A joint whose dry friction changes with place, and its table."""
    model, bench = model_of(wavy_friction=WAVY)
    return model, bench, torque_map(model, bench)


def test_friction_that_changes_with_place_is_drawn(wavy):
    model, _, found = wavy
    (table,) = found.joints
    q, speed = np.linspace(-0.5, 0.5, 101), 1.0
    truth = 6e-3 * KP * WAVY * np.maximum(np.sin(9 * q), 0.0)
    drag = (model.values["damping"][0] - INERTIA) * speed
    for way in (1.0, -1.0):
        drawn = way * (table.load(q, np.full_like(q, way * speed)) + model.values["load"]) + drag
        assert np.sqrt(np.mean((drawn - truth)**2)) < 0.25 * np.std(truth)
    near = np.interp(table.positions, q, truth)
    inside = np.abs(table.positions) < 0.5
    for place, spread in zip(table.over_position, table.position_spread):
        off = (place - near)[inside]
        assert np.mean(np.abs(off - off.mean()) < 3 * spread[inside] + 0.1 * np.ptp(truth)) > 0.9


def test_the_table_holds_on_another_motion(wavy):
    model, bench, found = wavy
    before, after = (np.sqrt(np.mean(error**2)) for error in (
        model.error(1, dithered=False), corrected_error(model, found.joints, 1)))
    assert after == pytest.approx(found.gap) and after < 0.4 * before
    floor = bench.noises[0].floor
    assert found.percent == pytest.approx(100 * (before - after) / (before - floor))
    assert found.interval[0] < found.percent < found.interval[1]


def test_the_answer_holds_the_table(wavy):
    told = json.loads(to_json(wavy[2].as_dict()))
    (joint,) = told["joints"]
    assert joint["joint"] == 1 and told["percent"] > 60.0 and told["beside"] == []
    for curve in (joint["over_position"], joint["over_speed"]):
        assert {len(row) for row in curve.values()} == {len(curve["at"])}


@pytest.mark.slow
def test_nothing_left_needs_no_table():
    model, bench = model_of()
    assert torque_map(model, bench) is None


@pytest.mark.slow
def test_what_does_not_come_back_is_no_table():
    model, bench = model_of(random_torque=3.0)
    assert np.std(model.error(1)) > 3 * bench.noises[0].floor
    assert torque_map(model, bench) is None
