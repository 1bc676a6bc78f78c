"""Faults of a simulator, injected in MuJoCo and named from its logs and its files."""

import dataclasses
import json

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.blind.simulator_faults import run  # noqa: E402
from clie_blocks.analysis.blind.simulator_faults.injected import (  # noqa: E402
    DELAY,
    DELAYED,
    INJECTED,
    NONE,
)
from clie_blocks.analysis.blind.simulator_faults.joint import (  # noqa: E402
    PERIOD,
    draw_joint,
    experiments,
)
from clie_blocks.analysis.blind.simulator_faults.run import model_text, simulate  # noqa: E402
from clie_blocks.analysis.blind.simulator_faults.trials import robot_text  # noqa: E402
from clie_blocks.analysis.gap.command import main  # noqa: E402
from clie_blocks.analysis.gap.simulator_faults.command import (  # noqa: E402
    lines,
    suspect_paths,
)
from clie_blocks.analysis.gap.simulator_faults.faults import FAULTS  # noqa: E402
from clie_blocks.analysis.gap.simulator_faults.soft_friction import (  # noqa: E402
    CREEP_PER_ACCELERATION,
)
from clie_blocks.errors import ClieError, RecordError  # noqa: E402

SEED, SAMPLES, LOGS = 31, 800, 2  # no seed of a study
HEAD = "time,q1,u1,qd1,pe1"


def save(folder, k, rows, head=HEAD):
    np.savetxt(folder / f"log-{k}.csv", rows, delimiter=",", header=head, comments="",
               fmt="%.9g")


def make(folder, name, columns=slice(None), change=lambda rows: rows):
    """Files of a simulator with a fault, and its logs; returns the model file."""
    rng = np.random.default_rng(SEED)
    joint = draw_joint(rng)
    motions = experiments(rng, joint)[:LOGS]
    if name in DELAYED:
        joint = dataclasses.replace(joint, delay=DELAY)
    injected = INJECTED[name](rng, joint)
    (folder / "joint.xml").write_text(model_text(joint))
    (folder / "robot.toml").write_text(robot_text(joint))
    for k, (q_d, pe) in enumerate(motions, 1):
        rows = change(simulate(joint, injected, q_d[:SAMPLES], pe[:SAMPLES]))
        save(folder, k, rows[:, columns], ",".join(np.array(HEAD.split(","))[columns]))
    return folder / "joint.xml"


@pytest.mark.slow
@pytest.mark.parametrize("name", INJECTED)
def test_a_fault_is_named_first(name, tmp_path):
    model = make(tmp_path, name)
    found = suspect_paths([tmp_path], model)
    assert found.verdict == name
    if name != NONE:
        first = found.suspected[0]
        assert first.probability > 0.5 and first.gap < 0.5 * found.gap


def test_every_injected_fault_is_one_of_the_list():
    names = [fault.name for fault in FAULTS]
    assert len(set(names)) == len(names)
    assert set(INJECTED) - {NONE} <= set(names)


def test_the_line_of_the_model_is_shown(tmp_path, capsys):
    model = make(tmp_path, "friction_without_effect")
    code = main(["--simulated", str(tmp_path), "--model", str(model), "-o", str(tmp_path)])
    out = " ".join(capsys.readouterr().out.split())
    line = next(number for number, text in enumerate(model.read_text().splitlines(), 1)
                if "<joint" in text)
    assert code == 0
    assert "runs without the dry friction of its file at hinge" in out
    assert f"joint.xml:{line}: <joint>, frictionloss=" in out
    stored = json.loads((tmp_path / "simulator.json").read_text())
    assert stored["verdict"] == "friction_without_effect"
    assert lines(stored)[0].startswith(str(model))


def test_noise_and_a_missing_command_do_not_hide_a_fault(tmp_path):
    rng = np.random.default_rng(1)

    def noisy(rows):
        rows[:, 1] += 1e-4 * rng.standard_normal(len(rows))
        return rows

    model = make(tmp_path, "gravity_twice", [0, 1, 3, 4], noisy)
    assert suspect_paths([tmp_path], model).verdict == "gravity_twice"


@pytest.mark.parametrize("is_stated", [False, True])
def test_a_spring_that_no_file_states_is_unknown(is_stated, tmp_path, monkeypatch):
    """None of the faults can imitate it; one that is stated is part of the run."""
    rng = np.random.default_rng(SEED)
    joint = draw_joint(rng)
    motions = experiments(rng, joint)[:LOGS]
    model = make(tmp_path, NONE)
    spring = f'stiffness="{0.5 * joint.kp * joint.gear!r}" springref="0.4" armature='
    monkeypatch.setattr(run, "MODEL", run.MODEL.replace("armature=", spring))
    if is_stated:
        model.write_text(model_text(joint))
    for k, (q_d, pe) in enumerate(motions, 1):
        save(tmp_path, k, simulate(joint, run.Run(), q_d[:SAMPLES], pe[:SAMPLES]))
    found = suspect_paths([tmp_path], model)
    assert found.verdict == (NONE if is_stated else "unknown")
    assert is_stated or "no known fault" in lines(found.to_dict())[0]
    assert found.gap < 2e-4 if is_stated else found.gap > 1e-2


