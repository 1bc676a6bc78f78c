"""Sealed trials of imperfect logs: standard robots, a third of them left as they are.

Each robot is made twice: the undamaged twins are a study of their own in a folder below, with a
seal of their own; the damaged copies are the study, and its labels are the damages.
"""

import functools
import shutil
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.analysis.blind.imperfect.damages import DAMAGES, HARMLESS
from clie_blocks.analysis.blind.imperfect.export import DoesNotApplyError, Export
from clie_blocks.analysis.blind.population.files import write_trial
from clie_blocks.analysis.blind.population.maker import Population, Trial, make_trial
from clie_blocks.analysis.blind.population.standard import draw_trial, plan
from clie_blocks.analysis.blind.protocol import study
from clie_blocks.output import progress

UNDAMAGED = "undamaged"  # folder of the twins
SOUND = "none"  # the damage of a trial that has none
ONE_SOUND_OF, ONE_HEALTHY_OF = 3, 4  # consecutive trials


def _draw(rng: np.random.Generator, seed: int, index: int, noise_factor: float = 1.0) -> Trial:
    """Draw a standard trial; every fourth robot has no effect, for false alarms to show."""
    healthy = index % ONE_HEALTHY_OF == ONE_HEALTHY_OF - 1
    kind, names, severity = ("none", (), None) if healthy else plan(
        seed, index - index // ONE_HEALTHY_OF)
    return draw_trial(rng, index, kind, names, severity, noise_factor=noise_factor)


ROBOTS = Population(_draw, (2,))


def make_trials(folder: Path, trials: int, seed: int, jobs: int = 1) -> None:
    """Make twins and damaged copies, and seal the labels of both; an existing study is kept."""
    study.make_trials(folder / UNDAMAGED, trials, seed, jobs, ROBOTS)
    if study.already_made(folder, trials, seed):
        return
    twins = sorted((folder / UNDAMAGED / study.TRIALS).iterdir())
    study.commit(folder, trials, seed, damage_all(
        twins, folder / study.TRIALS, seed, functools.partial(_logged_with_noise, seed)))


def _logged_with_noise(seed: int, index: int, factor: float) -> Export:
    """Log the robot of a trial again, with more noise in its encoders."""
    population = Population(functools.partial(_draw, noise_factor=factor), ROBOTS.stream)
    with tempfile.TemporaryDirectory() as folder:
        write_trial(make_trial(population, seed, index), Path(folder))
        return Export.read(Path(folder))


def damage_all(twins: Sequence[Path], folder: Path, seed: int,
               with_noise: Callable[[int, float], Export] | None = None,
               ) -> dict[str, dict[str, Any]]:
    """Copy robots with damages; return the damage of each and what it chose, by trial.

    The damages come in turn, in laps of a random order that hold the harmless ones twice; one that
    a robot cannot have waits for the next robot.  What needs more than files, ``with_noise(index,
    factor)`` makes.
    """
    rng = np.random.default_rng([seed, len(DAMAGES)])
    waiting: list[str] = []
    labels = {}
    with progress("damaging logs", len(twins)) as advance:
        for index, twin in enumerate(twins):
            if index % ONE_SOUND_OF == 0:
                sound = index + int(rng.integers(ONE_SOUND_OF))
            if index == sound:
                shutil.copytree(twin, folder / twin.name, dirs_exist_ok=True)
                labels[twin.name] = {"damage": SOUND}
            else:
                export = Export.read(twin)
                if with_noise is not None:
                    export.with_noise = functools.partial(with_noise, index)
                labels[twin.name] = _damage_one(export, folder / twin.name, waiting, rng)
            advance(1)
    return labels


def _damage_one(export: Export, folder: Path, waiting: list[str],
                rng: np.random.Generator) -> dict[str, Any]:
    """Copy a robot with the first waiting damage that it can have, and strike that out."""
    while True:
        for name in waiting:
            try:
                chosen = DAMAGES[name].change(export, rng)
            except DoesNotApplyError:
                continue
            export.write(folder)
            waiting.remove(name)
            return {"damage": name, **chosen}
        waiting += _lap(rng)


def _lap(rng: np.random.Generator) -> list[str]:
    twice = [name for name, one in DAMAGES.items() if one.kind == HARMLESS]
    return list(map(str, rng.permutation([*DAMAGES, *twice])))
