"""What is known of a robot and its controller, as an engineer would state it in `robot.toml`.

Each field carries its keys in the file and the kind of value it takes, so that the file, the
check and the attribute cannot drift apart.  What is not stated is None and counts as unknown.
Lists have one entry per joint.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, TypeVar, overload

import numpy as np

from clie_blocks.analysis.records.controller_section import NO_EXTENSION, PROGRAM, Controller
from clie_blocks.analysis.records.fields import FixedDict, check_name, per_joint
from clie_blocks.analysis.records.robot_sections import (
    Encoder,
    Experiment,
    Limits,
    Links,
    Motor,
    Nominal,
)
from clie_blocks.analysis.records.section import Section
from clie_blocks.errors import RecordError
from clie_blocks.labels import DiagramError
from clie_blocks.rigid_body.motor_coupling import Matrix, coupling_of
from clie_blocks.rigid_body.tree import Tree

if TYPE_CHECKING:
    from control import InputOutputSystem

Part = TypeVar("Part", bound=Section)


@dataclasses.dataclass(frozen=True, eq=False)
class Robot:
    """All that is known of one robot.

    Parameters
    ----------
    n : int
        Number of joints; key ``joints``.
    name : str
        What it is.
    joints : sequence of str
        Joint names; key ``joint_names``; by default ``joint1, joint2, ...``.
    motor, links, nominal, controller, encoder, limits
        The sections of the file, `Motor` to `Limits`; a missing one holds only unknowns.
    experiments : mapping of str to Experiment
        By the stem of the log's file name.
    units : mapping of str to str
        Unit of a signal of `Record` where it is not rad and N m.
    columns : mapping of str to str
        Column patterns of the logs, such as ``{"q": "actual_pos_{joint}"}``.
    source : str
        The file.
    tree : Tree or None
        Links of the model that the file names, or that is given here.

    Raises
    ------
    RecordError
        If a value is not of its kind, out of bounds, or not one per joint.

    """

    n: int
    name: str = ""
    joints: tuple[str, ...] = ()
    motor: Motor = Motor()
    links: Links = Links()
    nominal: Nominal = Nominal()
    controller: Controller = Controller()
    encoder: Encoder = Encoder()
    limits: Limits = Limits()
    experiments: Mapping[str, Experiment] = dataclasses.field(default_factory=FixedDict)
    units: Mapping[str, str] = dataclasses.field(default_factory=FixedDict)
    columns: Mapping[str, str] = dataclasses.field(default_factory=FixedDict)
    source: str = ""
    tree: Tree | None = None

    def __post_init__(self) -> None:
        if self.tree is not None and self.tree.n != self.n:
            raise RecordError(f"{self.source or 'robot'}: the model of the links has "
                              f"{self.tree.n} joints that move, {', '.join(self.tree.names)}, the "
                              f"robot {self.n}; lock those that the logs do not hold, or name the "
                              "tip of the arm")
        names = tuple(self.joints) or tuple(f"joint{k + 1}" for k in range(self.n))
        if len(set(names)) != self.n:
            raise RecordError(f"{self.source or 'robot'}: {self.n} joints need {self.n} different "
                              f"names, got {', '.join(map(str, names))}")
        where = self.source or "robot"
        check_name(self.name, f"{where}: the name")
        for name in names:
            check_name(name, f"{where}: the joint name")
        object.__setattr__(self, "joints", names)
        for name in ("experiments", "units", "columns"):
            object.__setattr__(self, name, FixedDict(dict(getattr(self, name))))
        for name in ("motor", "links", "controller", "encoder", "limits"):
            object.__setattr__(self, name, self._fitted(getattr(self, name)))
        object.__setattr__(self, "motor", self._coupled(self.motor))

    @property
    def motor_coupling(self) -> Matrix | None:
        """Matrix C of motors that turn several joints, or against theirs; None of others."""
        return None if self.motor.coupling is None else coupling_of(self.motor.coupling, self.n)

    def __repr__(self) -> str:
        links = "unknown" if self.tree is None and self.links.mass is None else "known"
        return (f"Robot({self.name!r}: joints {', '.join(self.joints)}; law "
                f"{self.controller.law}; links {links})")

    def _fitted(self, section: Part) -> Part:
        changes: dict[str, object] = {field.name: per_joint(getattr(section, field.name), self.n,
                                         f"{type(section).__name__}.{field.name}")
                   for field in dataclasses.fields(section) if field.metadata["kind"] == "joints"}
        changes |= {field.name: self._fitted_table(getattr(section, field.name), field.name)
                    for field in dataclasses.fields(section) if field.metadata["kind"] == "table"}
        return dataclasses.replace(section, **changes)

    def _fitted_table(self, table: Mapping[str, np.ndarray] | None,
                      where: str) -> Mapping[str, np.ndarray | None] | None:
        return None if table is None else {
            name: per_joint(value, self.n, f"{where}.{name}") for name, value in table.items()}

    def _coupled(self, motor: Motor) -> Motor:
        """Drives with positive gear ratios, whose signs are in the matrix of the coupling."""
        where = f"{self.source or 'robot'}: [motor]"
        ratio = motor.gear_ratio
        turned = ratio is not None and bool((ratio < 0).any())
        if motor.coupling is None and not turned:
            return motor
        try:
            coupling = coupling_of(np.eye(self.n) if motor.coupling is None else motor.coupling,
                                   self.n, f"{where} motor_coupling")
        except DiagramError as error:
            raise RecordError(str(error)) from None
        matrix = np.eye(self.n) if coupling is None else np.array(coupling)
        if ratio is not None and turned:
            matrix, ratio = matrix * np.sign(ratio), np.abs(ratio)
        if self.links.mass is not None and (coupling is not None or turned):
            raise RecordError(f"{where} motor_coupling and gear ratios below zero go with links "
                              'of a model: model = "arm.urdf" in [links], and no numbers per link')
        return dataclasses.replace(
            motor, gear_ratio=ratio,
            coupling=None if coupling is None and not turned else matrix)


def with_law(robot: Robot, block: InputOutputSystem) -> Robot:
    """Robot whose law is a block of python-control, in samples of its own or of the controller.

    What the robot file says of limits and rounding of the command stays.
    """
    law = robot.controller
    is_timed = block.dt not in (None, True, 0)
    return dataclasses.replace(robot, controller=dataclasses.replace(
        law, law=law.law if law.is_program else PROGRAM, block=block, kp=None, ki=None, kd=None,
        kv=None, velocity_of=None, velocity_filter=None, highpass=None, lowpass=None,
        discretisation=None, **NO_EXTENSION,
        sample_time=float(block.dt) if is_timed else law.sample_time))


@overload
def as_checks_see(robot: Robot) -> Robot: ...
@overload
def as_checks_see(robot: Robot | None) -> Robot | None: ...
def as_checks_see(robot: Robot | None) -> Robot | None:
    """Robot whose law is unknown where it runs as a block, which checks do not."""
    if robot is None or not robot.controller.is_block:
        return robot
    return dataclasses.replace(robot, controller=dataclasses.replace(
        robot.controller, law="unknown", block=None, velocity_of=None, **NO_EXTENSION))


def speaks_of_torque(robot: Robot) -> bool:
    """Whether a robot file states gains of its law, or anything in kg m^2, kg or N m."""
    motor = dataclasses.asdict(robot.motor)
    del motor["gear_ratio"], motor["coupling"]
    return (robot.controller.law != "unknown" or robot.links.mass is not None
            or robot.tree is not None or any(value is not None for value in motor.values()))
