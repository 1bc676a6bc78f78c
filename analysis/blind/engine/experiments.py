"""Experiments: where a robot starts, how its set-point moves, and what excitation is injected."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from clie_blocks.analysis.blind.engine.robot import DrawnRobot

DURATIONS = (10, 12) * 11 + (14, 16, 18, 20) * 3 + (25,) * 4 + (40, 60)  # s, of the longest log
WORK_SECONDS = 5.0, 12.0  # of a log of normal work
Wave = tuple[np.ndarray | float, np.ndarray | float]  # offset of the set-point [rad], torque [N m]


@dataclass(frozen=True, eq=False)
class Experiment:
    """One experiment.

    Parameters
    ----------
    excitation : str
        Its name in ``robot.toml``.
    start : ndarray, shape (n,)
        Angle at rest before time 0 [rad].
    q_d, pe : ndarray, shape (N, n)
        Set-point [rad] and injected torque, motor side [N m].

    """

    excitation: str
    start: np.ndarray
    q_d: np.ndarray
    pe: np.ndarray


def draw_experiments(rng: np.random.Generator, robot: DrawnRobot) -> list[Experiment]:
    """Draw three experiments: one slow, one broad, and a third, in random order."""
    slow = str(rng.choice(["triangle", "steps", "pick_and_place"]))
    broad = str(rng.choice(["multisine", "chirp"]))
    rest = [name for name in SHAPES if name not in (slow, broad)]
    names = [slow, broad, str(rng.choice(rest))]
    rng.shuffle(names)
    longest = float(rng.choice(DURATIONS))
    return [_draw_experiment(rng, robot, name, round(longest * rng.uniform(0.8, 1.0))
                             if longest > 12 else longest) for name in names]


def draw_work_cycles(rng: np.random.Generator, robot: DrawnRobot) -> list[Experiment]:
    """Draw three experiments of normal work: moves between poses, and nothing injected."""
    return [_draw_experiment(rng, robot, "pick_and_place", round(rng.uniform(*WORK_SECONDS)))
            for _ in range(3)]


def _draw_experiment(rng: np.random.Generator, robot: DrawnRobot, name: str,
                     duration: float) -> Experiment:
    t = robot.period * np.arange(round(duration / robot.period))
    offset, torque = SHAPES[name](rng, robot, t)
    q_d = np.round(robot.pose + offset, 4)
    pe = np.round(torque / robot.command_step) * robot.command_step
    start = robot.pose.copy()
    if name == "paper_pe":
        start = np.round(start + rng.uniform(-0.3, 0.3, robot.n), 4)
    excitation = name if name != "pick_and_place" else "other"
    return Experiment(excitation, start, np.broadcast_to(q_d, (len(t), robot.n)),
                      np.broadcast_to(pe, (len(t), robot.n)))


def _triangle(rng: np.random.Generator, robot: DrawnRobot, t: np.ndarray) -> Wave:
    turns = t[:, None] / rng.uniform(5.0, 11.0, robot.n)
    return _amplitude(rng, robot) * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * turns)), 0.0


def _steps(rng: np.random.Generator, robot: DrawnRobot, t: np.ndarray) -> Wave:
    hold = rng.uniform(2.0, 4.0, robot.n)
    levels = rng.uniform(-1, 1, (64, robot.n)) * _amplitude(rng, robot)
    levels[0] = 0.0
    return np.take_along_axis(levels, (t[:, None] / hold).astype(int), axis=0), 0.0


def _pick_and_place(rng: np.random.Generator, robot: DrawnRobot, t: np.ndarray) -> Wave:
    """Smooth moves between poses, with rests."""
    move, rest = rng.uniform(0.8, 1.6), rng.uniform(0.3, 1.0)
    poses = rng.uniform(-1, 1, (64, robot.n)) * _amplitude(rng, robot)
    poses[0] = 0.0
    lap, inside = np.divmod(t, move + rest)
    s = np.clip(inside / move, 0.0, 1.0)[:, None]
    smooth = s**3 * (10 - 15 * s + 6 * s**2)
    lap = lap.astype(int)
    return poses[lap] + smooth * (poses[lap + 1] - poses[lap]), 0.0


def _multisine(rng: np.random.Generator, robot: DrawnRobot, t: np.ndarray) -> Wave:
    tones = np.geomspace(0.06, 3.0, 9)[:, None] * rng.uniform(0.9, 1.1, (9, robot.n))
    phase = rng.uniform(0, 2 * np.pi, (9, robot.n))
    fade = np.minimum(t / 0.5, 1.0)[:, None]
    waves = np.sin(2 * np.pi * t[:, None, None] * tones + phase).sum(axis=1)
    return 0.0, 0.11 * robot.kp * fade * waves


def _chirp(rng: np.random.Generator, robot: DrawnRobot, t: np.ndarray) -> Wave:
    rise = np.log(rng.uniform(3.5, 6.0, robot.n) / 0.1)
    down = np.arange(robot.n) % 2 == 1
    clock = np.where(down, (t[-1] - t)[:, None], t[:, None]) / t[-1]
    turns = 0.1 * t[-1] / rise * (np.exp(clock * rise) - 1)
    fade = np.minimum(t / 0.5, 1.0)[:, None]
    return 0.0, rng.uniform(0.25, 0.4, robot.n) * robot.kp * fade * np.sin(2 * np.pi * turns)


def _paper(rng: np.random.Generator, robot: DrawnRobot, t: np.ndarray) -> Wave:
    """The excitation of eq. (48)."""
    wave = 0.7 * np.sin(2 * np.pi * t) + 0.5 * np.sin(np.pi * t) - 0.25 * np.cos(np.pi * t)
    return 0.0, rng.uniform(0.15, 0.3, robot.n) * robot.kp * wave[:, None]


def _amplitude(rng: np.random.Generator, robot: DrawnRobot) -> np.ndarray:
    return rng.uniform(0.2, 0.45, robot.n)


SHAPES: dict[str, Callable[[np.random.Generator, DrawnRobot, np.ndarray], Wave]] = {
    "triangle": _triangle, "steps": _steps, "pick_and_place": _pick_and_place,
    "multisine": _multisine, "chirp": _chirp, "paper_pe": _paper}
