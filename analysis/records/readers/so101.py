"""Designed motions of an SO-101 arm from SAGE (github.com/isaac-sim2real/sage): one record each.

Each tick writes six goals and then reads the servos one after another, so the readings are late by
a few to 15 ms and skewed between joints; the stamp is the start of the tick.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from clie_blocks.analysis.records.clock import segments
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.readers.emps import columns_of
from clie_blocks.analysis.records.readers.options import Options
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.robot_sections import Encoder
from clie_blocks.analysis.records.runs import equal_ranges

JOINTS = ("rotation", "pitch", "elbow", "wrist_pitch", "wrist_roll", "jaw")
UNITS = {"q": ("rad",) * 5 + ("1",), "qd": ("rad",) * 5 + ("1",), "dq": ("rad/s",) * 5 + ("1",)}
DECISIONS = (
    "qd is the goal written to the servos; the law of their firmware and its command are unknown.",
    "The torque estimate comes from a current without sign, so it is the channel 'tau_abs'.",
    "Positions are read 3 to 15 ms after their stamp, later for later joints.",
)


def read(folder: Path, options: Options) -> list[Record]:
    """Return the motions of a folder with ``so101.parquet``."""
    path = folder / "so101.parquet"
    columns = columns_of(path)
    motions = np.asarray(columns.pop("motion")).astype(str)
    return [_record({name: value[a:b] for name, value in columns.items()},
                    f"{path} {motions[a]}") for a, b in equal_ranges(motions)]


def _record(columns: Mapping[str, np.ndarray], source: str) -> Record:
    def joints(kind: str) -> np.ndarray:
        return np.column_stack([columns[f"{kind}_{joint}"] for joint in JOINTS])

    ranges, notes = segments(columns["t"])
    return Record(time=columns["t"], q=joints("q"), qd=joints("cmd"), dq=joints("dq"),
                  joints=JOINTS, units=UNITS, source=source, segments=ranges,
                  decisions=(*DECISIONS, *notes), extra={"tau_abs": joints("tau_abs")},
                  robot=_robot())


def _robot() -> Robot:
    return Robot(n=6, name="SO-101 arm with STS3215 servos", joints=JOINTS,
                 controller=Controller(law="unknown", sample_time=0.02),
                 encoder=Encoder(resolution=np.full(6, 0.001534)), source="SAGE so101")
