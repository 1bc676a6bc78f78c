"""Studies beside the main one, each an option of ``clie blind`` that takes a number of robots."""

import dataclasses
import importlib
from pathlib import Path
from typing import Any, Protocol, cast

Board = dict[str, Any]


class StudyModule(Protocol):
    """What the module ``study`` of a folder of `analysis.blind` holds."""

    def run_study(self, folder: Path, count: int, seed: int, jobs: int = 1, /) -> Board:
        """Make a study or continue it, and return its figures."""

    def terminal_lines(self, board: Board, /) -> list[str]:
        """Return the figures for a terminal."""

    def is_missed(self, board: Board, /) -> bool:
        """Whether what is sought first is not reached."""


@dataclasses.dataclass(frozen=True)
class FurtherStudy:
    """A study with figures of its own, in the folder that has its name.

    Parameters
    ----------
    option : str
        Of the command line, without dashes.
    help : str
        What it makes and asks.

    """

    option: str
    help: str

    @property
    def name(self) -> str:
        """Of the folder, of the option in Python, and of the file with the figures."""
        return self.option.replace("-", "_")

    @property
    def module(self) -> StudyModule:
        """Its module, loaded when it is asked for: a diagnosis and its engine are slow to load."""
        return cast(StudyModule, importlib.import_module(
            f"clie_blocks.analysis.blind.{self.name}.study"))


FURTHER_STUDIES = (
    FurtherStudy(
        "simulator-faults",
        "instead, N simulators with each of sixteen faults and N sound ones: one joint in MuJoCo, "
        "whose run is not what its model file says; goes with --seed"),
    FurtherStudy(
        "exported",
        "instead, N robots of one joint, whose right diagnoses are exported to MuJoCo and "
        "replayed there on the log that no fit has seen: the gap beside that of the true model, "
        "and how often the band of --samples holds the motion; goes with --seed and --jobs"),
    FurtherStudy(
        "laws",
        "instead, N robots under seventeen control laws, half of them described wrong or not at "
        "all, a third sound, the others beside themselves under PD as stated; goes with --seed "
        "and --jobs"),
    FurtherStudy(
        "many",
        "instead, N robots that hold three to six effects at once, in the proportions of real "
        "drive trains, one in four an arm in space: causes named, their order, and what they "
        "close; goes with --seed and --jobs"),
    FurtherStudy(
        "link-data",
        "instead, N arms in space whose links are all beyond the tolerance of their file, or "
        "not stated, half of them sound: whether an effect is named that is not there; goes with "
        "--seed and --jobs"),
    FurtherStudy(
        "poor-logs",
        "instead, N robots whose logs hold little or are poor: torque commanded, measured, both "
        "or neither, no reference, slow, short, noisy, coarse, filtered or uneven logs; a third "
        "is sound; goes with --seed and --jobs"),
    FurtherStudy(
        "experiments",
        "instead, N robots of two logs that say little; where the answer leaves several names, "
        "the run that it recommends is executed in MuJoCo and added, up to three times: runs to "
        "one name, whether it is right, and what of the limits they used; goes with --seed and "
        "--jobs"))
