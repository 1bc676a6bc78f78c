"""The user's own simulator instead of a model: only effects that it does not have are named."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.calibration.plant import simulate
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.report.answer import answer
from clie_blocks.errors import RecordError

FRICTION = 0.03  # of the torque scale 0.3 kp


@pytest.fixture(scope="module")
def machine(case):
    """Function that logs the experiments of one robot file with chosen physics."""
    made = case("none", seed=5)
    motor = made.robot.motor

    def logs(noise=1.0, **effects):
        records = made.records[:2]
        lanes = [{"q_d": record.qd[:, k], "pe": record.pe[:, k], "weight": 0.0, "offset": 0.0,
                  "inertia": inertia[k], "damping": inertia[k], "start": record.qd[0, k],
                  "kp": made.robot.controller.kp[k], "kd": made.robot.controller.kd[k],
                  "lsb": 1e-4, "sigma": 1e-4 * noise,
                  **({"forward": FRICTION * 0.3 * made.robot.controller.kp[0], **effects}
                     if k == 0 else {})}
                 for record in records for k in range(made.robot.n)]
        q, u = simulate(lanes, np.random.default_rng(int(10 * noise)))
        n = made.robot.n
        return [record.replace(q=q[:, n * j:n * j + n], u=u[:, n * j:n * j + n])
                for j, record in enumerate(records)]

    inertia = motor.gear_ratio * motor.inertia
    blank = dataclasses.replace(made.robot, motor=dataclasses.replace(
        motor, inertia=None, viscous_friction=None), links=type(made.robot.links)(),
        encoder=dataclasses.replace(made.robot.encoder, resolution=np.full(made.robot.n, 1e-4)),
        controller=dataclasses.replace(made.robot.controller, command_resolution=None))
    return blank, logs


def compare(machine, of_robot):
    """Diagnosis of a machine with some physics, against a simulator that holds coulomb."""
    robot, logs = machine
    return diagnose(Problem.from_logs(robot, logs(**of_robot)).beside(logs(noise=0.5)))


@pytest.mark.slow
def test_a_simulator_with_all_effects_of_the_robot_leaves_no_gap(machine):
    diagnosis = compare(machine, {})
    assert diagnosis.verdict == "none"
    assert {member.cause.name for member in diagnosis.residuals.problem.inside} == {"coulomb"}


@pytest.mark.slow
@pytest.mark.parametrize("effect, parameter", [("time_delay", {"delay": 0.008}),
                                               ("quadratic_drag", {"quadratic": 0.3})])
def test_only_an_effect_that_the_simulator_does_not_have_is_named(machine, effect, parameter):
    diagnosis = compare(machine, parameter)
    stored = answer(diagnosis)
    likely = {row["effect"] for row in stored["effects"] if row["probability"] >= 0.5}
    assert likely <= {effect, "actuator_lag"} and effect in stored["set_90"]
    reduction = diagnosis.reduction
    assert reduction.after < 1.1 * reduction.floor < reduction.before
    assert any("already holds coulomb" in decision for decision in stored["decisions"])


@pytest.mark.slow
def test_another_value_of_an_effect_that_both_have_is_parametric(machine):
    level = FRICTION * 0.3 * machine[0].controller.kp[0]
    diagnosis = compare(machine, {"forward": 1.6 * level})
    assert diagnosis.verdict == "parametric"
    held, = answer(diagnosis)["simulator"]
    assert held["effect"] == "coulomb"
    value, simulated = (held["parameters"]["level"][key][0] for key in ("value", "simulated"))
    assert value == pytest.approx(1.6 * level, rel=0.05)
    assert simulated == pytest.approx(level, rel=0.05)


@pytest.mark.slow
def test_logs_of_other_experiments_are_refused(machine):
    robot, logs = machine
    robots, simulated = logs(), logs(noise=0.5)
    with pytest.raises(RecordError, match="5000 samples"):
        diagnose(Problem.from_logs(robot, robots).beside([simulated[0].part(0, 5000)]))
    other = simulated[0].replace(qd=simulated[0].qd + 0.2 * np.sin(simulated[0].time)[:, None])
    with pytest.raises(RecordError, match="another experiment"):
        diagnose(Problem.from_logs(robot, robots).beside([other]))
    slow = simulated[0].replace(time=2 * simulated[0].time)
    with pytest.raises(RecordError, match="0.002 s"):
        diagnose(Problem.from_logs(robot, robots).beside([slow]))
