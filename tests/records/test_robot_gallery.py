"""The gallery of known robots: files that read as they stand, with numbers as published."""

import importlib.metadata
import importlib.util
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from clie_blocks.analysis.cli import main
from clie_blocks.analysis.records import read_robot
from clie_blocks.analysis.records.gallery import FOLDER, ROBOTS, gallery_files
from clie_blocks.rigid_body.dynamics import gravity_torque
from clie_blocks.rigid_body.model_file import read_model

MODELS = sorted(path.stem for path in FOLDER.glob("*.urdf"))
UNIVERSAL = {  # a, d [m], alpha [quarter turns], mass [kg], centre of mass [m], as published
    "ur5e": ((0, .1625, 1, 3.761, (0, -.02561, .00193)), (-.425, 0, 0, 8.058, (.2125, 0, .11336)),
             (-.3922, 0, 0, 2.846, (.15, 0, .0265)), (0, .1333, 1, 1.37, (0, -.0018, .01634)),
             (0, .0997, -1, 1.3, (0, .0018, .01634)), (0, .0996, 0, .365, (0, 0, -.001159))),
    "ur10e": ((0, .1807, 1, 7.369, (.021, 0, .027)), (-.6127, 0, 0, 13.051, (.38, 0, .158)),
              (-.57155, 0, 0, 3.989, (.24, 0, .068)), (0, .17415, 1, 2.1, (0, .007, .018)),
              (0, .11985, -1, 1.98, (0, .007, .018)), (0, .11655, 0, .615, (0, 0, -.026)))}


def written(name, folder):
    assert main(["robot", name, "-o", str(folder)]) == 0
    return folder / "robot.toml"


def test_the_gallery_lists_what_ships(capsys):
    assert main(["robot", "--gallery"]) == 0
    printed = capsys.readouterr().out
    assert all(name in printed and text in printed for name, text in ROBOTS.items())
    assert {path.stem for path in FOLDER.glob("*.toml")} == set(ROBOTS) > set(MODELS)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_file_of_the_gallery_is_sound_and_names_its_sources(name, tmp_path, capsys):
    path = written(name, tmp_path)
    assert main(["robot", "--check", str(path)]) == 0
    assert "error" not in capsys.readouterr().err
    texts = gallery_files(name, "robot.toml")
    sources = [texts.get(f"{name}.urdf", ""), texts["robot.toml"]]
    assert name == "paper-arm" or re.search(r"\b20\d\d\b|github\.com", "".join(sources))
    for key in re.findall(r"^# \? (\w+) = .*$", texts["robot.toml"], re.MULTILINE):
        assert f"\n{key} = " not in texts["robot.toml"], "open, and stated"
    path.write_text(texts["robot.toml"].replace("# ? ", ""))  # the lines for the user are lines
    assert read_robot(path).n == len(read_robot(path).joints)


def test_an_unknown_robot_names_the_nearest_and_a_file_of_the_user_stays(tmp_path, capsys):
    assert main(["robot", "ur5", "-o", str(tmp_path)]) == 2
    assert "did you mean 'ur5e'" in capsys.readouterr().err
    (tmp_path / "panda.urdf").write_text("mine")
    assert main(["robot", "panda", "-o", str(tmp_path)]) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["panda.urdf"]


def test_the_output_may_be_named_as_a_file(tmp_path, capsys):
    assert main(["robot", "ur5e", "-o", str(tmp_path / "mine.toml")]) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "mine.toml", "robot.schema.json", "ur5e.urdf"]
    assert read_robot(tmp_path / "mine.toml").tree.n == 6


def test_the_models_are_those_of_the_script():
    path = Path(__file__).parents[2] / "docs" / "robot_gallery.py"
    spec = importlib.util.spec_from_file_location("robot_gallery", path)
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    assert sorted(script.ARMS) == MODELS
    for name, arm in script.ARMS.items():
        assert (FOLDER / f"{name}.urdf").read_text() == script.urdf(name, arm)


@pytest.mark.parametrize("name", UNIVERSAL)
def test_weights_are_the_slope_of_the_height_of_the_masses_by_denavit_and_hartenberg(name):
    def energy(q):
        frame, sum_of_masses = np.eye(4), 0.0
        for angle, (a, d, alpha, mass, com) in zip(q, UNIVERSAL[name]):
            c, s = np.cos(angle), np.sin(angle)
            ca, sa = round(np.cos(alpha * np.pi / 2)), round(np.sin(alpha * np.pi / 2))
            frame = frame @ np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s],
                                      [0, sa, ca, d], [0, 0, 0, 1]])
            sum_of_masses += 9.81 * mass * (frame @ [*com, 1])[2]
        return sum_of_masses

    tree = read_model(FOLDER / f"{name}.urdf", tip="flange")
    q, h = np.random.default_rng(0).uniform(-2, 2, 6), 1e-5
    slope = [(energy(q + h * e) - energy(q - h * e)) / (2 * h) for e in np.eye(6)]
    np.testing.assert_allclose(gravity_torque(tree, q), slope, atol=1e-6)


def public_robot(ending):
    """File of example-robot-data, which has data and no module."""
    try:
        files = importlib.metadata.files("example-robot-data") or []
    except importlib.metadata.PackageNotFoundError:
        pytest.skip("example-robot-data is not installed")
    return next(file.locate() for file in files if str(file).endswith(f"/{ending}"))


