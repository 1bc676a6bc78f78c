"""A simulator without noise beside a robot with it, both of an independent engine."""

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
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.report.answer import answer  # noqa: E402
from clie_blocks.analysis.records import Record, read_robot, write_record  # noqa: E402

SECONDS = 8.0
AXIS = 11  # a seed that draws a single axis
DRY = 0.015  # of kp: what dry friction holds, in rad of position error


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

    def logs(self, noisy=True, **numbers):
        """Logs under changed numbers."""
        body, rng = self.robot, np.random.default_rng(1)
        noises = [noisy * body.sigma * rng.standard_normal(m.q_d.shape) for m in self.motions]
        if not noisy:
            fine = np.full(body.n, 1e-12)
            body = dataclasses.replace(body, resolution=fine, command_step=fine * body.kp)
        lane = {**self.truth, **{key: np.full(body.n, value) for key, value in numbers.items()}}
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


def most_probable(found):
    return max(answer(found)["effects"], key=lambda row: row["probability"])["effect"]


@pytest.mark.parametrize("dry", [0.0, 1.0])
def test_noise_alone_is_no_difference(pendulum, dry):
    level = dry * pendulum.dry
    found = diagnose(
        Problem.from_logs(pendulum.stated, pendulum.logs(level=level)).beside(
            pendulum.logs(noisy=False, level=level)
        )
    )
    assert found.verdict == "none"
    assert found.evidence.nominal_excess < 0.5
    assert {m.cause.name for m in found.residuals.problem.inside} == (
        {"coulomb"} if dry else set()
    )


def test_only_what_the_simulator_lacks_is_named(pendulum):
    drag = {"quadratic": 0.02 * pendulum.robot.kp}
    found = diagnose(
        Problem.from_logs(pendulum.stated, pendulum.logs(level=pendulum.dry, **drag)).beside(
            pendulum.logs(noisy=False, level=pendulum.dry)
        )
    )
    assert most_probable(found) == "quadratic_drag"
    assert found.reduction.after < 1.05 * found.reduction.floor < 0.3 * found.reduction.before


@pytest.mark.slow
@pytest.mark.parametrize(
    "effect, number, value", [("time_delay", "delay", 4e-3), ("payload", "payload", 0.05)]
)
def test_an_effect_beside_dry_friction_that_both_have(pendulum, effect, number, value):
    found = diagnose(
        Problem.from_logs(
            pendulum.stated, pendulum.logs(level=pendulum.dry, **{number: value})
        ).beside(pendulum.logs(noisy=False, level=pendulum.dry))
    )
    assert most_probable(found) == effect
    assert found.reduction.after < 1.1 * found.reduction.floor


@pytest.mark.slow
def test_backlash_beside_dry_friction_that_both_have(machine):
    axis = machine("axes", seed=AXIS)
    found = diagnose(
        Problem.from_logs(axis.stated, axis.logs(level=axis.dry, half_gap=1.5e-3)).beside(
            axis.logs(noisy=False, level=axis.dry)
        )
    )
    assert most_probable(found) == "backlash"


@pytest.mark.slow
def test_more_friction_than_in_the_simulator_is_parametric(pendulum):
    found = diagnose(
        Problem.from_logs(pendulum.stated, pendulum.logs(level=1.6 * pendulum.dry)).beside(
            pendulum.logs(noisy=False, level=pendulum.dry)
        )
    )
    assert found.verdict == "parametric"
    held, = answer(found)["simulator"]
    assert held["effect"] == "coulomb"
    now, was = (held["parameters"]["level"][key] for key in ("value", "simulated"))
    np.testing.assert_allclose(now / was, 1.6, rtol=0.02)


@pytest.mark.slow
def test_other_numbers_of_the_joint_are_parametric(pendulum):
    truth = pendulum.truth
    found = diagnose(Problem.from_logs(pendulum.stated, pendulum.logs(rotor=1.2 * truth["rotor"], drag=0.85 * truth["drag"])).beside(pendulum.logs(noisy=False)))
    assert found.verdict == "parametric"
    now = found.model.hypothesis.values["inertia"]
    was = found.residuals.problem.nominal.inertia
    grown = 0.2 * pendulum.robot.ratio * truth["rotor"]
    np.testing.assert_allclose(now - was, grown, rtol=0.1)


def test_the_command_reads_both_logs(pendulum, tmp_path, capsys):
    names = {"robot": pendulum.logs(level=1.6 * pendulum.dry),
             "simulator": pendulum.logs(noisy=False, level=pendulum.dry)}
    paths = {}
    for name, records in names.items():
        paths[name] = [str(tmp_path / f"{name}-{record.source}.csv") for record in records]
        for path, record in zip(paths[name], records):
            write_record(record, path)
    assert main([*paths["robot"], "--robot", str(pendulum.file), "--json",
                 "--simulated", *paths["simulator"]]) == 0
    captured = capsys.readouterr()
    said = json.loads(captured.out)
    assert said["verdict"] == "parametric"
    assert [row["effect"] for row in said["simulator"]] == ["coulomb"]
    assert any("already holds coulomb" in text for text in said["decisions"])
    assert "parameters are outside their tolerance" in captured.err