def test_the_creep_of_soft_friction_is_that_of_the_engine():
    """A joint under half of its friction moves at the speed that the constraint lets through."""
    inertia, level, torque = 0.02, 0.1, 0.05
    model = mujoco.MjModel.from_xml_string(f"""<mujoco><option timestep="0.0005" gravity="0 0 0"/>
      <worldbody><body><inertial pos="0 0 0" mass="1" diaginertia="{inertia} {inertia} {inertia}"/>
      <joint name="q" axis="0 0 1" frictionloss="{level}"/></body></worldbody>
      <actuator><motor joint="q"/></actuator></mujoco>""")
    data = mujoco.MjData(model)
    data.ctrl[0] = torque
    mujoco.mj_step(model, data, 2000)
    assert data.qvel[0] == pytest.approx(CREEP_PER_ACCELERATION * torque / inertia, rel=0.03)


ARM = """<mujoco><option timestep="0.0005" integrator="implicitfast"/><worldbody>
<body><inertial pos="0.15 0 0" mass="1.2" diaginertia="1e-3 1e-2 1e-2"/>
<joint name="shoulder" axis="0 -1 0" armature="0.05" damping="0.3" frictionloss="0"/>
<body pos="0.3 0 0"><inertial pos="0.1 0 0" mass="0.6" diaginertia="1e-3 4e-3 4e-3"/>
<joint name="elbow" axis="0 -1 0" armature="0.02" damping="{damping}" frictionloss="0"/>
</body></body></worldbody><actuator><motor joint="shoulder"/><motor joint="elbow"/></actuator>
</mujoco>"""
ARM_ROBOT = """name = "arm"
joints = 2
joint_names = ["shoulder", "elbow"]
[motor]
gear_ratio = [1.0, 1.0]
[links]
model = "arm.xml"
[controller]
Kp = [40.0, 12.0]
Kd = [4.0, 1.0]
velocity_filter = "difference"
sample_time_s = 0.005
"""


@pytest.mark.slow
def test_the_joint_of_an_arm_is_named(tmp_path):
    (tmp_path / "arm.xml").write_text(ARM.format(damping=0.1))
    (tmp_path / "robot.toml").write_text(ARM_ROBOT)
    time = PERIOD * np.arange(SAMPLES)
    q_d = np.column_stack([0.5 * np.sin(3.0 * time), 0.6 * np.sin(4.1 * time + 1.0)])
    model = mujoco.MjModel.from_xml_string(ARM.format(damping=0.0))
    data, last, rows = mujoco.MjData(model), q_d[0], []
    data.qpos[:] = q_d[0]
    for now, wanted in zip(time, q_d, strict=True):
        q = data.qpos.copy()
        u = np.array([40.0, 12.0]) * (wanted - q) - np.array([4.0, 1.0]) * (q - last) / PERIOD
        last = q
        rows.append([now, *q, *u, *wanted])
        data.ctrl[:] = u
        mujoco.mj_step(model, data, 10)
    save(tmp_path, 1, np.array(rows), "time,q1,q2,u1,u2,qd1,qd2")
    found = suspect_paths([tmp_path], tmp_path / "arm.xml")
    assert found.verdict == "damping_without_effect"
    assert found.to_dict()["faults"][0]["joints"] == ["elbow"]


def test_files_that_do_not_go_together_are_refused(tmp_path):
    model = make(tmp_path, NONE)
    other = tmp_path / "other.xml"
    other.write_text(model.read_text().replace('"hinge"', '"knee"'))
    with pytest.raises(RecordError, match="no joint 'hinge'.*knee"):
        suspect_paths([tmp_path], other)
    other.write_text("<robot/>")
    with pytest.raises(RecordError, match="begins with <robot>"):
        suspect_paths([tmp_path], other)
    with pytest.raises(RecordError, match="cannot be read"):
        suspect_paths([tmp_path], tmp_path / "missing.xml")
    with pytest.raises(ClieError, match="without logs of a robot"):
        main([str(tmp_path), "--simulated", str(tmp_path), "--model", str(model)])


PAIRS = [({"gravity": 2.0, "gains": 2.0}, ("gravity_twice", "gains_twice")),
         ({"changed": {"damping": 0.0, "armature": 0.0}},
          ("damping_without_effect", "armature_without_effect")),
         ({"soft": True, "gravity": 0.0}, ("soft_friction", "gravity_missing"))]


@pytest.mark.slow
@pytest.mark.parametrize("changes, names", PAIRS)
def test_two_faults_at_once_are_unknown_or_one_of_them_first(changes, names, tmp_path):
    """The list holds one fault at a time: no other one may take the place of two."""
    rng = np.random.default_rng(SEED)
    joint = draw_joint(rng)
    motions = experiments(rng, joint)[:LOGS]
    model = make(tmp_path, NONE)
    for k, (q_d, pe) in enumerate(motions, 1):
        save(tmp_path, k, simulate(joint, run.Run(**changes), q_d[:SAMPLES], pe[:SAMPLES]))
    found = suspect_paths([tmp_path], model)
    assert found.verdict in ("unknown", *names)
