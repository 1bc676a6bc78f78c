"""A wrist whose motors turn several joints, from MuJoCo: sound, with friction, and not stated."""

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.export.correction import correction_of  # noqa: E402
from clie_blocks.analysis.export.export import export  # noqa: E402
from clie_blocks.analysis.export.replay import replay  # noqa: E402
from clie_blocks.analysis.gap import diagnose  # noqa: E402
from clie_blocks.analysis.gap.fitting.hypothesis import build_hypothesis  # noqa: E402
from clie_blocks.analysis.gap.problem.problem import Problem  # noqa: E402
from clie_blocks.analysis.records import read_trial  # noqa: E402
from clie_blocks.analysis.records.checks import check_record  # noqa: E402
from clie_blocks.errors import ClieError, RecordError  # noqa: E402
from tests.gap.scenarios import coupled_wrist as wrist  # noqa: E402

STATED = f"motor_coupling = {wrist.C.tolist()}"
BEND, FRICTION = 1, 0.02  # N m, motor side


def rubbing(folder, **how):
    return read_trial(wrist.write(folder, friction=(0.0, FRICTION, 0.0), **how))


@pytest.mark.parametrize("of_joints", [True, False])
def test_links_rotors_and_drag_move_as_in_the_other_engine(tmp_path, of_joints):
    robot, records = read_trial(wrist.write(tmp_path, 3.0, lines=STATED, of_joints=of_joints))
    error = build_hypothesis(Problem.from_logs(robot, records), ()).error(0)
    assert error.std(axis=0).max() < 1.2 * np.hypot(wrist.NOISE, wrist.ENCODER_STEP / 12**0.5)


def test_a_coupling_that_is_not_stated_is_named_with_its_line(tmp_path):
    robot, records = read_trial(wrist.write(tmp_path, 4.0))
    (named,) = [f for f in check_record(records[0], robot) if f.check == "law.coupled"]
    assert named.severity == "error" and named.joint == "flange"
    assert "motor_coupling = [[1, 0, 0], [0, 1, 0], [0, -0.8, 1]]" in str(named)
    with pytest.raises(RecordError, match="turn several joints"):
        Problem.from_logs(robot, records)


@pytest.mark.slow
def test_dry_friction_of_a_motor_is_named_there_and_exported(tmp_path):
    diagnosis = diagnose(Problem.from_logs(*rubbing(tmp_path, lines=STATED)), seconds=400.0)
    answer = diagnosis.to_dict()
    first = answer["effects"][0]
    assert answer["verdict"] == "effect"
    assert (first["effect"], first["joint"]) == ("coulomb", [BEND + 1])
    level = first["parameters"]["level"]["value"]
    assert np.ravel(level) == pytest.approx(FRICTION, rel=0.05)
    diagnosis.export("mujoco", tmp_path)
    model = tmp_path / "robot.corrected.xml"
    moves_as_logged(model, diagnosis.problem.records[0])
    (gap,) = [row.corrected for row in replay(diagnosis.problem, model).gaps
              if row.joint == wrist.JOINTS[BEND]]
    assert gap < 1.2 * np.hypot(wrist.NOISE, wrist.ENCODER_STEP / 12**0.5)


def test_a_model_without_the_motors_as_tendons_is_refused_with_what_to_add(tmp_path):
    problem = Problem.from_logs(*rubbing(tmp_path, seconds=4.0, lines=STATED))
    correction = correction_of(diagnose(problem, effects=("coulomb",)).to_dict())
    with pytest.raises(ClieError, match="motors of this robot turn several joints") as refused:
        export(correction, "mujoco", tmp_path / "wrist.xml")
    assert '<joint joint="flange" coef="1"/>' in str(refused.value)
    with pytest.raises(ClieError, match="no motor that turns several joints"):
        export(correction, "gazebo")
    assert any("q_motor = [[1, 0, 0]" in note for note in export(correction, "c").notes)


def moves_as_logged(path, record):
    """Assert that the exported model follows the logged commands for a second."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    every = round(record.sample_time / model.opt.timestep)
    data.qpos[:] = wrist.C @ record.q[0]
    seen = np.empty_like(record.q[:500])
    for i, command in enumerate(record.u[:500]):  # nothing holds it: it drifts away later
        seen[i] = np.linalg.inv(wrist.C) @ data.qpos
        data.ctrl[:] = command
        mujoco.mj_step(model, data, every)
    assert np.abs(seen - record.q[:500]).max() < 0.005 < 0.1 < np.ptp(record.q[:500, BEND])


@pytest.mark.slow
def test_a_sound_wrist_has_no_gap(tmp_path):
    robot, records = read_trial(wrist.write(tmp_path, lines=STATED))
    assert diagnose(Problem.from_logs(robot, records)).to_dict()["verdict"] == "none"


@pytest.mark.slow
def test_a_coupling_that_is_not_stated_accuses_nothing(tmp_path):
    robot, records = rubbing(tmp_path, seconds=5.0, of_joints=False)
    answer = diagnose(Problem.from_logs(robot, records), seconds=8.0).to_dict()
    assert answer["verdict"] == "unexplained"
    assert all(row["probability"] < 0.5 for row in answer["effects"]
               if row["effect"] not in ("unknown", "none", "parametric"))
