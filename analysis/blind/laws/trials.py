"""Trials of the study: robots with a law, what their file says of it, and their logs."""

import dataclasses
import io
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.analysis.blind.laws import control_laws as laws
from clie_blocks.analysis.blind.laws.arm import LOOSE, PERIOD, SOFT, Arm, draw_arm
from clie_blocks.analysis.blind.laws.drawn import (
    KINDS,
    WITH_GRAVITY,
    Bench,
    DrawnLaw,
    Statement,
    pd_statement,
    row,
)
from clie_blocks.analysis.blind.laws.run import DELAY, DRAG, SOUND, Effect, Motion, Reference, run
from clie_blocks.output import write

LOGS, SECONDS = 3, 8.0  # of each robot, s
RINGING = 3.0  # times the largest command of a sound robot
RIGHT, WRONG, UNKNOWN = "right", "wrong", "unknown"
# How the trials of one kind are described, and whether the robot is sound: half and a third.
TURNS = ((RIGHT, True), (WRONG, False), (RIGHT, False), (UNKNOWN, False), (RIGHT, False),
         (WRONG, True))
TRIAL, TWIN = "trial", "twin"  # a robot under its law, and the same under PD as stated
_FRICTION, _TWO_PI = "coulomb", 2.0 * math.pi
EFFECTS = (_FRICTION, LOOSE, SOFT, DELAY, DRAG)


@dataclasses.dataclass(frozen=True, eq=False)
class Trial:
    """A robot of the study.

    Parameters
    ----------
    bench : Bench
        The robot.
    kind : str
        Of its law.
    law : DrawnLaw
        Its law.
    described : str
        `RIGHT`, `WRONG` or `UNKNOWN`.
    effect : Effect
        What it has beyond its model.
    step : float
        To which commands are rounded [N m].
    fastest : float
        Highest frequency of its motion [Hz].
    seeds : tuple of int
        Of its experiments.

    """

    bench: Bench
    kind: str
    law: DrawnLaw
    described: str
    effect: Effect
    step: float
    fastest: float
    seeds: tuple[int, ...]

    @property
    def label(self) -> dict[str, Any]:
        """What is sealed."""
        name = self.effect.name
        return {"law": self.kind, "described": self.described, "joints": self.bench.arm.n,
                "kind": "single" if name else "none", "labels": [name or "none"],
                "effects": [{"effect": name, "joint": self.effect.joint + 1,
                             "size": self.effect.size}] if name else [],
                "words": list(self.law.words), "numbers": {
                    key: np.atleast_1d(value).tolist()
                    for key, value in self.law.numbers.items()}}


def turn(index: int) -> tuple[str, str, bool]:
    """Kind of the law of a trial, how it is described, and whether the robot is sound."""
    lap, place = divmod(index, len(KINDS))
    return list(KINDS)[place], *TURNS[(lap + place) % len(TURNS)]


def draw_trial(seed: int, index: int) -> Trial:
    """Draw a trial; a robot whose loop rings, which no one would keep, is drawn anew."""
    rng = np.random.default_rng([seed, index])
    while not _is_steady(trial := _drawn(rng, *turn(index))):
        pass
    return trial


def _drawn(rng: np.random.Generator, kind: str, described: str, sound: bool) -> Trial:
    arm = draw_arm(rng, int(rng.integers(1, 3)), kind in WITH_GRAVITY or rng.random() < 0.3)
    fastest = float(rng.uniform(1.2, 2.0))
    seeds = tuple(int(one) for one in rng.integers(2**31, size=LOGS))
    bench = _bench(rng, arm, fastest, seeds[0])
    step = 10.0 ** math.floor(math.log10(3e-4 * float(bench.peak.min())))
    effect = SOUND if sound else draw_effect(
        rng, EFFECTS, arm, bench.peak, Reference(np.random.default_rng(seeds[0]), arm.n, fastest),
        SECONDS)
    return Trial(bench, kind, KINDS[kind](rng, bench), described, effect, step, fastest, seeds)


def _is_steady(trial: Trial) -> bool:
    """Whether the loop stays near its motion under both laws."""
    count = round(SECONDS / PERIOD)
    for start in (trial.law.start, trial.bench.pd):
        log = _experiment(trial.bench.arm, start(), trial.seeds[0], trial.fastest, trial.step,
                          trial.effect)
        largest = np.abs(_commands(log)).max(axis=0)
        if len(log) < count or np.any(largest > RINGING * trial.bench.peak):
            return False
    return True


def _commands(log: np.ndarray) -> np.ndarray:
    """Commands of a log, shape (N, n): it has time, q, u and qd."""
    n = log.shape[1] // 3
    return log[:, 1 + n:1 + 2 * n]


