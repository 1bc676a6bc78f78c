"""The page 'From a log to a better simulator', run as it is printed."""

import json
import re
import shutil
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from clie_blocks.analysis.cli import main
from clie_blocks.analysis.gap.method.method import METHOD

PAGE = Path(__file__).parents[3] / "docs" / "from_a_log_to_a_better_simulator.md"
TRIAL = Path(__file__).resolve().parents[4] / "shared" / "blind" / "practice" / "trial-007"


def blocks(language):
    """Code blocks of the page in a language."""
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE.read_text(), re.DOTALL | re.MULTILINE)


def write_trial(made, folder):
    """Write a robot of one joint and its logs as a folder."""
    from clie_blocks.analysis.records import write_record

    folder.mkdir()
    motor, law, links = made.robot.motor, made.robot.controller, made.robot.links
    sections = {
        "motor": {"gear_ratio": motor.gear_ratio, "inertia_kgm2": motor.inertia,
                  "viscous_friction_nms": motor.viscous_friction, "inertia_tolerance": 0.01,
                  "viscous_friction_tolerance": 0.15,
                  "torque_offset_tolerance_nm": motor.torque_offset_tolerance},
        "links": {"length_m": links.length, "mass_kg": links.mass, "com_m": links.com,
                  "inertia_kgm2": links.inertia,
                  "joint_viscous_friction_nms": links.joint_viscous_friction},
        "nominal": {"gravity": made.robot.nominal.gravity},
        "controller": {"Kp": law.kp, "Kd": law.kd, "sample_time_s": law.sample_time,
                       "velocity_filter_highpass_rad_s": law.highpass,
                       "velocity_filter_lowpass_rad_s": law.lowpass,
                       "velocity_filter_discretisation": law.discretisation,
                       "command_resolution_nm": law.command_resolution},
        "encoder": {"resolution_rad": made.robot.encoder.resolution}}
    lines = [f"joints = {made.robot.n}"]
    for name, values in sections.items():
        lines += [f"[{name}]", *(f"{key} = {json.dumps(np.asarray(value).tolist())}"
                                 for key, value in values.items() if value is not None)]
    (folder / "robot.toml").write_text("\n".join(lines))
    for k, record in enumerate(made.records):
        write_record(record, folder / f"log-{k + 1}.csv")


@pytest.fixture
def robot_folder(tmp_path, case, monkeypatch):
    """Working folder with `my-robot`: the trial of the page, else a simulated robot."""
    folder = tmp_path / "my-robot"
    if TRIAL.is_dir():
        folder.mkdir()
        for file in TRIAL.iterdir():
            shutil.copyfile(file, folder / file.name)
    else:
        write_trial(case("coulomb", seed=1), folder)
    simulate(folder, tmp_path / "simulated")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def simulate(folder, output):
    """Write logs of a simulator that holds the refitted nominal model, and nothing else."""
    from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
    from clie_blocks.analysis.gap.problem.problem import Problem
    from clie_blocks.analysis.records import Record, read_trial, write_record

    robot, records = read_trial(folder)
    problem = Problem.from_logs(robot, records)
    nominal = fit_nominal(problem, METHOD)[1].hypothesis
    output.mkdir()
    for j, (log, record) in enumerate(zip(problem.logs, records, strict=True)):
        q, u = nominal.simulator.run(log, nominal.of_log(j))
        write_record(Record(time=record.time, q=q, u=u, qd=record.qd, pe=record.pe),
                     output / f"log-{j + 1}.csv")


@pytest.mark.slow
def test_the_page_runs_as_printed(robot_folder, capsys):
    commands = [line.split() for block in blocks("sh") for line in block.splitlines()]
    assert [words[1] for words in commands] == ["check", "identify", "diagnose", "diagnose"]
    for words in commands:
        assert words[0] == "clie" and main(words[1:]) == 0, words
    said = " ".join(capsys.readouterr().out.split())  # lines are wrapped
    assert said.count("coulomb at joint1") == 2
    _, block = blocks("python")
    exec(compile(block, str(PAGE), "exec"), {})
    assert capsys.readouterr().out.startswith("effect ['coulomb'")
    assert not (robot_folder / "report" / "my-robot.next.csv").exists()  # no run would help
    joint = ElementTree.parse(robot_folder / "report" / "my-robot.xml").find(".//joint")
    assert float(joint.get("frictionloss")) > 0.0


@pytest.mark.slow
def test_the_loop_of_the_page_runs_as_printed(tmp_path, monkeypatch, capsys):
    """The log is that of the page's joint with dry friction, in Euler steps of 0.1 ms."""
    from clie_blocks.analysis.records import Record, write_record

    time = 2e-3 * np.arange(7000)
    q_d, pe = 0.5 * np.sin(0.6 * time), 0.4 * np.sin(2.0 * time) + 0.3 * np.sin(7.0 * time)
    noise, rows, q, dq = np.random.default_rng(1).normal(0, 3e-5, len(time)), [], 0.0, 0.0
    for k in range(len(time)):
        for _ in range(20):
            u = 8.0 * (q_d[k] - q - noise[k]) - 0.6 * dq + pe[k]
            dq += 1e-4 * (u - 0.1 * dq) / 0.05
            dq -= np.clip(dq, -1e-4 * 0.04 / 0.05, 1e-4 * 0.04 / 0.05)
            q += 1e-4 * dq
        rows.append((q, u))
    measured, command = np.array([(0.0, pe[0]), *rows[:-1]]).T[..., None]
    write_record(Record(time=time, q=measured + noise[:, None], u=command, qd=q_d[:, None],
                        pe=pe[:, None]), tmp_path / "my-joint.csv")
    monkeypatch.chdir(tmp_path)
    exec(compile(blocks("python")[0], str(PAGE), "exec"), {})
    assert capsys.readouterr().out == "effect ('coulomb',)\n"


def test_the_robot_file_of_the_page_is_valid(tmp_path):
    from clie_blocks.analysis.records import read_robot

    (text,) = blocks("toml")
    (tmp_path / "robot.toml").write_text(text)
    robot = read_robot(tmp_path / "robot.toml")
    assert robot.n == 2 and robot.controller.law == "pd"
