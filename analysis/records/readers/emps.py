"""The EMPS benchmark (Janot, Gautier, Brunot 2019): one sliding axis under cascaded P-P control.

Source: nonlinearbenchmark.org/benchmarks/emps.  Gains and force factor from its archive; the
velocity estimate, the encoder step and the factor of the pulses were found in the log: with them
the stated law gives the logged command to 10 mV rms.
"""

import os
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.readers.mat_variables import read_columns
from clie_blocks.analysis.records.readers.options import Options, library_errors, need
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.robot_sections import Encoder, Motor

LOGS = ("DATA_EMPS", "DATA_EMPS_PULSES")
UNITS = {"q": "m", "qd": "m", "u": "V", "pe": "V", "dq": "m/s", "tau": "N"}
PULSE_FACTOR = 1.014  # V in the command per V of pulses_N


def is_emps(names: Iterable[str]) -> bool:
    """Whether a log has the variables of the EMPS archive."""
    return {"t", "qg", "qm", "vir"} <= set(names)


def robot() -> Robot:
    """Return the EMPS machine with its published gains."""
    return Robot(
        n=1, name="EMPS: DC motor and ball screw", joints=("axis",), units=UNITS,
        motor=Motor(torque_gain=np.array([35.15065188248547])),
        controller=Controller(law="cascade", kp=np.array([160.18]), kv=np.array([243.45]),
                              velocity_filter="two_tap", sample_time=0.001, hold="zero-order",
                              saturation=np.array([10.0])),
        encoder=Encoder(resolution=np.array([5e-8])), source="EMPS benchmark")


def record(columns: Mapping[str, ArrayLike], source: str) -> Record:
    """Return the record of one EMPS log: ``t, qg, qm, vir`` and for the pulses ``pulses_N``."""
    pulses = columns.get("pulses_N")
    decisions = ["Recognised the EMPS benchmark by its variables: qm is q in m on the load side, "
                 "qg is qd, vir is u in V; one volt gives 35.15 N."]
    if pulses is not None:
        decisions.append(f"pe is {PULSE_FACTOR} * pulses_N, a factor found in the log; it is part "
                         "of vir.")
    flat = {name: np.asarray(value, float).ravel() for name, value in columns.items()}
    return Record(time=flat["t"], q=flat["qm"], u=flat["vir"], qd=flat["qg"],
                  pe=None if pulses is None else PULSE_FACTOR * flat["pulses_N"],
                  joints=("axis",), units=UNITS, source=source, decisions=decisions, robot=robot())


def read(folder: Path, options: Options) -> list[Record]:
    """Return the records of a folder with the EMPS files, Parquet or MATLAB.

    The identification run comes first, then the run with pulses.

    """
    records = []
    for stem in LOGS:
        path = folder / f"{stem}.parquet"
        if path.is_file():
            records.append(record(columns_of(path), str(path)))
        elif (path := folder / f"{stem}.mat").is_file():
            records.append(record(read_columns(path), str(path)))
    return records


def columns_of(path: str | os.PathLike[str]) -> dict[str, np.ndarray]:
    """Return the columns of a Parquet file by name."""
    pq = need("pyarrow.parquet", "reading Parquet", "parquet", "pyarrow")
    with library_errors(path, "Parquet"):
        table = pq.read_table(path)
        return {name: table[name].to_numpy() for name in table.column_names}