def _bench(rng: np.random.Generator, arm: Arm, fastest: float, seed: int) -> Bench:
    """PD gains, and the commands that they give in the first motion."""
    speed = _TWO_PI * rng.uniform(2.5, 4.0)
    kp = arm.inertia * speed**2 / arm.gear
    kd = rng.uniform(1.2, 1.7) * arm.inertia * speed / arm.gear
    u = _commands(_experiment(arm, laws.pd(kp, kd), seed, fastest, 1e-9))
    fastest_change = np.abs(np.diff(u, axis=0)).max(axis=0) / PERIOD
    return Bench(arm, kp, kd, np.abs(u).max(axis=0), fastest_change)


def draw_effect(rng: np.random.Generator, names: tuple[str, ...], arm: Arm, peak: np.ndarray,
                motion: Motion, seconds: float) -> Effect:
    """Draw an effect of an arm that its motion shows.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of chance.
    names : tuple of str
        Of `EFFECTS`.
    arm : Arm
        The robot.
    peak : ndarray, shape (n,)
        Its largest commands [N m].
    motion : callable
        Its reference at a time.
    seconds : float
        Length of the motion [s].

    """
    joint = int(rng.integers(arm.n))
    name = str(rng.choice(names))
    torque = arm.gear[joint] * peak[joint]  # joint side
    if name == DELAY:
        return Effect(name, joint, int(rng.integers(2, 6)))
    if name == LOOSE:
        return Effect(name, joint, rng.uniform(0.006, 0.02))
    if name == SOFT:
        link = arm.inertia[joint] - arm.armature[joint]
        return Effect(name, joint, link * (_TWO_PI * rng.uniform(4.0, 9.0))**2)
    if name == _FRICTION:
        return Effect(name, joint, torque * rng.uniform(0.1, 0.3))
    speeds = [abs(motion(t)[1][joint]) for t in np.arange(0.0, seconds, 0.05)]
    return Effect(name, joint, torque * rng.uniform(0.1, 0.3) / max(speeds)**2)


def _experiment(arm: Arm, law: laws.Law, seed: int, fastest: float, step: float,
                effect: Effect = SOUND) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return run(arm, law, Reference(rng, arm.n, fastest), rng, SECONDS, step, effect)


def write_trial(trial: Trial, folder: Path) -> None:
    """Write the files of an owner."""
    statement = {RIGHT: trial.law.right, WRONG: trial.law.wrong,
                 UNKNOWN: {"law": '"unknown"'}}[trial.described]
    _write(trial, folder, trial.law.start, statement)


def write_twin(trial: Trial, folder: Path) -> None:
    """Write the files of the same robot under its PD law, as stated."""
    bench = trial.bench
    _write(trial, folder, bench.pd, pd_statement(bench.kp, bench.kd))


def _write(trial: Trial, folder: Path, start: Callable[[], laws.Law],
           statement: Statement) -> None:
    arm = trial.bench.arm
    write(folder / "robot.toml", robot_text(arm, {
        **statement, "sample_time_s": f"{PERIOD}", "command_resolution_nm": repr(trial.step)}))
    names = ["time", *(f"{name}{k + 1}" for name in ("q", "u", "qd") for k in range(arm.n))]
    for k, seed in enumerate(trial.seeds, 1):
        log = _experiment(arm, start(), seed, trial.fastest, trial.step, trial.effect)
        table = io.StringIO()
        np.savetxt(table, log, delimiter=",", fmt="%.10g", header=",".join(names), comments="")
        write(folder / f"log-{k}.csv", table.getvalue())


def robot_text(arm: Arm, controller: Statement, unknown: tuple[str, ...] = (),
               **more: str) -> str:
    """Robot file of an arm; its datasheet numbers are the true ones.

    Parameters
    ----------
    arm : Arm
        The robot.
    controller : dict
        Keys of the section of that name.
    unknown : tuple of str
        Beginnings of keys of the motor that the file leaves out.
    **more : str
        Further lines, by section.

    """
    sections = {
        "motor": [f"gear_ratio = {row(arm.gear)}",
                  f"inertia_kgm2 = {row(arm.armature / arm.gear**2)}",
                  "inertia_tolerance = 0.05",
                  f"viscous_friction_nms = {row(arm.damping / arm.gear**2)}",
                  "viscous_friction_tolerance = 0.1"],
        "links": [f"mass_kg = {row(arm.mass)}", f"length_m = {row(arm.length)}",
                  f"com_m = {row(arm.com)}", f"inertia_kgm2 = {row(arm.spin)}"],
        "nominal": [f"gravity = {str(arm.has_gravity).lower()}",
                    f"coupling = {str(arm.n > 1).lower()}"],
        "controller": [f"{key} = {value}" for key, value in controller.items()]}
    sections["motor"] = [line for line in sections["motor"] if not line.startswith(unknown)]
    for name, line in more.items():
        sections.setdefault(name, []).append(line)
    return "\n".join([f'name = "arm"\njoints = {arm.n}', *(
        "\n".join([f"[{name}]", *lines]) for name, lines in sections.items()), ""])
