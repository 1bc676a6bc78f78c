"""Users' simulators: long steps, other starts and clocks, missing columns."""

import json
import math

import numpy as np
import pytest

from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.command import main
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.simulated_logs import complete
from clie_blocks.analysis.gap.report.answer import answer
from clie_blocks.analysis.gap.simulator_comparison.logs import with_command
from clie_blocks.analysis.records import Record, read_robot, write_record
from clie_blocks.errors import RecordError
from clie_blocks.output import guarded

INERTIA, DAMPING, KP, KD, PERIOD, NOISE = 0.05, 0.2, 8.0, 0.6, 1e-3, 2e-5
TIME = PERIOD * np.arange(6000)
DRAG, DRY = 0.1, 0.05
ROBOT = f"""name = "axis"
joints = 1
[motor]
gear_ratio = [1.0]
inertia_kgm2 = [{INERTIA}]
viscous_friction_nms = [{DAMPING}]
inertia_tolerance = 0.01
viscous_friction_tolerance = 0.15
torque_offset_tolerance_nm = [0.02]
[controller]
Kp = [{KP}]
Kd = [{KD}]
velocity_filter = "difference"
sample_time_s = {PERIOD}
[encoder]
resolution_rad = 1e-6
"""


def fine(q, dq, torque, drag, dry):
    """The robot: twenty midpoint steps per sample, with dry friction that holds."""
    h = PERIOD / 20
    for _ in range(20):
        free = dq + h * (torque - DAMPING * dq - drag * dq * abs(dq)) / INERTIA
        held = h * dry / INERTIA
        after = 0.0 if abs(free) <= held else free - math.copysign(held, free)
        q, dq = q + h * (dq + after) / 2, after
    return q, dq


def semi_implicit(q, dq, torque, drag, dry):
    """One step per sample, as game engines do it."""
    dq += PERIOD * (torque - DAMPING * dq - drag * dq * abs(dq)) / INERTIA
    return q + PERIOD * dq, dq


def explicit(q, dq, torque, drag, dry):
    """Euler's method as it stands in a textbook."""
    rate = (torque - DAMPING * dq - drag * dq * abs(dq)) / INERTIA
    return q + PERIOD * dq, dq + PERIOD * rate


def implicit(q, dq, torque, drag, dry):
    """One step per sample, implicit in the friction."""
    dq = (dq + PERIOD * torque / INERTIA) / (1 + PERIOD * (DAMPING + drag * abs(dq)) / INERTIA)
    return q + PERIOD * dq, dq


def run(j, step=fine, drag=0.0, dry=0.0, noise=0.0, start=0.0):
    """Log of experiment j under the sampled law."""
    tones = np.array([0.21, 0.57, 1.3, 2.9, 4.7]) * (1.0, 1.17)[j]
    q_d = 0.7 * np.sin(2 * np.pi * 0.13 * (1 + j / 4) * TIME)
    pe = 0.3 * np.sin(2 * np.pi * np.outer(TIME, tones) + 3.0 * j).sum(axis=1)
    errors = noise * np.random.default_rng(j).standard_normal(len(TIME))
    q, dq, previous, rows = start, 0.0, start + errors[0], []
    for set_point, excitation, error in zip(q_d.tolist(), pe.tolist(), errors.tolist()):
        measured = q + error
        u = KP * (set_point - measured) - KD * (measured - previous) / PERIOD + excitation
        rows.append((measured, u))
        previous = measured
        q, dq = step(q, dq, u, drag, dry)
    signals = np.array(rows)
    return Record(time=TIME, q=signals[:, :1], u=signals[:, 1:], qd=q_d[:, None], pe=pe[:, None],
                  source=f"log-{j + 1}")


def logs(step=fine, **parameters):
    return [run(j, step, **parameters) for j in range(2)]


@pytest.fixture(scope="module")
def dragged():
    """Logs of the robot, with air drag that no simulator here has."""
    return logs(drag=DRAG, noise=NOISE)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("axis") / "robot.toml"
    path.write_text(ROBOT)
    return path


def compare(file, robot_records, simulated):
    """Diagnosis of a robot against its simulator."""
    return diagnose(Problem.from_logs(read_robot(file), robot_records).beside(simulated))


@pytest.mark.parametrize("step, lead", [
    (semi_implicit, "ahead, 0.5"), (implicit, "ahead, 0.5"), (explicit, "behind, 0.5")])
