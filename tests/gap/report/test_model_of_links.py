"""Without a model of the user's, the exported MuJoCo model moves as the corrected model does."""

import dataclasses
import types

import numpy as np
import pytest

from clie_blocks.analysis.export.correction import correction_of
from clie_blocks.analysis.export.mujoco_target import export_mujoco
from clie_blocks.analysis.export.simulated_model import SimulatedModel
from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.report.correction import correction
from clie_blocks.analysis.records import read_trial
from clie_blocks.analysis.records.robot_sections import Links, Nominal
from tests.gap.factories import make_check
from tests.gap.scenarios import coupled_wrist

pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
LOAD = np.array([0.02, -0.03, 0.01])  # of each joint's RMS command
CASES = {
    "coulomb": {"level": 0.05}, "asymmetric_coulomb": {"forward": 0.08, "backward": 0.02},
    "quadratic_drag": {"drag": 0.05}, "spring": {"stiffness": 0.1},
    "actuator_saturation": {"limit": 0.9}, "actuator_lag": {"lag": 0.004},
    "time_delay": {"delay": 0.0035}, "torque_gain_error": {"error": -0.1},
    "gravity": {"along": 0.05, "across": 0.02}, "payload": {"mass": 0.3},
    "base_tilt": {"tilt": 0.1}}
OF_MOTORS = {  # beside a model that knows motors as tendons alone
    "coulomb": {"level": 0.05}, "stribeck": {"level": 0.03, "excess": 0.03, "velocity": 0.1},
    "presliding": {"level": 0.05, "reach": 1e-3, "bristle_damping": 0.0},
    "dead_zone": {"width": 0.05},
    "torque_ripple": {"sine": 0.05, "cosine": 0.0, "order": 40.0}, "actuator_lag": {"lag": 0.004},
    "backlash": {"half_gap": 0.015, "link_share": 1.0, "bearing_share": 0.0, "loose": 1.0,
                 "contact": 100.0},
    "joint_elasticity": {"frequency": 12.0, "damping_ratio": 0.1, "link_share": 1.0,
                         "bearing_share": 0.0, "loose": 1.0}}
WEIGHTS = ("gravity", "base_tilt", "payload")
SMALL = 3e-6  # rad, a tenth of a step of these encoders


def scaled(problem, name, value):
    """A parameter in the size of the robot's own torques and motion."""
    logs = problem.logs
    u, q = (np.concatenate([getattr(log, key) for log in logs]) for key in ("u", "q"))
    torque, travel = np.sqrt(np.mean(u**2, axis=0)), np.ptp(q, axis=0)
    speed = np.sqrt(np.mean((np.diff(q, axis=0) / problem.period) ** 2, axis=0))
    per = {"level": torque, "forward": torque, "backward": torque, "limit": torque,
           "excess": torque, "width": torque, "sine": torque,
           "drag": torque / speed**2, "stiffness": torque / travel, "along": torque[:1],
           "across": torque[:1]}
    if problem.links.known:
        per |= {"along": np.ones(1), "across": np.ones(1)}
    return np.broadcast_to(value * per.get(name, 1.0), problem.n).copy()


def corrected(problem, name, variant="", **values):
    """What an export reads of a diagnosis whose model holds a cause and a load."""
    cause = next(one for one in CAUSES if (one.name, one.variant) == (name, variant))
    chosen = {key: scaled(problem, key, value) for key, value in values.items()}
    member = Member(cause, tuple(range(problem.n)), chosen, chosen)
    hypothesis = build_hypothesis(problem, (member,))
    torque = np.std(np.concatenate([log.u for log in problem.logs]), axis=0)
    values = {**hypothesis.values, "load": LOAD[:problem.n] * torque}
    found = types.SimpleNamespace(
        problem=problem, verdict="effect", findings=(), controller=make_check(problem.n),
        model=types.SimpleNamespace(hypothesis=hypothesis.with_values(values), spread=(),
                                    covariance=np.zeros((0, 0))))
    found.with_formula = found
    return found


@pytest.fixture(scope="module")
def joints(case):
    """Joints without stated links."""
    made = case("none", 3)
    return short(Problem.from_logs(made.robot, made.records))