def without_hand(path):
    """Text of a URDF without links and joints of a hand."""
    root = ElementTree.parse(path).getroot()
    for part in [*root]:
        if re.search("hand|finger", part.get("name", "")):
            root.remove(part)
    return ElementTree.tostring(root, "unicode")


@pytest.mark.parametrize(("name", "model", "joints"), [
    ("panda", "panda.urdf", "panda_joint{}"), ("xarm7", "xarm7.urdf", "joint{}"),
    ("so101", "so101.urdf", None)])
def test_an_arm_weighs_what_another_description_of_it_weighs(name, model, joints):
    pinocchio = pytest.importorskip("pinocchio")
    arm = pinocchio.buildModelFromXML(without_hand(public_robot(model)))
    tree = read_model(FOLDER / f"{name}.urdf", tip="flange")
    names = [joints.format(k + 1) for k in range(tree.n)] if joints else tree.names
    at = [arm.joints[arm.getJointId(joint)].idx_q for joint in names]
    q = np.random.default_rng(0).uniform(-1, 1, (5, tree.n))
    for pose in q:
        whole = pinocchio.neutral(arm)
        whole[at] = pose
        theirs = pinocchio.computeGeneralizedGravity(arm, arm.createData(), whole)[at]
        np.testing.assert_allclose(gravity_torque(tree, pose), theirs,
                                   atol=2e-3 * np.abs(theirs).max())


@pytest.mark.parametrize("name", ["gen3", "go2-leg"])
def test_mujoco_reads_the_same_weights(name):
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string((FOLDER / f"{name}.urdf").read_text())
    data = mujoco.MjData(model)
    tree = read_model(FOLDER / f"{name}.urdf", tip="flange")
    for pose in np.random.default_rng(0).uniform(-1, 1, (5, tree.n)):
        data.qpos[:] = pose
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(gravity_torque(tree, pose), data.qfrc_bias, atol=1e-4)


def logs(mujoco, folder, robot, seconds, amplitude):
    """Write a log of a robot under its stated law, from the other engine, each joint in turns."""
    model = mujoco.MjModel.from_xml_string((folder / robot.links.model).read_text())
    ratio, motor, law = robot.motor.gear_ratio, robot.motor, robot.controller
    ratio = np.ones(robot.n) if ratio is None else ratio
    model.dof_armature[:] = ratio**2 * motor.inertia
    model.dof_damping[:] = ratio**2 * motor.viscous_friction
    model.jnt_limited[:], model.geom_contype[:] = 0, 0
    model.opt.timestep, model.opt.integrator = law.sample_time / 2, 1
    data, start = mujoco.MjData(model), np.linspace(0.3, -0.9, robot.n)
    data.qpos[:] = start
    rng, rows, before = np.random.default_rng(1), [], None
    for k in range(round(seconds / law.sample_time)):
        t = k * law.sample_time
        q_d = start + amplitude * np.sin(2 * np.pi * np.geomspace(0.4, 1.7, robot.n) * t)
        q = data.qpos + rng.normal(0.0, 2e-5, robot.n)
        before = q if before is None else before
        u = law.kp * (q_d - q) - law.kd * (q - before) / law.sample_time
        rows.append(np.r_[t, q, q_d, u])
        before, data.qfrc_applied[:] = q, ratio * u
        mujoco.mj_step(model, data, 2)
    head = ",".join(["time", *(f"{name}_{joint}" for name in ("q", "qd", "u")
                               for joint in robot.joints)])
    np.savetxt(folder / "log-1.csv", rows, "%.9g", ",", header=head, comments="")


@pytest.mark.parametrize(("name", "lines"), [
    ("go2-leg", {"Kp": "[20.0, 20.0, 20.0]", "Kd": "[1.5, 1.5, 1.5]", "sample_time_s": "0.002",
                 "viscous_friction_nms": "[0.05, 0.05, 0.05]"}),
    ("ur5e", {"Kp": "[30.0, 60.0, 30.0, 8.0, 8.0, 8.0]", "Kd": "[2.0, 4.0, 2.0, 0.5, 0.5, 0.5]",
              "gear_ratio": "[101.0, 101.0, 101.0, 101.0, 101.0, 101.0]",
              "inertia_kgm2": "[2e-4, 2e-4, 2e-4, 5e-5, 5e-5, 5e-5]",
              "viscous_friction_nms": "[4e-3, 4e-3, 4e-3, 1e-3, 1e-3, 1e-3]"})])
def test_a_sound_log_of_a_robot_of_the_gallery_passes_the_check(name, lines, tmp_path, capsys):
    mujoco = pytest.importorskip("mujoco")
    path = written(name, tmp_path)
    text = path.read_text()
    for key, value in {**lines, "velocity_filter": '"difference"'}.items():
        text, changed = re.subn(rf"^# \? {key} = .*$", f"{key} = {value}", text, flags=re.M)
        text = text if changed else text.replace("[controller]", f"[controller]\n{key} = {value}")
    path.write_text(text)
    logs(mujoco, tmp_path, read_robot(path), 8.0, 0.3)
    assert main(["check", str(tmp_path)]) == 0, capsys.readouterr().out
    assert "ERROR" not in capsys.readouterr().out
