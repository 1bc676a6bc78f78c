"""Trials of the study: robots, what their file says of them, and their logs."""

import dataclasses
import io
import math
from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.analysis.blind.laws.arm import LOOSE, PERIOD, Arm, draw_arm
from clie_blocks.analysis.blind.laws.drawn import Statement, row
from clie_blocks.analysis.blind.laws.run import DELAY, SOUND, Effect, Motion, Reference
from clie_blocks.analysis.blind.laws.trials import EFFECTS, RINGING, draw_effect, robot_text
from clie_blocks.analysis.blind.poor_logs.kinds import (
    CONTENTS,
    CURRENT,
    MOTOR,
    SERVO,
    Condition,
    Content,
    conditions_of,
    turn,
)
from clie_blocks.analysis.blind.poor_logs.logger import (
    Controller,
    Encoder,
    Signals,
    log,
    run,
)
from clie_blocks.analysis.blind.poor_logs.motion import PickAndPlace
from clie_blocks.analysis.blind.population.standard import TRACE
from clie_blocks.output import write

NOISE = (0.8e-4, 2.2e-4)  # rad, of the encoders of the standard study
CONSTANT_TOLERANCE = 0.1  # of a stated torque constant; the true one is within half of it
_FINE = 1e-9  # rad, steps of an encoder that shows everything
_TWO_PI = 2.0 * math.pi


@dataclasses.dataclass(frozen=True, eq=False)
class Robot:
    """A robot without its effect, and how its logs are taken.

    Parameters
    ----------
    arm : Arm
        Its body.
    controller : Controller
        Its law.
    encoder : Encoder
        Its sensors.
    content, condition : Content, Condition
        Of its logs.
    fastest : float
        Highest frequency of its motion [Hz].
    seeds : tuple of int
        Of its experiments.

    """

    arm: Arm
    controller: Controller
    encoder: Encoder
    content: Content
    condition: Condition
    fastest: float
    seeds: tuple[int, ...]

    def motion(self, seed: int) -> Motion:
        """Reference of an experiment."""
        rng = np.random.default_rng(seed)
        if self.condition.stands_still:
            return PickAndPlace(rng, self.arm.n, self.condition.seconds)
        return Reference(rng, self.arm.n, self.fastest)

    def experiment(self, seed: int, effect: Effect = SOUND) -> Signals:
        """Signals of an experiment."""
        return run(self.arm, self.controller, self.encoder, self.motion(seed),
                   np.random.default_rng([seed, 1]), self.condition, self.content.acts_on, effect)


@dataclasses.dataclass(frozen=True, eq=False)
class Trial:
    """A robot of the study.

    Parameters
    ----------
    robot : Robot
        Without its effect.
    content, condition : str
        Kind of its logs.
    peak : ndarray, shape (n,)
        Largest commands without the effect [N m].
    effect : Effect
        What it has beyond its model.
    constant : ndarray, shape (n,)
        True torque per current, over the stated one.

    """

    robot: Robot
    content: str
    condition: str
    peak: np.ndarray
    effect: Effect
    constant: np.ndarray

    @property
    def label(self) -> dict[str, Any]:
        """What is sealed."""
        name = self.effect.name
        return {"content": self.content, "condition": self.condition,
                "joints": self.robot.arm.n, "kind": "single" if name else "none",
                "labels": [name or "none"],
                "effects": [{"effect": name, "joints": [self.effect.joint + 1],
                             "size": self.effect.size}] if name else []}


def draw_trial(seed: int, index: int) -> Trial:
    """Draw a trial; a loop that rings, which no one would keep, is drawn anew.

    So is an effect that its logs do not hold: it is below their noise, or the gear is loose and
    a weight holds it at one flank.
    """
    rng = np.random.default_rng([seed, index])
    while not (_is_steady(trial := _drawn(rng, *turn(index))) and shows_effect(trial)):
        pass
    return trial


def _drawn(rng: np.random.Generator, content: str, condition: str, sound: bool) -> Trial:
    robot, peak = _draw_robot(rng, content, conditions_of(condition, content))
    effect = SOUND if sound else _draw_effect(rng, robot, peak)
    constant = 1.0 + 0.5 * CONSTANT_TOLERANCE * rng.uniform(-1.0, 1.0, robot.arm.n)
    return Trial(robot, content, condition, peak, effect, constant)


