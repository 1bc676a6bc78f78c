"""The correction that an answer of a diagnosis holds: joints, and effects as settings."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.analysis.export.arm import Arm, read_arm
from clie_blocks.analysis.export.events import Event, from_the_start, phases_of
from clie_blocks.analysis.gap.report.arm import IN_BODIES
from clie_blocks.effects import LIBRARY
from clie_blocks.effects.effect import Setting
from clie_blocks.effects.library import TERM, effect_of
from clie_blocks.errors import ClieError, RecordError, nearest
from clie_blocks.labels import DiagramError
from clie_blocks.rigid_body.motor_coupling import Matrix, coupling_of, inverse_of

KEY = "correction"
BELT, UNEVEN_GEAR = "coupled_joints", "kinematic_error"


@dataclasses.dataclass(frozen=True)
class Joint:
    """One corrected joint, on the joint side: N m and rad, or N and m of an axis that slides.

    Parameters
    ----------
    name, kind : str
        Its name, and ``hinge`` or ``slide``.
    unit_q, unit_u : str
        Units of the logged position and command.
    zero : float
        Logged position at which the position of the model is zero [rad or m].
    gear_ratio : float
        Motor turns per joint turn, as stated.
    encoder : str
        ``link`` or ``motor``: the shaft that it sees where the two move apart.
    gear, gain : float
        Ratio that was found, and torque of the motor per unit of command.
    torque : float
        Torque at the joint per torque of the model, in whose unit the effects are.
    command : float
        Command of the model per unit of the logged command.
    inertia, beside_links : float
        Whole inertia about the joint as the model has it, and that beside the stated links.
    links_known : bool
        Whether links were stated, so that the two differ.
    damping, offset : float
        Viscous friction, and constant torque that pushes forward.
    before : dict
        What the datasheet said, by name.

    """

    name: str
    kind: str
    unit_q: str
    unit_u: str
    zero: float
    gear_ratio: float
    encoder: str
    gear: float
    gain: float
    torque: float
    command: float
    inertia: float
    beside_links: float
    links_known: bool
    damping: float
    offset: float
    before: Mapping[str, float | None]

    @property
    def slides(self) -> bool:
        """Whether it slides, in m, and does not turn."""
        return self.kind == "slide"

    @property
    def unit_torque(self) -> str:
        """Unit of its torque or force."""
        return "N" if self.slides else "N m"


@dataclasses.dataclass(frozen=True)
class Correction:
    """What is to be brought into a simulator.

    Parameters
    ----------
    joints : tuple of Joint
        In the order of the logs.
    period : float
        Sample time of the controller [s].
    effects : tuple of Setting
        Effects of the robot, in the order in which they act; what set in is there from the start.
    of_law : tuple of Setting
        Effects of the controller or of the recorder, which no simulator of a robot holds.
    without_block : tuple of dict
        Causes that no effect of the catalogue states, with the reason, and whether the bodies of
        `arm` hold them.
    basis : str
        What the model corrects: the ``datasheet``, the user's ``simulator`` or ``loop``.
    verdict : str
        Of the diagnosis.
    of_links : tuple of str
        Effects whose load is the weight of the links, in the place of the torque of the motor.
    uncertainty : dict
        ``numbers`` that the logs leave uncertain, by key, and their ``covariance``.
    events : tuple of Event
        When in the first log something set in.
    arm : Arm, optional
        The links, where they were stated.

    """

    joints: tuple[Joint, ...]
    period: float
    effects: tuple[Setting, ...]
    of_law: tuple[Setting, ...] = ()
    without_block: tuple[Mapping[str, Any], ...] = ()
    basis: str = "datasheet"
    verdict: str = "effect"
    of_links: tuple[str, ...] = ()
    uncertainty: Mapping[str, Any] = dataclasses.field(
        default_factory=lambda: {"numbers": [], "covariance": []})
    events: tuple[Event, ...] = ()
    arm: Arm | None = None

    @property
    def shares(self) -> Matrix | None:
        """How each joint moves each motor, of motors that were stated to turn several joints."""
        return None if self.arm is None else self.arm.shares

    @property
    def belt(self) -> Setting | None:
        """A belt over the joint before that was found on stated links: its motor turns both."""
        return None if self.arm is None else next(
            (one for one in self.effects if one.effect.name == BELT), None)

    @property
    def coupling(self) -> Matrix | None:
        """Matrix C of motors that turn several joints, q = C q_m, by a belt that was found, too.

        None where each motor turns its own joint only.
        """
        if self.arm is None or self.belt is None:
            return None if self.arm is None else self.arm.motor_coupling
        n = len(self.joints)
        ratio = self.belt.vectors(n)["ratio"]
        dragged = np.eye(n) + np.diag(ratio[1:], -1)
        stated = self.arm.motor_coupling
        return coupling_of(dragged if stated is None else np.array(stated) @ dragged, n)

    @property
    def tendons(self) -> Matrix | None:
        """Rows of C^-1: how each joint moves each motor, of motors that turn several joints."""
        return None if self.coupling is None else inverse_of(self.coupling)

    @property
    def beside_arm(self) -> Correction:
        """What a model of the corrected links does not hold."""
        if self.arm is None:
            return self
        return dataclasses.replace(
            self, effects=tuple(one for one in self.effects if one.effect.name not in IN_BODIES),
            without_block=tuple(row for row in self.without_block if not row["in_bodies"]))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the joints."""
        return tuple(joint.name for joint in self.joints)

    @property
    def common_notes(self) -> tuple[str, ...]:
        """What the user of any target must know: events, and what no simulator holds."""
        n = len(self.joints)
        return (*(event.note(self.names[event.joint]) for event in self.events),
                *(phase.note for k, name in enumerate(self.names)
                  for phase in phases_of(self.at(k), name, k, n)),
                *(f"{one!r}: encoders see it, and the motor of the model does not feel what it "
                  "costs to shake the link, which counts where the gear ratio is small."
                  for one in self.effects if one.effect.name == UNEVEN_GEAR),
                *(f"Left out: {row['effect']} at {', '.join(row['joints'])}: {row['why']}."
                  for row in self.without_block),
                *(f"Your controller or your log needs it, not the model: {setting!r}."
                  for setting in self.of_law), *self._coupled_motors())

    def _coupled_motors(self) -> list[str]:
        if self.arm is None or self.arm.motor_coupling is None:
            return []
        return ["Motors turn several joints: every position, velocity and torque here is that of "
                f"a motor over its gear ratio, q_motor = {_rows(self.shares)} q."]

    def index(self, name: str) -> int:
        """Place of a joint by its name."""
        return self.names.index(name)

    def renamed(self, names: Mapping[str, str]) -> Correction:
        """Return it with other names for some joints, by those in the logs."""
        return dataclasses.replace(self, joints=tuple(
            dataclasses.replace(one, name=names.get(one.name, one.name)) for one in self.joints))

    def at(self, k: int) -> tuple[Setting, ...]:
        """Effects that act on joint k."""
        return tuple(one for one in self.effects if one.joints is None or k in one.joints)