def test_the_difference_is_named_and_not_the_integrator(dragged, file, step, lead):
    diagnosis = compare(file, dragged, logs(step))
    leading = diagnosis.ranking[0]
    assert leading.names == ("quadratic_drag",) and leading.probability > 0.9
    assert diagnosis.reduction.after < 1.05 * diagnosis.reduction.floor
    assert any(lead in decision for decision in answer(diagnosis)["decisions"])


@pytest.mark.parametrize("step", [semi_implicit, implicit, explicit, fine])
def test_long_steps_alone_are_no_difference(file, step):
    diagnosis = compare(file, logs(noise=NOISE), logs(step))
    assert diagnosis.verdict == "none"
    decisions = " ".join(answer(diagnosis)["decisions"])
    assert ("integrator" in decisions) == (step is not fine)


def test_dry_friction_that_a_coarse_simulator_does_not_have_is_named(file):
    diagnosis = compare(file, logs(dry=DRY, noise=NOISE), logs(semi_implicit))
    assert diagnosis.ranking[0].names == ("coulomb",)
    level = diagnosis.model.hypothesis.values["coulomb.level"][0]
    assert level == pytest.approx(DRY, rel=0.03)


def test_another_origin_of_the_clock_and_another_start_do_not_matter(dragged, file):
    simulated = [record.replace(time=record.time + 100.0)
                 for record in logs(semi_implicit, start=0.05)]
    diagnosis = compare(file, dragged, simulated)
    assert diagnosis.ranking[0].names == ("quadratic_drag",)
    reduction = diagnosis.reduction
    assert reduction.after < 2.0 * reduction.floor < 0.1 * reduction.before


@pytest.mark.parametrize("factor, report", [(180 / np.pi, "degrees instead of rad"),
                                            (0.0, "moves 0 times as far")])
def test_a_simulator_that_moves_far_more_or_less_is_refused(dragged, file, factor, report):
    simulated = [record.replace(q=factor * record.q) for record in logs(semi_implicit)]
    with pytest.raises(RecordError, match=report):
        compare(file, dragged, simulated)


def test_missing_columns_are_filled_in(dragged):
    bare = dragged[1].replace(qd=None, pe=None, u=None)
    completed = complete(bare, 1, dragged)
    np.testing.assert_array_equal(completed.pe, dragged[1].pe)
    assert "no qd and no pe: taken from log-2" in completed.decisions[-1]
    assert complete(bare, 2, dragged) is bare and complete(dragged[0], 0, dragged) is dragged[0]


def test_a_missing_command_is_computed_by_the_stated_law(dragged, file):
    law = Problem.from_logs(read_robot(file), dragged).stated_law
    completed = with_command(dragged[0].replace(u=None), law)
    np.testing.assert_allclose(completed.u, dragged[0].u, atol=1e-12)


@pytest.fixture(scope="module")
def written(dragged, file):
    """Paths of the robot's logs, and the folder in which they lie."""
    for record in dragged:
        write_record(record, file.parent / f"{record.source}.csv")
    return [str(file.parent / f"log-{j + 1}.csv") for j in range(2)], file.parent


def test_a_table_of_time_and_position_is_enough(written, capsys):
    paths, folder = written
    simulated = []
    for record in logs(semi_implicit):
        simulated.append(str(folder / f"sim-{record.source}.csv"))
        np.savetxt(simulated[-1], np.column_stack([record.time, record.q]), delimiter=",",
                   header="time,q1", comments="")
    assert main([*paths, "--robot", str(folder / "robot.toml"), "--json",
                 "--simulated", *simulated]) == 0
    stored = json.loads(capsys.readouterr().out)
    assert stored["effects"][0]["effect"] == "quadratic_drag"
    decisions = " ".join(stored["decisions"])
    assert "no qd and no pe: taken from" in decisions and "no command: computed" in decisions


@pytest.mark.parametrize("text, report", [
    ("", ""), ("time,q1\n", ""), ("time,q1\n0,0\n", "1 sample"),
    ("time,q1\n" + "".join(f"{0.001 * i},nan\n" for i in range(6000)),
     "6000 of 6000 samples cannot be used"),
    ("when,what\n" + "".join(f"{0.001 * i},0.1\n" for i in range(6000)), "")])
def test_hostile_tables_are_refused_with_a_report(written, tmp_path, capsys, text, report):
    paths, folder = written
    (tmp_path / "sim.csv").write_text(text)
    code = guarded(main, [*paths, "--robot", str(folder / "robot.toml"), "--simulated",
                          str(tmp_path / "sim.csv")])
    error = capsys.readouterr().err
    assert code == 3 and "sim.csv" in error and report in error and "Traceback" not in error
