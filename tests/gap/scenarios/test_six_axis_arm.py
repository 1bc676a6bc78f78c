"""A six-axis arm from its URDF, run in MuJoCo: sound, with faults, with masses that are off."""

import dataclasses

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.gap import diagnose  # noqa: E402
from clie_blocks.analysis.gap.fitting.hypothesis import build_hypothesis  # noqa: E402
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal  # noqa: E402
from clie_blocks.analysis.gap.method import METHOD  # noqa: E402
from clie_blocks.analysis.gap.problem.problem import Problem  # noqa: E402
from clie_blocks.analysis.records import read_trial  # noqa: E402
from clie_blocks.analysis.records.controller_section import Controller  # noqa: E402
from clie_blocks.analysis.records.robot import Links  # noqa: E402
from clie_blocks.errors import ClieError  # noqa: E402
from tests.scripts import script  # noqa: E402

pytestmark = pytest.mark.slow
SECONDS = 400.0  # of a budget that no machine of the tests reaches
ELBOW = 2
SUSPECTS = ("coulomb", "torque_gain_error", "payload")
ARM = script("arms/six_axis_robot")


def read(folder, seconds=12.0, links="", **faults):
    """Robot and logs, as their owner reads them."""
    return read_trial(ARM.SixAxisRobot(**faults).write(folder, seconds, links))


def of_robot(folder, **how):
    robot, records = read(folder, **how)
    return diagnose(Problem.from_logs(robot, records), seconds=SECONDS)


def first(answer):
    return answer["effects"][0]


def test_the_model_of_a_sound_arm_predicts_its_logs_down_to_the_noise(tmp_path):
    robot, records = read(tmp_path, seconds=6.0)
    problem = Problem.from_logs(robot, records)
    error = build_hypothesis(problem, ()).error(0)
    assert error.std(axis=0).max() < 1.3 * ARM.NOISE
    assert 0.1 < problem.mass_coupling < 0.5
    still = dataclasses.replace(problem, links=dataclasses.replace(
        problem.links, has_coupling=False))
    assert build_hypothesis(still, ()).error(0).std(axis=0).max() > 5 * ARM.NOISE


@pytest.mark.parametrize("lines, message", [
    ("sign = [1, -1, 1, 1, 1, 1]", "shoulder_lift counts in the other direction"),
    ("zero_rad = [0, 0, 1.5708, 0, 0, 0]", "elbow begins -90 degrees away"),
    ("zero_rad = [0, 0, 0, 0, -1.5708, 0]", r"wrist_2 begins \+90 degrees away")])
def test_a_joint_that_counts_otherwise_stops_the_diagnosis(tmp_path, lines, message):
    robot, records = read(tmp_path, seconds=8.0, links=lines, coulomb={ELBOW: 6.0})
    with pytest.raises(ClieError, match=message):
        Problem.from_logs(robot, records)
    assert Problem.from_logs(robot, records, trust_logs=True).links.known


def written_with(folder, signals, factor):
    """Logs of a sound arm of which some signals were written in another unit."""
    robot, records = read(folder, seconds=4.0)
    return robot, [record.replace(**{name: factor * record.signal(name) for name in signals})
                   for record in records]


@pytest.mark.parametrize("signals, factor, message", [
    (("q", "qd"), 180 / np.pi, "are in degrees"),
    (("u",), 100.0, "on the joint side of the gear")])
def test_units_and_sides_are_corrected_where_the_law_proves_them(tmp_path, signals, factor,
                                                                 message):
    problem = Problem.from_logs(*written_with(tmp_path, signals, factor))
    assert any(message in str(one) for one in problem.corrections)
    assert build_hypothesis(problem, ()).error(0).std(axis=0).max() < 1.3 * ARM.NOISE


@pytest.mark.parametrize("signals, factor, line", [
    (("q", "qd"), 180 / np.pi, r'State q = "deg" in \[units\]'),
    (("u",), 100.0, "State gear_ratio = 1 .*or the command divided by the gear ratio")])
def test_where_no_law_is_known_the_links_name_units_and_sides(tmp_path, signals, factor, line):
    robot, records = written_with(tmp_path, signals, factor)
    unknown = dataclasses.replace(robot, controller=Controller())
    with pytest.raises(ClieError, match=line):
        Problem.from_logs(unknown, [record.replace(robot=unknown) for record in records])


OFF = (1.25, 0.8, 1.3, 0.75, 1.25, 0.8)  # true masses over those stated, within 5 % by the file
CENTRES = {1: (0.04, 0.0, 0.0), 2: (-0.05, 0.0, 0.02), 3: (0.0, 0.02, 0.01)}  # m beside


@pytest.mark.parametrize("faults, links", [
    ({"masses": OFF, "centres": CENTRES, "coulomb": {ELBOW: 6.0}},
     "mass_tolerance = 0.05\ncom_tolerance_m = 0.005"),
    ({"coulomb": {ELBOW: 6.0}}, None)])
def test_links_that_are_wrong_or_not_stated_accuse_nothing_else(tmp_path, faults, links):
    robot, records = read(tmp_path, 4.0, links or "", **faults)
    if links is None:
        robot = dataclasses.replace(robot, links=Links(), tree=None)
        records = [record.replace(robot=robot) for record in records]
    answer = diagnose(Problem.from_logs(robot, records), effects=SUSPECTS, seconds=60.0).to_dict()
    accused = [row for row in answer["effects"] if row["probability"] >= 0.5
               and row["effect"] not in ("none", "unknown", "parametric")]
    assert all((row["effect"], row["joint"]) == ("coulomb", [ELBOW + 1]) for row in accused)
    assert not accused or "coulomb" in faults


