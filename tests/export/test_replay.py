"""``clie replay``: what a right model leaves is the floor that it prints."""

import dataclasses
import json
import re

import numpy as np
import pytest

from clie_blocks.analysis import cli
from clie_blocks.analysis.export.events import from_the_start
from clie_blocks.analysis.export.mujoco_stub import stub
from clie_blocks.analysis.export.mujoco_target import export_mujoco
from tests.export import robots

mujoco = pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
SIGMA = 1e-4  # rad
ROBOT = f"""name = "joint"
joints = 1
joint_names = ["j1"]
[motor]
gear_ratio = [1.0]
inertia_kgm2 = [{robots.INERTIA}]
viscous_friction_nms = [{robots.DAMPING}]
[controller]
Kp = [{robots.KP}]
Kd = [{robots.KD}]
velocity_filter = "difference"
sample_time_s = {robots.PERIOD}
"""


def run(text, q_d, noise, start=0.0, encoder=lambda q: q):
    """Positions of a model whose law sees noise, and commands, shapes (N,) [rad, N m]."""
    model = mujoco.MjModel.from_xml_string(text)
    data, q, u, last = mujoco.MjData(model), np.zeros(len(q_d)), np.zeros(len(q_d)), None
    data.qpos[0] = start
    for i, wanted in enumerate(q_d):
        q[i] = data.qpos[0]
        seen = encoder(q[i]) + noise[i]
        last = seen if last is None else last
        u[i], last = robots.KP * (wanted - seen) - robots.KD * (seen - last) / robots.PERIOD, seen
        data.ctrl[0] = u[i]
        mujoco.mj_step(model, data, round(robots.PERIOD / model.opt.timestep))
    return q, u


def save_log(path, q, u, q_d):
    np.savetxt(path, np.column_stack([robots.PERIOD * np.arange(len(q)), q, u, q_d]),
               delimiter=",", fmt="%.9g", header="time,q1,u1,qd1", comments="")


@pytest.mark.parametrize("name, size, least", [(None, 1.0, 0.98), ("coulomb", 0.1, 1.1)])
def test_the_truth_leaves_the_floor(name, size, least, tmp_path, capsys):
    """Logs of the exported model itself, with noise: its gap and floor are what this noise does.

    In small motions it frees a joint that dry friction would hold, and so does more than itself.
    """
    exported = export_mujoco(robots.correction(*([robots.setting(name)] if name else [])))
    exported.save(tmp_path / "model")
    text = (tmp_path / "model" / "robot.corrected.xml").read_text()
    logs, rng, left = tmp_path / "logs", np.random.default_rng(3), []
    logs.mkdir()
    (logs / "robot.toml").write_text(ROBOT)
    for k in range(2):
        q_d = size * (1 + k) / 2 * robots.set_points(3.0)
        noise = SIGMA * rng.standard_normal(len(q_d))
        q, u = run(text, q_d, noise)
        left.append(q + noise - run(text, q_d, 0.0 * noise, start=noise[0])[0])
        save_log(logs / f"log-{k}.csv", q + noise, u, q_d)
    code = cli.main(["replay", str(logs), "--model", str(
        tmp_path / "model" / "robot.corrected.xml"), "--json"])
    told = capsys.readouterr()
    assert code == 0, told.err
    (joint,) = json.loads(told.out)["joints"]
    assert joint["corrected"] == pytest.approx(robots.rms(np.concatenate(left)), rel=0.05)
    assert joint["floor"] == pytest.approx(joint["corrected"], rel=0.1)
    assert joint["floor"] > least * SIGMA


def test_a_law_begins_where_its_encoder_sees_the_joint(tmp_path, capsys):
    """The encoder reads 0.01 rad at the stated start of 0 rad, and no motion between the two."""
    uneven = {"sine": 0.004, "cosine": 0.01, "order": 8.0}

    def encoder(q):
        return (q + uneven["sine"] * np.sin(uneven["order"] * q)
                + uneven["cosine"] * np.cos(uneven["order"] * q))

    exported = export_mujoco(robots.correction(robots.setting("encoder_eccentricity", **uneven)))
    exported.save(tmp_path / "model")
    plain = export_mujoco(robots.correction()).files["robot.corrected.xml"]
    q_d = robots.set_points(2.0)
    q, u = run(plain, q_d, 0.0 * q_d, encoder=encoder)
    (tmp_path / "robot.toml").write_text(ROBOT + "[experiment.log-1]\nstart_rad = [0.0]\n")
    save_log(tmp_path / "log-1.csv", encoder(q), u, q_d)
    code = cli.main(["replay", str(tmp_path), "--model", str(
        tmp_path / "model" / "robot.corrected.xml"), "--json"])
    told = capsys.readouterr()
    assert code == 0, told.err
    (joint,) = json.loads(told.out)["joints"]
    assert joint["corrected"] < 2e-4 < 1e-3 < joint["nominal"]