def _rows(matrix: Matrix | None) -> str:
    rows = (", ".join(f"{share:.6g}" for share in row) for row in matrix or ())
    return f"[{', '.join(f'[{row}]' for row in rows)}]"


def read_correction(path: str | PathLike[str]) -> Correction:
    """Return the correction in a JSON answer of ``clie diagnose``.

    Parameters
    ----------
    path : path-like
        The answer of one robot.

    Raises
    ------
    RecordError
        If the file is no such answer, is of an older version, or holds no correction in SI.

    """
    try:
        content = json.loads(Path(path).read_text())
    except (OSError, ValueError) as error:
        raise RecordError(f"{path} cannot be read as JSON ({error}); give the answer that 'clie "
                          "diagnose LOG... -o DIR' wrote, DIR/NAME.json") from None
    if not isinstance(content, dict) or "verdict" not in content:
        several = isinstance(content, dict) and any(
            isinstance(one, dict) and "verdict" in one for one in content.values())
        raise RecordError(f"{path} is no answer of one robot" + (
            f"; it holds several: {', '.join(content)}. Give DIR/NAME.json of one of them"
            if several else "; give the JSON that 'clie diagnose LOG... -o DIR' wrote"))
    return correction_of(content, str(path))


def correction_of(answer: Mapping[str, Any], source: str = "answer") -> Correction:
    """Return the correction in an answer, see `read_correction`.

    Parameters
    ----------
    answer : dict
        Answer of a diagnosis, in JSON types.
    source : str
        What to call it in a message.

    Raises
    ------
    RecordError
        As in `read_correction`.

    """
    plain = answer.get(KEY)
    if plain is None:
        raise RecordError(f"{source} was written before answers held a correction; diagnose the "
                          "logs again, with -o of a new folder")
    if plain["not_exported"]:
        raise RecordError(f"{source}: torques of this diagnosis are per unit of u, and a "
                          f"simulator needs N m: {plain['not_exported']}")
    if answer["verdict"] in ("none", "unexplained") and not any(
            row["effect"] == TERM for row in plain["effects"]):
        raise RecordError(f"{source}: the verdict is {answer['verdict']!r}, so there is no "
                          "correction to export; the report says what the logs do not show")
    joints = tuple(_joint(one) for one in plain["joints"])
    effects, events = from_the_start(_settings(plain["effects"], source), len(joints))
    return Correction(joints, float(plain["period"]), effects,
                      tuple(_settings(plain["of_law"], source)),
                      tuple(plain["without_block"]), plain["basis"], answer["verdict"],
                      tuple(plain.get("of_links", ())), plain["uncertainty"], events,
                      read_arm(plain.get("arm")))


