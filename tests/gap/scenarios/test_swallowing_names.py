"""Names that swallow others need evidence of their own mark, on either side of a gear."""

import numpy as np
import pytest
from one_joint import RATIO, Physics, logs, robot

from clie_blocks.analysis.blind.engine.control_loop import run
from clie_blocks.analysis.blind.engine.experiments import draw_experiments
from clie_blocks.analysis.blind.engine.robot import draw_robot, draw_truth
from clie_blocks.analysis.blind.population.files import write_trial
from clie_blocks.analysis.blind.population.maker import Trial
from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.verdict.posterior import marginals
from clie_blocks.analysis.records import Record, Robot, read_trial
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.robot_sections import Encoder, Motor

pytestmark = pytest.mark.slow

NO_LIMIT = 3600.0  # s: a busy machine does not change an answer

WEIGHT = 6.0  # N m, which the joint's own simulator holds as well
BESIDE = Physics(weight=WEIGHT)
DRY_FRICTION = ("coulomb", "asymmetric_coulomb", "stribeck", "load_dependent_friction",
                "presliding", "friction_drift")


def diagnosis_of(physics, ratio, simulated=None):
    """Diagnosis of the joint with torques behind a gear ratio, alone or against a simulator."""
    side = ratio or 1.0
    problem = Problem.from_logs(robot(ratio), logs(physics, side))
    if simulated is not None:
        problem = problem.beside(logs(simulated, side, simulated=True))
    return diagnose(problem, seconds=NO_LIMIT)


def likely(diagnosis):
    """Names that the verdict rests on, with their probabilities."""
    return {name: share for name, share in marginals(diagnosis.ranking).items() if share > 0.05}


@pytest.mark.parametrize("physics, simulated, right", [
    (BESIDE, BESIDE, "none"),
    (Physics(weight=WEIGHT, dry=2.0), BESIDE, "coulomb"),
    (Physics(dry=2.0), None, "coulomb"),
    (Physics(weight=3.0), None, "gravity"),
    (Physics(ripple=0.2), None, "torque_ripple"),
    (Physics(step=1.0), None, "step_fault")],
    ids=["sound", "friction", "friction alone", "weight", "ripple", "fault"])
def test_the_answer_does_not_depend_on_the_side_of_the_gear(physics, simulated, right):
    at_motor, at_joint = (diagnosis_of(physics, ratio, simulated) for ratio in (RATIO, None))
    assert at_joint.verdict == at_motor.verdict != "unexplained"
    assert next(iter(likely(at_joint))) == right
    assert likely(at_joint) == pytest.approx(likely(at_motor), abs=0.05)


@pytest.fixture(scope="module")
def turntable(tmp_path_factory):
    """Function that logs an arm on a turntable, with friction at joint 3 or as its simulator."""
    pytest.importorskip("mujoco")
    rng = np.random.default_rng(3)
    arm = draw_robot(rng, "spatial")
    truth, experiments = draw_truth(rng, arm), draw_experiments(rng, arm)

    def logs(level, noise):
        noises = [noise * arm.sigma * rng.standard_normal(one.q_d.shape) for one in experiments]
        rubbing = {**truth, "level": np.array([0.0, 0.0, level * arm.kp[2]])}
        runs = run(arm, [rubbing] * len(experiments), experiments, noises)
        folder = tmp_path_factory.mktemp("turntable")
        write_trial(Trial(arm, experiments, runs, {}), folder)
        return read_trial(folder)
    return logs


def test_friction_of_a_spatial_arm_against_its_simulator_is_friction_or_a_doubt(turntable):
    (stated, measured), (_, simulated) = turntable(0.02, 1.0), turntable(0.0, 0.0)
    diagnosis = diagnose(Problem.from_logs(stated, measured).beside(simulated), seconds=NO_LIMIT)
    others = {name: share for name, share in marginals(diagnosis.ranking).items()
              if name not in (*DRY_FRICTION, "unknown")}
    assert max(others.values()) < 0.25
    assert diagnosis.verdict in ("unexplained", "not_identifiable") or (
        next(iter(marginals(diagnosis.ranking))) in DRY_FRICTION)


def backlash_at_50_hz(half_gap):
    """Logs of a hobby servo whose link moves freely by twice a half gap, at 50 Hz."""
    period, step, records = 0.02, 5e-5, []
    time = period * np.arange(1500)
    for j in range(3):
        rng = np.random.default_rng(j)
        q_d = 0.6 * np.sin(1.26 * (1 + j / 3) * time) + 0.25 * np.sin(3.46 * time + j)
        motor = link = motor_rate = link_rate = previous = 0.0
        rows = []
        for set_point in q_d.tolist():
            measured = round((link + 3e-4 * rng.standard_normal()) / 1.5e-3) * 1.5e-3
            u = 6.0 * (set_point - measured) - 0.3 * (measured - previous) / period
            rows.append((measured, u))
            previous = measured
            for _ in range(round(period / step)):
                twist = motor - link
                pressed = twist - max(-half_gap, min(half_gap, twist))
                passed = 400.0 * pressed + (0.6 * (motor_rate - link_rate) if pressed else 0.0)
                motor_rate += step * (u - 0.12 * motor_rate - passed) / 0.008
                link_rate += step * (passed - 0.02 * link_rate) / 0.02
                motor, link = motor + step * motor_rate, link + step * link_rate
        q, u = np.array(rows).T[:, :, None]
        records.append(Record(time=time, q=q, u=u, qd=q_d[:, None], pe=0.0 * u,
                              source=f"log-{j + 1}"))
    return records


HOBBY_SERVO = Robot(
    n=1, name="hobby servo",
    motor=Motor(gear_ratio=[1.0], inertia=[0.028], viscous_friction=[0.14],
                inertia_tolerance=0.05, viscous_friction_tolerance=0.3),
    controller=Controller(kp=[6.0], kd=[0.3], velocity_filter="difference", sample_time=0.02),
    encoder=Encoder(resolution=[1.5e-3]))


def test_backlash_of_a_hobby_servo_at_50_hz_is_backlash_or_a_doubt():
    diagnosis = diagnose(Problem.from_logs(HOBBY_SERVO, backlash_at_50_hz(0.01)),
                         seconds=NO_LIMIT)
    others = {name: share for name, share in marginals(diagnosis.ranking).items()
              if name not in ("backlash", "unknown")}
    assert max(others.values()) < 0.5
    sound = diagnose(Problem.from_logs(HOBBY_SERVO, backlash_at_50_hz(0.0)), seconds=NO_LIMIT)
    assert sound.verdict == "none"