@pytest.fixture(scope="module")
def axes(joints):
    """The same numbers of axes that slide, in m and N."""
    records = [record.replace(units={"q": "m", "qd": "m", "u": "N", "pe": "N"})
               for record in joints.records]
    return dataclasses.replace(joints, records=tuple(records),
                               statement=joints.statement._replace(records=tuple(records)))


@pytest.fixture(scope="module")
def arm(case):
    """Two stated links that push each other, and weigh."""
    made = case("none", 4)
    links = Links(length=[0.5, 0.4], mass=[2.0, 1.0], com=[0.25, 0.2], inertia=[0.05, 0.02],
                  joint_viscous_friction=[0.0, 0.0])
    robot = dataclasses.replace(made.robot, links=links,
                                nominal=Nominal(gravity=True, coupling=True))
    return short(Problem.from_logs(robot, made.records))


@pytest.fixture(scope="module")
def wrist(tmp_path_factory):
    """Three stated links, of which one is turned by two motors, with encoders on these."""
    folder = coupled_wrist.write(tmp_path_factory.mktemp("wrist"), 4.0, lines=(
        f"motor_coupling = {coupled_wrist.C.tolist()}"))
    return short(Problem.from_logs(*read_trial(folder)))


def short(problem, samples=2000):
    """The first seconds of the first log, at rest at its start."""
    log = problem.logs[0]
    cut = {key: getattr(log, key)[:samples] for key in ("q", "u", "q_d", "pe")}
    quiet = dataclasses.replace(log, **cut, dither=np.zeros_like(cut["q"]))
    return dataclasses.replace(problem, fit=(quiet,), held_out=(), quiet=True)


@pytest.mark.slow
@pytest.mark.parametrize("robot, name", [
    *(("joints", name) for name in CASES if name not in WEIGHTS),
    *(("arm", name) for name in ("coulomb", *WEIGHTS)),
    ("axes", "coulomb")])
def test_the_model_moves_as_the_corrected_model(request, tmp_path, robot, name):
    exported = moves_as_the_package(tmp_path, request.getfixturevalue(robot), name, **CASES[name])
    assert not exported.notes


def moves_as_the_package(folder, problem, name, variant="", small=SMALL, **values):
    """Assert that the exported model moves as the package's, and return it."""
    found = corrected(problem, name, variant, **values)
    hypothesis, log = found.model.hypothesis, problem.logs[0]
    expected = log.q - hypothesis.error(0, dithered=False)
    nominal = log.q - build_hypothesis(problem, ()).error(0, dithered=False)
    exported = export_mujoco(correction_of({"verdict": "effect",
                                            "correction": correction(found)}))
    assert not any("Left out" in note for note in exported.notes), exported.notes
    exported.save(folder)
    moved = SimulatedModel(folder / "robot.corrected.xml", problem).run(log)
    apart = np.std(moved - expected, axis=0)
    assert (apart < 0.02 * np.std(nominal - expected, axis=0) + small).all()
    return exported


@pytest.mark.slow
@pytest.mark.parametrize("name", OF_MOTORS)
def test_motors_that_turn_several_joints_move_as_the_corrected_model(wrist, tmp_path, name):
    moves_as_the_package(tmp_path, wrist, name, small=0.7 * coupled_wrist.NOISE,
                         **OF_MOTORS[name])


@pytest.mark.slow
def test_a_belt_over_the_joint_before_pulls_at_its_motor(arm, tmp_path):
    """The motor of the second link turns it by a belt over the first, whose motor feels that."""
    exported = moves_as_the_package(tmp_path, arm, "coupled_joints", "felt",
                                    ratio=np.array([0.0, 0.05]))
    assert not exported.notes
    model = exported.files["robot.corrected.xml"]
    assert 'tendon="joint2"' in model and 'coef="-0.05"' in model


def test_a_weight_of_joints_that_are_no_chain_is_left_out_with_the_reason(joints):
    plain = correction(corrected(joints, "gravity", **CASES["gravity"]))
    (left,) = plain["without_block"]
    assert left["effect"] == "gravity" and "cannot be inserted" in left["why"]
    assert plain["effects"] == []