def _joint(plain: Mapping[str, Any]) -> Joint:
    return Joint(
        plain["name"], plain["kind"], plain["units"]["q"], plain["units"]["u"], plain["zero"],
        plain["gear_ratio"], plain["encoder"], plain["gear"], plain["gain"], plain["torque"],
        plain["command"], plain["inertia"], plain["beside_links"], plain["links_known"],
        plain["damping"], plain["offset"], plain["before"])


def _settings(rows: Sequence[Mapping[str, Any]], source: str) -> list[Setting]:
    """Effects with their parameters; two of one name get names of their own."""
    found: list[Setting] = []
    for row in rows:
        name = row["effect"]
        if name != TERM and name not in LIBRARY:
            raise RecordError(f"{source}: the effect {name!r} is not in the catalogue; "
                              f"{nearest(name, LIBRARY)}")
        count = sum(one.effect.name == name for one in found)
        joints = None if row["joints"] is None else [k - 1 for k in row["joints"]]
        values = {key: np.asarray(value, float) for key, value in row["parameters"].items()}
        try:
            found.append(effect_of(name)(joints=joints, name=f"{name}_{count + 1}" if count
                                         else name, **values))
        except DiagramError as error:
            raise RecordError(f"{source}: {error}") from None
    return found


def before(joint: Joint, name: str) -> float:
    """Return what the datasheet said of a joint."""
    value = joint.before.get(name)
    return float(getattr(joint, name)) if value is None else float(value)


def check_basis(correction: Correction, source: str) -> None:
    """Refuse to patch a model with what was found beside another simulation.

    Raises
    ------
    ClieError
        If the answer compares with the user's own simulator or loop.

    """
    if correction.basis != "datasheet":
        raise ClieError(
            f"{source} cannot be patched from this answer: it was compared with the logs of your "
            f"own {correction.basis}, and says what to add to it; the report lists the "
            "changes, parameter by parameter. Diagnose without --simulated for a model that can "
            "be exported")


def check_joint_names(names: Sequence[str], known: Sequence[str], source: str) -> None:
    """Refuse a model that lacks a corrected joint.

    Raises
    ------
    ClieError
        For the first joint that is missing, with the nearest name.

    """
    for name in names:
        if name not in known:
            raise ClieError(
                f"{source} has no joint {name!r}, which the answer corrects; "
                f"{nearest(name, known)}. If it is of the same robot, rename the joints "
                "in robot.toml ([robot] joints) or give --joint NAME_IN_LOG=NAME_IN_MODEL")


def check_kind(joint: Joint, name: str, kind: str, kinds: Sequence[str], source: str) -> None:
    """Refuse a joint of a model that moves otherwise than that of the answer.

    Parameters
    ----------
    joint : Joint
        That of the answer.
    name, kind : str
        Name of the joint in the model, and its type there.
    kinds : sequence of str
        Types of the model that move as the joint of the answer does.
    source : str
        What to call the model.

    Raises
    ------
    ClieError
        If it moves otherwise.

    """
    if kind not in kinds:
        raise ClieError(
            f"{source}: the joint {name!r} is of type {kind!r}, and {joint.name} of the answer "
            f"a {joint.kind} in {joint.unit_q}, which is {' or '.join(kinds)}; give the model of "
            "the robot that was logged, or name its joint with --joint "
            "NAME_IN_LOG=NAME_IN_MODEL")
