"""A simulator without noise and a robot with it, both of an independent engine."""

import dataclasses
import json

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.blind.engine.control_loop import run  # noqa: E402
from clie_blocks.analysis.blind.engine.experiments import Experiment, draw_experiments  # noqa: E402
from clie_blocks.analysis.blind.engine.robot import draw_robot, draw_truth  # noqa: E402
from clie_blocks.analysis.blind.population.files import robot_text  # noqa: E402
from clie_blocks.analysis.gap import diagnose  # noqa: E402
from clie_blocks.analysis.gap.command import main  # noqa: E402
from clie_blocks.analysis.gap.problem.problem import Problem  # noqa: E402
from clie_blocks.analysis.gap.report.answer import answer  # noqa: E402
from clie_blocks.analysis.records import Record, read_robot, write_record  # noqa: E402

SECONDS = 8.0
AXIS = 11  # a seed that draws a single axis
DRY = 0.015  # of kp: position error that dry friction holds [rad]


class Machine:
    """A robot of MuJoCo whose logs come with the noise of its sensor, or as a simulator's."""

    def __init__(self, kind, gravity, seed, folder):
        rng = np.random.default_rng(seed)
        self.robot = dataclasses.replace(draw_robot(rng, kind, gravity), period=1e-3)
        self.truth = draw_truth(rng, self.robot)
        self.dry = DRY * self.robot.kp
        self.motions = [shortened(motion) for motion in draw_experiments(rng, self.robot)[:2]]
        self.file = folder / f"{kind}.toml"
        self.file.write_text(robot_text(self.robot, self.motions))
        self.stated = read_robot(self.file)

    def logs(self, noisy=True, **parameters):
        """Logs under changed parameters."""
        body, rng = self.robot, np.random.default_rng(1)
        noises = [noisy * body.sigma * rng.standard_normal(m.q_d.shape) for m in self.motions]
        if not noisy:
            fine = np.full(body.n, 1e-12)
            body = dataclasses.replace(body, resolution=fine, command_step=fine * body.kp)
        lane = {**self.truth, **{key: np.full(body.n, value) for key, value in parameters.items()}}
        runs = run(body, [lane] * len(self.motions), self.motions, noises)
        return [Record(time=body.period * np.arange(len(q)), q=q, u=u, qd=motion.q_d,
                       pe=motion.pe, source=f"log-{j + 1}")
                for j, (motion, (q, u)) in enumerate(zip(self.motions, runs))]


def shortened(motion):
    rows = round(SECONDS / 1e-3)
    return Experiment(motion.excitation, motion.start, motion.q_d[:rows], motion.pe[:rows])


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    folder = tmp_path_factory.mktemp("machines")
    return lambda kind, gravity=False, seed=1: Machine(kind, gravity, seed, folder)


@pytest.fixture(scope="module")
def pendulum(machine):
    return machine("pendulum", gravity=True, seed=8)


def compare(machine, of_robot, of_simulator):
    """Diagnosis of a robot with some parameters, against a noise-free simulator with others."""
    problem = Problem.from_logs(machine.stated, machine.logs(**of_robot))
    return diagnose(problem.beside(machine.logs(noisy=False, **of_simulator)))


def most_probable(diagnosis):
    return max(answer(diagnosis)["effects"], key=lambda row: row["probability"])["effect"]


@pytest.mark.slow
@pytest.mark.parametrize("dry", [0.0, 1.0])
def test_noise_alone_is_no_difference(pendulum, dry):
    level = {"level": dry * pendulum.dry}
    diagnosis = compare(pendulum, level, level)
    assert diagnosis.verdict == "none"
    assert diagnosis.evidence.nominal_excess < 0.5
    held = {member.cause.name for member in diagnosis.residuals.problem.inside}
    assert held == ({"coulomb"} if dry else set())


@pytest.mark.slow
def test_only_an_effect_that_the_simulator_does_not_have_is_named(pendulum):
    level = {"level": pendulum.dry}
    diagnosis = compare(pendulum, {**level, "quadratic": 0.02 * pendulum.robot.kp}, level)
    assert most_probable(diagnosis) == "quadratic_drag"
    reduction = diagnosis.reduction
    assert reduction.after < 1.05 * reduction.floor < 0.3 * reduction.before


@pytest.mark.slow
@pytest.mark.parametrize("effect, parameter, value", [
    ("time_delay", "delay", 4e-3), ("payload", "payload", 0.05)])
def test_an_effect_in_addition_to_dry_friction_that_both_have(pendulum, effect, parameter, value):
    level = {"level": pendulum.dry}
    diagnosis = compare(pendulum, {**level, parameter: value}, level)
    assert most_probable(diagnosis) == effect
    assert diagnosis.reduction.after < 1.1 * diagnosis.reduction.floor


@pytest.mark.slow
def test_backlash_in_addition_to_dry_friction_that_both_have(machine):
    axis = machine("axes", seed=AXIS)
    level = {"level": axis.dry}
    assert most_probable(compare(axis, {**level, "half_gap": 1.5e-3}, level)) == "backlash"


@pytest.mark.slow
def test_more_friction_than_in_the_simulator_is_parametric(pendulum):
    diagnosis = compare(pendulum, {"level": 1.6 * pendulum.dry}, {"level": pendulum.dry})
    assert diagnosis.verdict == "parametric"
    held, = answer(diagnosis)["simulator"]
    assert held["effect"] == "coulomb"
    value, simulated = (held["parameters"]["level"][key] for key in ("value", "simulated"))
    np.testing.assert_allclose(value / simulated, 1.6, rtol=0.02)


@pytest.mark.slow
def test_other_parameters_of_the_joint_are_parametric(pendulum):
    truth = pendulum.truth
    other = {"rotor": 1.2 * truth["rotor"], "drag": 0.85 * truth["drag"]}
    diagnosis = compare(pendulum, other, {})
    assert diagnosis.verdict == "parametric"
    inertia = diagnosis.model.hypothesis.values["inertia"]
    simulated = diagnosis.residuals.problem.nominal.inertia
    added = 0.2 * pendulum.robot.ratio * truth["rotor"]
    np.testing.assert_allclose(inertia - simulated, added, rtol=0.1)


@pytest.mark.slow
def test_the_command_reads_both_logs(pendulum, tmp_path, capsys):
    logs = {"robot": pendulum.logs(level=1.6 * pendulum.dry),
            "simulator": pendulum.logs(noisy=False, level=pendulum.dry)}
    paths = {}
    for name, records in logs.items():
        paths[name] = [str(tmp_path / f"{name}-{record.source}.csv") for record in records]
        for path, record in zip(paths[name], records):
            write_record(record, path)
    assert main([*paths["robot"], "--robot", str(pendulum.file), "--json",
                 "--simulated", *paths["simulator"]]) == 0
    captured = capsys.readouterr()
    stored = json.loads(captured.out)
    assert stored["verdict"] == "parametric"
    assert [row["effect"] for row in stored["simulator"]] == ["coulomb"]
    assert any("already holds coulomb" in decision for decision in stored["decisions"])
    assert "parameters are outside their tolerance" in " ".join(captured.err.split())