def test_a_sound_arm_has_no_gap(tmp_path):
    assert of_robot(tmp_path).to_dict()["verdict"] == "none"


def test_coarse_commands_of_a_sound_arm_are_no_gap(tmp_path):
    step = 5e-4  # N m; commands of the wrist spread over fifty such steps
    assert of_robot(tmp_path, command_step=step).to_dict()["verdict"] == "none"


def test_dry_friction_of_the_elbow_is_named_there(tmp_path):
    answer = of_robot(tmp_path, coulomb={ELBOW: 6.0}).to_dict()
    assert answer["verdict"] == "effect"
    assert first(answer)["effect"] == "coulomb" and first(answer)["joint"] == [ELBOW + 1]
    level = first(answer)["parameters"]["level"]["value"]
    assert np.ravel(level) == pytest.approx(6.0 / 100.0, rel=0.05)  # motor side


def test_a_weak_drive_is_not_taken_for_a_wrong_link(tmp_path):
    answer = of_robot(tmp_path, gain={1: 0.93}).to_dict()
    assert first(answer)["effect"] == "torque_gain_error" and first(answer)["joint"] == [2]


def test_a_payload_that_the_file_does_not_know_is_named_with_its_mass(tmp_path):
    answer = of_robot(tmp_path, payload=0.8).to_dict()
    assert first(answer)["effect"] == "payload"
    assert np.ravel(first(answer)["parameters"]["mass"]["value"]) == pytest.approx(0.8, rel=0.05)


def test_masses_within_their_tolerance_are_no_effect(tmp_path):
    masses = (1.03, 0.96, 1.04, 0.97, 1.02, 0.99)
    robot, records = read(tmp_path, links="mass_tolerance = 0.05", masses=masses)
    problem = Problem.from_logs(robot, records)
    _, fitted = fit_nominal(problem, METHOD)
    ratio = fitted.hypothesis.values["links.mass"] / problem.links.mass
    assert ratio[1:3] == pytest.approx(masses[1:3], abs=0.005)
    answer = diagnose(problem, seconds=SECONDS).to_dict()
    assert answer["verdict"] == "none" and answer["description"] == []
    assert answer["joint_model"]["mass"]["value"] == pytest.approx(
        fitted.hypothesis.values["links.mass"])


def test_a_link_beyond_its_tolerance_is_named_with_its_mass(tmp_path):
    answer = of_robot(tmp_path, links="mass_tolerance = 0.02",
                      masses=(1.0, 1.0, 1.3, 1.0, 1.0, 1.0)).to_dict()
    assert answer["verdict"] == "parametric"
    entry = answer["description"][0]
    assert (entry["key"], entry["joint"]) == ("links.mass_kg", ELBOW + 1)
    assert entry["identified"] == pytest.approx(1.3 * 2.33, rel=0.02)


def test_centres_of_mass_within_their_tolerance_are_no_effect(tmp_path):
    centres = {1: (0.008, 0.0, 0.0), 2: (-0.006, 0.0, 0.0)}
    robot, records = read(tmp_path, links="com_tolerance_m = 0.01", centres=centres)
    problem = Problem.from_logs(robot, records)
    _, fitted = fit_nominal(problem, METHOD)
    moved = np.linalg.norm(fitted.hypothesis.values["links.com"] - problem.links.com, axis=1)
    assert moved[1:3] == pytest.approx([0.008, 0.006], abs=0.002)
    assert diagnose(problem, seconds=SECONDS).to_dict()["verdict"] == "none"


def test_a_fault_is_found_beside_masses_that_are_off(tmp_path):
    answer = of_robot(tmp_path, links="mass_tolerance = 0.05", coulomb={ELBOW: 6.0},
                      masses=(1.03, 0.96, 1.04, 0.97, 1.02, 0.99)).to_dict()
    assert first(answer)["effect"] == "coulomb" and first(answer)["joint"] == [ELBOW + 1]


def test_a_base_that_leans_is_named(tmp_path):
    answer = of_robot(tmp_path, tilt=0.03).to_dict()
    assert first(answer)["effect"] == "base_tilt"
    assert abs(np.ravel(first(answer)["parameters"]["tilt_x"]["value"])[0]) == pytest.approx(
        0.03, rel=0.1)


def test_the_exported_arm_moves_as_the_answer_says(tmp_path):
    diagnosis = of_robot(tmp_path, payload=0.8)
    diagnosis.export("mujoco", tmp_path)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.corrected.xml"))
    data = mujoco.MjData(model)
    record = diagnosis.problem.records[-1]
    every = round(record.sample_time / model.opt.timestep)
    data.qpos[:] = record.q[0]
    q = np.empty_like(record.q)
    for i, command in enumerate(record.u[:2000]):  # the command drifts away where nothing holds it
        q[i] = data.qpos
        data.ctrl[:] = command
        mujoco.mj_step(model, data, every)
    error = np.sqrt(np.mean((q[:2000] - record.q[:2000]) ** 2, axis=0))
    assert error.max() < 0.02
