"""Short runs of the independent engine, studies that cost nothing, and plain answers."""

import dataclasses

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.blind.engine.experiments import Experiment  # noqa: E402
from clie_blocks.analysis.blind.engine.robot import (  # noqa: E402
    DrawnRobot,
    draw_robot,
    draw_truth,
)
from clie_blocks.analysis.blind.protocol import study  # noqa: E402
from clie_blocks.analysis.blind.protocol.targets import compare_with_targets  # noqa: E402


@dataclasses.dataclass
class QuietRobot:
    """A robot without noise, and what it takes to run it."""

    robot: DrawnRobot
    truth: dict[str, np.ndarray]

    def experiment(self, seconds=1.0, torque=0.0, angle=0.0):
        """Torque and set-point held over a run that starts at the pose."""
        rows = np.ones((round(seconds / self.robot.period), self.robot.n))
        return Experiment("other", self.robot.pose.copy(), self.robot.pose + angle * rows,
                      torque * rows)

    def run(self, experiment, **parameters):
        """Angle and command under changed parameters."""
        from clie_blocks.analysis.blind.engine.control_loop import run

        lane = {**self.truth, **{key: np.full(self.robot.n, value)
                                 for key, value in parameters.items()}}
        (log,) = run(self.robot, [lane], [experiment], [np.zeros(experiment.q_d.shape)])
        return log


@pytest.fixture
def quiet_robot():
    def make(kind="pendulum", gravity=False, seed=3):
        rng = np.random.default_rng(seed)
        robot = draw_robot(rng, kind, gravity)
        truth = draw_truth(rng, robot)
        truth["offset"] = np.zeros(robot.n)
        fine = np.full(robot.n, 1e-12)
        robot = dataclasses.replace(robot, period=1e-3, resolution=fine, sigma=0 * fine,
                                    command_step=1e-12 * robot.kp)
        return QuietRobot(robot, truth)
    return make


class PlainStudy:
    """One trial of every kind, and answers to it."""

    names = {"single": ["coulomb"], "none": ["none"], "unknown": ["random_torque"],
             "parametric": ["none"], "pair": ["spring", "backlash"],
             "triple": ["spring", "backlash", "coulomb"]}

    def label(self, kind):
        """Label of a trial of a kind."""
        names = self.names[kind]
        effects = [{"effect": name, "joints": [1]} for name in names
                   if kind in ("single", "pair", "triple")]
        return {"kind": kind, "labels": names, "effects": effects, "severity": "mild",
                "ratio": 1.5, "robot": "arm of 2", "gear_ratios": [60.0, 80.0],
                "excitations": ["chirp", "steps", "other"],
                "gap": {"nominal": 4e-4, "true_model": 1e-4, "achievable_reduction": 0.75}}

    def answer(self, *names, joint=1, before=4e-4, after=1e-4):
        """Answer that is sure of one name, or nearly sure of several."""
        probability = 0.99 if len(names) == 1 else 0.9
        return {"effects": [{"effect": name, "joint": [joint], "probability": probability}
                            for name in names],
                "set_90": list(names), "unexplained": names == ("unknown",), "verdict": "effect",
                "gap_before": before, "gap_after": after, "seconds": 2.0}

    @property
    def labels(self):
        """Labels by kind."""
        return {kind: self.label(kind) for kind in self.names}

    @property
    def right_answers(self):
        """Right answers by kind."""
        return {"single": self.answer("coulomb"), "none": self.answer("none"),
                "unknown": self.answer("unknown"), "parametric": self.answer("parametric"),
                "pair": self.answer("spring", "backlash"),
                "triple": self.answer("spring", "backlash", "coulomb")}

    def board(self, scores):
        """Scoreboard as `clie blind` completes it."""
        return {"seeds": [1], **scores, "targets": compare_with_targets(scores)}


@pytest.fixture
def plain_study():
    return PlainStudy()


@pytest.fixture
def free_study(monkeypatch):
    """Trials and diagnoses that cost nothing: healthy robots, named so; their label and answer."""
    label = {"kind": "none", "labels": ["none"], "effects": [], "severity": None, "ratio": 1.0,
             "robot": "arm of 2", "excitations": ["chirp", "steps", "other"],
             "gap": {"nominal": 1e-4, "true_model": 1e-4, "achievable_reduction": 0.0}}
    answer = {"effects": [{"effect": "none", "joint": None, "probability": 0.98}],
              "set_90": ["none"], "unexplained": False, "verdict": "none", "gap_before": 1e-4,
              "gap_after": 1e-4, "seconds": 1.0}

    def make_one(folder, index):
        trial = folder / study.TRIALS / f"trial-{index:03d}"
        trial.mkdir(parents=True, exist_ok=True)
        (trial / "robot.toml").write_text("joints = 1\n")
        (folder / study.OPEN).mkdir(exist_ok=True)
        return trial.name, label

    def make(folder, trials, seed, jobs, population):
        return [make_one(folder, index) for index in range(trials)]

    def diagnose(tasks, **options):
        return [(task.name, answer) for task in tasks]

    monkeypatch.setattr(study, "_make_in_parallel", make)
    monkeypatch.setattr("clie_blocks.analysis.gap.batch.diagnose_all", diagnose)
    return label, answer