def test_a_fault_sets_in_where_a_replayed_log_shows_it(tmp_path, capsys):
    """Logs of the package's own robot: later than in the diagnosis, from the start, never."""
    fault = robots.setting("step_fault", offset=0.1, coulomb=0.05, time=0.4)
    effects, events = from_the_start([fault], 1)
    corrected = dataclasses.replace(robots.correction(*effects), events=events)
    own = tmp_path / "own.xml"
    own.write_text(re.sub('timestep="[^"]*"', f'timestep="{robots.PERIOD}"', stub(corrected)))
    exported = export_mujoco(corrected, own)
    assert any("set in at 0.4 s of the first log" in note for note in exported.notes)
    exported.save(tmp_path / "model")
    q_d, times = robots.set_points(1.6), {"log-1": 1.1, "log-2": 0.0, "log-3": 1e6}
    (tmp_path / "robot.toml").write_text(ROBOT)
    for name, time in times.items():
        q = robots.reference([robots.setting("step_fault", **{**fault.values, "time": time})], q_d)
        u = robots.KP * (q_d - q) - robots.KD * np.diff(q, prepend=q[0]) / robots.PERIOD
        save_log(tmp_path / f"{name}.csv", q, u, q_d)
    code = cli.main(["replay", str(tmp_path), "--model", str(
        tmp_path / "model" / "own.corrected.xml"), "--json"])
    told = capsys.readouterr()
    assert code in (0, 1), told.err  # without noise, its floor is next to nothing
    found = json.loads(told.out)
    for one in found["set_in"]:
        assert one["time"] == pytest.approx(times[one["log"].removesuffix(".csv")], abs=0.01)
    (joint,) = found["joints"]
    assert joint["corrected"] < 1.2 * SIGMA < 20 * SIGMA < joint["nominal"]


@pytest.mark.parametrize("name, values, further", [
    ("periodic_disturbance", {"sine": 0.05, "cosine": 0.08, "frequency": 3.3}, "tone"),
    ("tick_jitter", {"spread": 0.02, "beat": 1.7, "phase": 0.2}, "phase"),
    ("packet_hold", {"hold": 0.06, "interval": 0.7, "phase": 0.45}, "phase")])
def test_what_comes_again_has_the_phase_of_the_replayed_log(name, values, further, tmp_path,
                                                            capsys):
    """Logs of the package's own robot, as in the diagnosis and a third of a turn further."""
    turns = 0.33

    def later(values):
        if further == "phase":
            return {**values, "phase": values["phase"] + turns}
        size, at = np.hypot(values["sine"], values["cosine"]), np.arctan2(values["cosine"],
                                                                          values["sine"])
        return {**values, "sine": size * np.cos(at + 2 * np.pi * turns),
                "cosine": size * np.sin(at + 2 * np.pi * turns)}

    corrected = robots.correction(robots.setting(name, **values))
    own = tmp_path / "own.xml"
    own.write_text(re.sub('timestep="[^"]*"', f'timestep="{robots.PERIOD}"', stub(corrected)))
    exported = export_mujoco(corrected, own)
    assert any(f"{name} at j1 has the phase" in note for note in exported.notes)
    exported.save(tmp_path / "model")
    q_d = robots.set_points(2.2)
    (tmp_path / "robot.toml").write_text(ROBOT)
    for log, of_log in (("log-1", values), ("log-2", later(values))):
        q = robots.reference([robots.setting(name, **of_log)], q_d)
        u = robots.KP * (q_d - q) - robots.KD * np.diff(q, prepend=q[0]) / robots.PERIOD
        save_log(tmp_path / f"{log}.csv", q, u, q_d)
    code = cli.main(["replay", str(tmp_path), "--model", str(
        tmp_path / "model" / "own.corrected.xml"), "--json"])
    told = capsys.readouterr()
    assert code in (0, 1), told.err  # without noise, its floor is next to nothing
    found = json.loads(told.out)
    first, second = (one["turns"] for one in found["begins"])
    assert abs((first + 0.5) % 1.0 - 0.5) < 0.01
    assert second == pytest.approx(turns, abs=0.01)
    (joint,) = found["joints"]
    assert joint["corrected"] < 0.05 * joint["nominal"]


def test_a_model_of_another_robot_is_refused(tmp_path, capsys):
    text = export_mujoco(robots.correction()).files["robot.corrected.xml"]
    (tmp_path / "other.xml").write_text(text.replace('"j1"', '"knee"'))
    q_d = robots.set_points(1.0)
    q, u = run(text, q_d, SIGMA * np.random.default_rng(0).standard_normal(len(q_d)))
    (tmp_path / "robot.toml").write_text(ROBOT)
    save_log(tmp_path / "log-1.csv", q, u, q_d)
    assert cli.main(["replay", str(tmp_path), "--model", str(tmp_path / "other.xml")]) in (2, 3)
    told = " ".join(capsys.readouterr().err.split())
    assert "other.xml has no joint 'j1', which the answer corrects" in told and "knee" in told


def test_files_of_another_version_are_refused_with_what_to_do(tmp_path, capsys):
    export_mujoco(robots.correction()).save(tmp_path)
    beside = tmp_path / "corrected_joints.json"
    beside.write_text(beside.read_text().replace('"schema_version": 2', '"schema_version": 1'))
    (tmp_path / "robot.toml").write_text(ROBOT)
    q_d = robots.set_points(1.0)
    q, u = run((tmp_path / "robot.corrected.xml").read_text(), q_d, 0.0 * q_d)
    save_log(tmp_path / "log-1.csv", q, u, q_d)
    assert cli.main(["replay", str(tmp_path), "--model",
                     str(tmp_path / "robot.corrected.xml")]) in (2, 3)
    assert "export the answer again" in " ".join(capsys.readouterr().err.split())