def _draw_robot(rng: np.random.Generator, content: str, condition: Condition
                ) -> tuple[Robot, np.ndarray]:
    """A robot, and the largest commands of its first motion."""
    arm = draw_arm(rng, int(rng.integers(1, 3)), bool(rng.random() < 0.5))
    speed = _TWO_PI * rng.uniform(2.5, 4.0)
    damping = rng.uniform(1.2, 1.7) * arm.inertia * speed
    if content == SERVO:  # damped by its back-EMF
        arm = dataclasses.replace(arm, damping=damping)
    kd = np.zeros(arm.n) if content == SERVO else damping / arm.gear
    controller = Controller(arm.inertia * speed**2 / arm.gear, kd, rng.uniform(400.0, 600.0),
                            rng.uniform(150.0, 250.0), 1e-9)
    encoder = Encoder(rng.uniform(*NOISE) * rng.uniform(*condition.noise),
                      _TWO_PI / condition.encoder_steps)
    seeds = tuple(int(one) for one in rng.integers(2**31, size=condition.logs))
    robot = Robot(arm, controller, encoder, CONTENTS[content], condition,
                  float(rng.uniform(1.2, 2.0)), seeds)
    peak = np.abs(robot.experiment(seeds[0])["command"]).max(axis=0)
    rounded = dataclasses.replace(
        controller, step=10.0 ** math.floor(math.log10(3e-4 * float(peak.min()))))
    return dataclasses.replace(robot, controller=rounded), peak


def _draw_effect(rng: np.random.Generator, robot: Robot, peak: np.ndarray) -> Effect:
    names = tuple(one for one in EFFECTS if one != DELAY or robot.content.shows_drive)
    effect = draw_effect(rng, names, robot.arm, peak, robot.motion(robot.seeds[0]),
                         robot.condition.seconds)
    if effect.name != DELAY:
        return effect
    return dataclasses.replace(effect, size=effect.size * PERIOD / robot.condition.period)


def _is_steady(trial: Trial) -> bool:
    """Whether the loop stays near its motion."""
    signals = trial.robot.experiment(trial.robot.seeds[0], trial.effect)
    condition = trial.robot.condition
    return (len(signals["time"]) == round(condition.seconds / condition.period)
            and bool(np.all(np.abs(signals["command"]) <= RINGING * trial.peak)))


def shows_effect(trial: Trial) -> bool:
    """Whether each log would show the effect, if nothing but the noise were in its way."""
    effect, encoder = trial.effect, trial.robot.encoder
    if not effect.name:
        return True
    clean = dataclasses.replace(trial.robot, encoder=Encoder(0.0, _FINE))
    least = math.sqrt((TRACE**2 - 1.0) * (encoder.sigma**2 + encoder.step**2 / 12.0))
    for seed in trial.robot.seeds:
        signals, sound = clean.experiment(seed, effect), clean.experiment(seed)
        if np.std(signals["q"] - sound["q"], axis=0).max() < least:
            return False
        twist = (signals["q_motor"] - signals["q"])[:, effect.joint]
        if effect.name == LOOSE and np.ptp(twist) < effect.size:
            return False
    return True


def write_trial(trial: Trial, folder: Path) -> None:
    """Write the files of an owner."""
    write(folder / "robot.toml", _robot_text(trial))
    robot, n = trial.robot, trial.robot.arm.n
    for k, seed in enumerate(robot.seeds, 1):
        kept = log(robot.experiment(seed, trial.effect), robot.content, robot.condition,
                   trial.peak, np.random.default_rng([seed, 2]))
        if trial.content == CURRENT:
            kept["tau"] = kept["tau"] / trial.constant  # of a stated constant of 1 N m/A
        units = {"tau": "[A]"} if trial.content == CURRENT else {}
        names = ["time", *(f"{name}{j + 1}{units.get(name, '')}" for name in kept
                           if name != "time" for j in range(n))]
        table = io.StringIO()
        np.savetxt(table, np.column_stack([*kept.values()]), delimiter=",", fmt="%.10g",
                   header=",".join(names), comments="")
        write(folder / f"log-{k}.csv", table.getvalue())


def _robot_text(trial: Trial) -> str:
    """Robot file: of a servo, what its maker does not publish is missing."""
    robot = trial.robot
    more = {"encoder": f"resolution_rad = {robot.encoder.step!r}"}
    if robot.content.acts_on == MOTOR:
        more["encoder"] += '\nmounting = "motor side"'
    if trial.content == CURRENT:
        more["motor"] = (f"torque_constant_nm_a = {row(np.ones(robot.arm.n))}\n"
                         f"torque_constant_tolerance = {CONSTANT_TOLERANCE}")
    unknown = ("inertia", "viscous") if trial.content == SERVO else ()
    return robot_text(robot.arm, _controller_statement(robot), unknown, **more)


def _controller_statement(robot: Robot) -> Statement:
    if not robot.content.states_law:
        return {"law": '"unknown"'}
    law = robot.controller
    source = {"u_is": '"measured"'} if robot.content.measured == "u" else {}
    rounds = not robot.condition.is_coarse and not source
    return {"law": '"pd"', "Kp": row(law.kp), "Kd": row(law.kd),
            "velocity_filter": '"two_corner"',
            "velocity_filter_highpass_rad_s": repr(law.highpass),
            "velocity_filter_lowpass_rad_s": repr(law.lowpass),
            "velocity_filter_discretisation": '"tustin"',
            "sample_time_s": repr(robot.condition.period), **source,
            **({"command_resolution_nm": repr(law.step)} if rounds else {})}
