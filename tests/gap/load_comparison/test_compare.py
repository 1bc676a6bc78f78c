"""A load is found by what the loaded robot takes beyond the unloaded one."""

import json

import numpy as np
import pytest

from clie_blocks.analysis.gap.command import main
from clie_blocks.analysis.gap.load_comparison.compare import compare_loads
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records import Record, Robot, read_records
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.robot_sections import Links, Motor, Nominal
from clie_blocks.errors import NotIdentifiableError, RecordError
from clie_blocks.robot_loop.links import bias_torque, inertial_torque, planar_links
from tests.gap.scenarios.mujoco_joint import chirp, record_of, robot_of, run

MEASURED = Controller(law="unknown", u_is="measured")


def side(load=None, seed=0, coulomb=0.1):
    pytest.importorskip("mujoco")
    robot = robot_of(MEASURED)
    rows = run(chirp(8.0, size=0.5), 30.0, 2.0, load=load, coulomb=coulomb, seed=seed)
    return Problem.from_logs(robot, [record_of(rows, robot, "qd", "u")])


@pytest.fixture(scope="module")
def unloaded():
    return side()


def test_mass_and_place_of_a_load_are_found_beside_friction_that_grows(unloaded):
    found = compare_loads(side((0.35, 0.42), seed=1, coulomb=0.15), unloaded)
    assert found.is_load
    assert abs(found.mass - 0.35) < found.mass_half < 0.1
    assert abs(found.distance - 0.42) < found.distance_half < 0.06
    assert found.moment == pytest.approx(0.35 * 0.42, rel=0.06)
    np.testing.assert_allclose(found.friction[:, 0, 1], (0.15, 0.1), rtol=0.3)


def test_two_runs_of_one_load_differ_by_none(unloaded):
    found = compare_loads(side(seed=2), unloaded)
    assert not found.is_load and abs(found.moment) < 0.01
    assert "No load is found" in str(found)


def test_a_load_that_was_taken_off_is_negative(unloaded):
    found = compare_loads(unloaded, side((0.35, 0.42), seed=1))
    assert found.is_load and found.mass < 0.0


def arm(load=0.0, place=0.0):
    """Two coupled links under known torques, the second one with a mass on it."""
    robot = Robot(n=2, motor=Motor(gear_ratio=[1.0, 1.0]), controller=MEASURED,
                  links=Links(length=[0.4, 0.3], mass=[1.0, 0.5], com=[0.2, 0.15],
                              inertia=[0.01, 0.004]), nominal=Nominal(gravity=True, coupling=True))
    time = 0.005 * np.arange(3000)
    w = 2 * np.pi * np.array([[0.3, 0.71], [0.45, 0.97]])
    parts = 0.5 * np.sin(time[:, None, None] * w + [[0.0, 1.0], [0.4, 2.0]])
    q = parts.sum(-1)
    dq = (0.5 * w * np.cos(time[:, None, None] * w + [[0.0, 1.0], [0.4, 2.0]])).sum(-1)
    ddq = (-w**2 * parts).sum(-1)
    mass = np.array([1.0, 0.5 + load])
    com = np.array([0.2, (0.5 * 0.15 + load * place) / mass[1]])
    about = 0.004 + 0.5 * 0.15**2 + load * place**2 - mass[1] * com[1]**2
    links = planar_links([0.4, 0.3], mass, com, [0.01, about], has_gravity=True,
                         has_coupling=True)
    u = inertial_torque(links, q, ddq) + bias_torque(links, q, dq) + 0.2 * np.tanh(50 * dq)
    u += 0.02 * np.random.default_rng(round(100 * load)).normal(size=u.shape)
    return Problem.from_logs(robot, [Record(time=time, q=q, u=u, robot=robot)])


def test_of_an_arm_the_load_is_found_on_the_last_link():
    found = compare_loads(arm(0.3, 0.25), arm())
    assert found.is_load and found.explained > 0.9
    assert found.mass == pytest.approx(0.3, abs=max(0.02, found.mass_half))
    np.testing.assert_allclose(found.place[:2], (0.25, 0.0), atol=0.03)


def test_without_links_the_load_of_an_arm_is_no_question_that_logs_answer():
    problem = arm()
    robot = Robot(n=2, controller=MEASURED)
    bare = Problem.from_logs(robot, [record.replace(robot=robot) for record in problem.records])
    with pytest.raises(NotIdentifiableError, match="states no links"):
        compare_loads(bare, bare)


def test_two_robots_are_not_compared(unloaded):
    with pytest.raises(RecordError, match="a comparison is of one"):
        compare_loads(arm(), unloaded)


def test_a_position_error_is_no_torque():
    robot = robot_of()
    time = 0.01 * np.arange(600)
    record = Record(time=time, q=np.sin(time)[:, None], qd=np.sin(time + 0.1)[:, None],
                    robot=robot, source="servo")
    problem = Problem.from_logs(robot, [record])
    with pytest.raises(NotIdentifiableError, match="gain of the drive"):
        compare_loads(problem, problem)


CYCLOIDAL = """joints = 1
[motor]
gear_ratio = 1.0
[controller]
law = "pd"
Kp = 268.5
Kd = 78.3
velocity_of = "error"
velocity_filter = "exact"
sample_time_s = 3.3333e-5
saturation_nm = 100.0
"""


def test_the_350_g_of_the_cycloidal_joint_are_found(shared, tmp_path, capsys):
    logs = shared / "data" / "cycloidal"
    (tmp_path / "robot.toml").write_text(CYCLOIDAL)
    sides = {"loaded": ("15-14-01", "15-15-41"), "bar": ("12-21-36", "13-03-04")}
    for name, runs in sides.items():
        (tmp_path / name).mkdir()
        for found in logs.iterdir():
            if any(run in found.name for run in runs):
                (tmp_path / name / found.name).write_bytes(found.read_bytes())
    assert main(["--compare", str(tmp_path / "loaded"), str(tmp_path / "bar"), "--robot",
                 str(tmp_path / "robot.toml"), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["verdict"] == "load"
    low, high = answer["mass"]["interval"]
    assert low < 0.35 < high and high - low < 0.5
    low, high = answer["moment"]["interval"]
    assert low < 1.45 / 9.81 < high < 0.2  # kg m, known apart


def test_one_load_under_two_gains_differs_by_none(shared):
    runs = {record.source: record for record in read_records(shared / "data" / "bam_xl330")}
    sides = [[record for name, record in runs.items() if motion in name]
             for motion in ("(sin_sin, P 800)", "(sin_sin, P 400)")]
    found = compare_loads(*(Problem.from_logs(records[0].robot, records) for records in sides))
    assert not found.is_load and abs(found.moment) < 0.02  # of 0.049 kg m
