"""BAM recordings of a servo with a pendulum (github.com/Rhoban/bam): one record per run.

The firmware sets a duty cycle from the position error; the torque follows from duty times supply
voltage less back-EMF.  Motor constants are BAM's own fit of other recordings of the same servo.
"""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.analysis.records.clock import segments
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.model import SUPPLY, Record
from clie_blocks.analysis.records.readers.emps import columns_of
from clie_blocks.analysis.records.readers.options import Options, library_errors
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.robot_sections import Encoder, Experiment, Links, Motor

STEPS = 4096  # of the encoder per turn
FULL_DUTY = 885  # largest value of the duty register
GAIN_UNIT = STEPS / (2 * math.pi) / (256 * FULL_DUTY)  # duty per rad and unit of the P register
UNITS = {"u": "duty", "pe": "duty"}


def read(folder: Path, options: Options) -> list[Record]:
    """Return the runs of a folder with ``runs.parquet`` and ``runs.json``."""
    columns = columns_of(folder / "runs.parquet")
    with library_errors(folder / "runs.json", "JSON"):
        runs = json.loads((folder / "runs.json").read_text())
        constants = _constants(folder)
        return [_record({name: value[columns["run"] == run["run"]]
                         for name, value in columns.items()}, run, constants, folder)
                for run in runs]


def _constants(folder: Path) -> dict[str, float]:
    path = folder / "bam_params" / "m1.json"
    return json.loads(path.read_text()) if path.is_file() else {}


def _record(columns: Mapping[str, np.ndarray], run: Mapping[str, Any],
            constants: Mapping[str, float], folder: Path) -> Record:
    name = f"{run['trajectory']}, P {run['kp']}"
    ranges, notes = segments(columns["t"])
    off = np.count_nonzero(~columns["torque_enable"])
    if off:
        notes.append(f"The torque was off in {off} of {columns['t'].size} samples (channel "
                     "torque_enable): there the control law does not act.")
    return Record(
        time=columns["t"], q=columns["position"], u=columns["duty"], qd=columns["goal_position"],
        dq=columns["speed"], joints=("servo",), units=UNITS, segments=ranges,
        source=f"{folder / 'runs.parquet'} run {run['run']} ({name})",
        decisions=["u is the signed duty cycle; the supply voltage is the channel 'supply'.",
                   "q is 0 where the arm hangs down.", *notes],
        extra={SUPPLY: columns["input_volts"], "temperature": columns["temp"],
               "torque_enable": columns["torque_enable"]},
        robot=_robot(run, constants, name))


def _robot(run: Mapping[str, Any], constants: Mapping[str, float], name: str) -> Robot:
    def fitted(key: str) -> np.ndarray | None:
        return np.array([constants[key]]) if key in constants else None

    one = np.ones(1)
    return Robot(
        n=1, name=f"{run['motor']} servo with pendulum", joints=("servo",), units=UNITS,
        motor=Motor(gear_ratio=one, torque_constant=fitted("kt"), resistance=fitted("R"),
                    inertia=fitted("armature")),
        links=Links(mass=run["mass"], length=run["length"], com=run["length"], inertia=0.0 * one),
        controller=Controller(law="servo", kp=run["kp"] * GAIN_UNIT, saturation=one,
                              hold="zero-order", command_resolution=one / FULL_DUTY,
                              supply=run["vin"]),
        encoder=Encoder(mounting="joint side", resolution=one * (2 * math.pi / STEPS)),
        experiments={name: Experiment(excitation="other", signal=run["trajectory"])},
        source="BAM runs.json")
