"""DFKI double pendulum, torque-driven (github.com/dfki-ric-underactuated-lab/double_pendulum).

Torques are at the joint, behind the 6:1 gear, so the gear ratio here is 1 and the rotor inertia is
the reflected one.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from clie_blocks.analysis.records.clock import segments
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.readers.emps import columns_of
from clie_blocks.analysis.records.readers.options import Options, library_errors
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.robot_sections import Links, Motor
from clie_blocks.analysis.records.runs import equal_ranges

DECISIONS = (
    "u is the commanded and tau the measured torque, both at the joint behind the gear.",
    "The reference of the swing-up runs has another time base and was left out.",
)


def read(folder: Path, options: Options) -> list[Record]:
    """Return the runs of a folder with ``sysid.parquet`` and one yml file per design."""
    path = folder / "sysid.parquet"
    columns = columns_of(path)
    runs = np.asarray(columns.pop("run")).astype(str)
    designs = np.asarray(columns.pop("design")).astype(str)
    robots = {design: _robot(folder, design) for design in dict.fromkeys(designs)}
    return [_record({name: value[a:b] for name, value in columns.items()},
                    f"{path} {runs[a]}", robots[designs[a]])
            for a, b in equal_ranges(runs)]


def _record(columns: Mapping[str, np.ndarray], source: str, robot: Robot) -> Record:
    def joints(name: str) -> np.ndarray:
        return np.column_stack([columns[f"{name}1"], columns[f"{name}2"]])

    ranges, notes = segments(columns["t"])
    return Record(time=columns["t"], q=joints("pos_meas"), u=joints("tau_con"),
                  dq=joints("vel_meas"), tau=joints("tau_meas"), source=source, segments=ranges,
                  decisions=(*DECISIONS, *notes), robot=robot)


def _robot(folder: Path, design: str) -> Robot:
    paths = sorted(folder.glob(f"design_{design}_model_*.yml"))
    known = _numbers(paths[0]) if paths else {}
    return Robot(n=2, name=f"DFKI double pendulum, design {design}", motor=_motor(known),
                 links=_links(known), controller=Controller(law="unknown", sample_time=0.002),
                 source=str(paths[0]) if paths else "")


def _numbers(path: Path) -> dict[str, float]:
    """Numbers of a flat ``key: value`` file."""
    with library_errors(path, "a list of key: value"):
        pairs = [line.split(":", 1) for line in path.read_text().splitlines() if ":" in line]
        return {key.strip(): float(value) for key, value in pairs}


def _motor(known: Mapping[str, float]) -> Motor:
    if not known:
        return Motor()
    return Motor(gear_ratio=np.ones(2), inertia=np.full(2, known["Ir"] * known["gr"] ** 2),
                 peak_torque=np.array([known["tl1"], known["tl2"]]))


def _links(known: Mapping[str, float]) -> Links:
    """Links of a design; an inertia about the joint below m r^2 is no body and stays unknown."""
    if not known:
        return Links()
    mass, com = (np.array([known[f"{key}{k}"] for k in (1, 2)]) for key in ("m", "r"))
    about_joint = np.array([known["I1"], known["I2"]])
    inertia = about_joint - mass * com**2
    return Links(length=np.array([known["l1"], known["l2"]]), mass=mass, com=com,
                 inertia=inertia if (inertia >= 0).all() else None,
                 joint_viscous_friction=np.array([known["b1"], known["b2"]]))
