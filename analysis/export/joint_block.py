"""What acts on one corrected joint, as one sampled block made of the effects' own kernels.

    inputs   q, dq of the joint, u as logged, tau_other: torque that the simulator adds itself
             of an effect of the whole robot q_robot, dq_robot and u_robot of all its joints, too
    outputs  tau on the joint, dry friction included, u_delivered, tau_smooth without dry friction,
             friction_forward, friction_backward (largest dry friction), q_measured

Everything outside is on the joint side, in N m and rad or N and m; inside, in the units of the
model.  A joint with an elastic or loose gear keeps its motor inside: q and dq are the link's.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from clie_blocks.analysis.export.correction import Correction, Joint
from clie_blocks.analysis.export.events import MOMENTS
from clie_blocks.analysis.gap.causes.friction import OF_LINKS
from clie_blocks.effects.effect import Setting
from clie_blocks.effects.insertion import of_law
from clie_blocks.labels import signals
from clie_blocks.robot_loop.dynamics import (
    Memory,
    NamedPieces,
    Piece,
    State,
    delivered_torque,
    dry_friction,
    measured_position,
    opposing_torque,
)
from clie_blocks.robot_loop.links import no_links
from clie_blocks.robot_loop.pieces import delay_samples, pieces_of, with_delay_line

if TYPE_CHECKING:
    from control import NonlinearIOSystem

INPUTS = ("q", "dq", "u", "tau_other")
OF_ROBOT = ("q_robot", "dq_robot", "u_robot")
OUTPUTS = ("tau", "u_delivered", "tau_smooth", "friction_forward", "friction_backward",
           "q_measured")
_MOTOR_SUBSTEPS = 5  # of a step in which motor and link move apart, as in the sampled robot


@dataclasses.dataclass(frozen=True)
class _BesideLinks(State):
    """A joint whose links the simulator moves: what they load it with is an input."""

    weight: np.ndarray

    @property
    def carried(self) -> np.ndarray:
        """Torque that the gear carries, motor side."""
        return self.weight


def reads_all_joints(setting: Setting) -> bool:
    """Whether an effect at one joint depends on the others; a fault does where it is a weight."""
    weight = setting.values.get("weight", 0.0)
    return not setting.effect.per_joint and (
        setting.effect.name not in MOMENTS or bool(np.any(weight)))


def why_no_block(setting: Setting, joints: int) -> str:
    """Why no block of one joint can hold an effect; empty where it can."""
    effect = setting.effect
    if effect.port in ("controller", "log") or of_law(setting):
        return "it belongs to the controller or the recorder, not to the robot"
    if effect.port == "body":
        return "it is a mass, which the bodies of a simulator hold"
    if reads_all_joints(setting) and joints > 1:
        return ("it couples the joints, and a block of one joint does not see the others; the "
                "target mujoco holds it, in its module for all joints")
    return ""


@dataclasses.dataclass(frozen=True, eq=False)
class JointBlock:
    """The block of one joint, see the module.

    Parameters
    ----------
    joint : Joint
        The joint.
    effects : tuple of Setting
        Effects that it holds.
    step : float
        Its sample time [s].
    k, n : int
        Place of the joint among all joints.
    whole : bool
        It also holds the viscous friction and the offset of the joint.
    joints : tuple of Joint
        All joints of the robot, where an effect reads them; `joint` is that at `k`.
    of_links : tuple of str
        Effects whose load is the weight of the links, less `tau_other`.

    """

    joint: Joint
    effects: tuple[Setting, ...]
    step: float
    k: int = 0
    n: int = 1
    whole: bool = True
    joints: tuple[Joint, ...] = ()
    of_links: tuple[str, ...] = ()

    @property
    def sees_robot(self) -> bool:
        """Whether an effect reads the other joints."""
        return self.n > 1 and any(map(reads_all_joints, self.effects))

    @property
    def reads_load(self) -> bool:
        """Whether an effect needs `tau_other` for the load of the gear."""
        return any(one.effect.name in self.of_links for one in self.effects)

    @property
    def pieces(self) -> NamedPieces:
        """What the effects add, each delay with as many samples as it needs."""
        return [(setting.name, with_delay_line(
                    piece, 1 + delay_samples(piece, self._values(setting), self.step)))
                for setting in self.effects
                for piece in pieces_of(OF_LINKS if setting.effect.name in self.of_links
                                       else setting.effect,
                                       [p.name for p in setting.effect.parameters])]

    def _values(self, setting: Setting) -> dict[str, np.ndarray]:
        """Parameters of an effect at this joint, arrays (1,); of the whole robot, (n,)."""
        vectors = setting.vectors(self.n)
        if reads_all_joints(setting):
            return vectors
        return {key: value[self.k:self.k + 1] if len(value) == self.n else value[:1]
                for key, value in vectors.items()}

    def _seen(self, pieces: NamedPieces, u: np.ndarray, p: Mapping[str, Any]) -> NamedPieces:
        """The same pieces, where those of the whole robot read all joints."""
        if not self.sees_robot:
            return pieces
        q, dq, command = u[4:].reshape(3, self.n)
        robot = q - p["zero_robot"], dq, p["command_robot"] * command
        ratio = np.array([one.gear_ratio for one in self.joints])
        whole = {one.name for one in self.effects if reads_all_joints(one)}
        return [(name, dataclasses.replace(piece, act=_at_joint(piece.act, self.k, robot, ratio))
                 if name in whole else piece) for name, piece in pieces]

    @property
    def gear(self) -> tuple[str, Piece] | None:
        """The transmission between motor and link, if they move apart."""
        return next(((name, piece) for name, piece in self.pieces
                     if piece.port == "transmission"), None)

    @property
    def motor_inertia(self) -> float:
        """Inertia of a motor that moves inside the block, on the joint side; 0 without one."""
        if self.gear is None:
            return 0.0
        at_joint = {setting.name: self._values(setting) for setting in self.effects}
        return self.joint.torque * float(at_joint[self.gear[0]]["motor_inertia"][0])

    def system(self, name: str = "joint") -> NonlinearIOSystem:
        """Return the block as a python-control system in discrete time."""
        import control as ct

        pieces, gear = self.pieces, self.gear
        rows = {one: piece.states for one, piece in pieces if piece.states}
        if gear:
            rows |= {"q_motor": 1, "dq_motor": 1, "started": 1}
        params = {"zero": np.array([self.joint.zero]), "torque": np.array([self.joint.torque]),
                  "command": np.array([self.joint.command]),
                  "drive": np.array([self.joint.gear * self.joint.gain / self.joint.command]),
                  "inertia": np.array([self.joint.inertia / self.joint.torque]),
                  "damping": np.array([self.joint.damping / self.joint.torque * self.whole]),
                  "load": np.array([-self.joint.offset / self.joint.torque * self.whole])}
        for setting in self.effects:
            params |= {f"{setting.name}.{key}": value
                       for key, value in self._values(setting).items()}
        if self.sees_robot:
            params |= {"zero_robot": np.array([one.zero for one in self.joints]),
                       "command_robot": np.array([one.command for one in self.joints])}

        def evaluate(t: float, x: np.ndarray, u: np.ndarray, params: Mapping[str, np.ndarray],
                     ) -> tuple[list[np.ndarray], list[np.ndarray]]:
            return self._evaluate(t, _unpack(x, rows, pieces), u, params, pieces, gear)

        def update(t: float, x: np.ndarray, u: np.ndarray,
                   params: Mapping[str, np.ndarray]) -> np.ndarray:
            after = evaluate(t, x, u, params)[1]
            return np.concatenate(after) if after else np.zeros(0)

        def output(t: float, x: np.ndarray, u: np.ndarray,
                   params: Mapping[str, np.ndarray]) -> np.ndarray:
            return np.concatenate(evaluate(t, x, u, params)[0])

        states = [f"{one}_{row}" for one, count in rows.items() for row in range(count)]
        return ct.nlsys(update if states else None, output, name=name, dt=self.step,
                        params=params, states=states or None,
                        inputs=[*signals(*INPUTS, n=1),
                                *(signals(*OF_ROBOT, n=self.n) if self.sees_robot else [])],
                        outputs=signals(*OUTPUTS, n=1))

    def _evaluate(self, t: float, memory: Memory, u: np.ndarray,
                  params: Mapping[str, np.ndarray], pieces: NamedPieces,
                  gear: tuple[str, Piece] | None,
                  ) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Outputs, and every state one sample later."""
        p = _parameters(params, pieces)
        pieces = self._seen(pieces, u, p)
        now = _BesideLinks(u[0:1] - p["zero"], u[1:2], p["command"] * u[2:3], t, self.step,
                           no_links(1), np.array([self.joint.gear_ratio]), -u[3:4] / p["torque"])
        motor = now
        if gear:
            fresh = memory["started"][0] < 0.5
            motor = dataclasses.replace(
                now, q=np.where(fresh, now.q, memory["q_motor"][0]),
                dq=np.where(fresh, now.dq, memory["dq_motor"][0]))
        first = {**memory, **_sensor_start(memory, pieces, t, now.q)}
        delivered, of_drive = delivered_torque(motor, memory, pieces, p)
        seen = motor if gear and self.joint.encoder == "motor" else now
        q, of_sensor = measured_position(seen, first, pieces, p)
        driven = dataclasses.replace(motor, u=delivered)
        if gear:
            torque, limits, after = self._through_gear(now, driven, memory, pieces, gear, p)
        else:
            opposing, of_load = opposing_torque(driven, memory, pieces, p)
            limits, of_friction = _limits(driven, memory, pieces, p)
            torque = p["drive"] / p["torque"] * delivered - opposing
            after = {**of_load, **of_friction}
        smooth = p["torque"] * torque
        forward, backward = (p["torque"] * side for side in limits)
        whole = p["torque"] * p["inertia"] * now.dq / self.step + smooth + u[3:4]
        tau = smooth if gear else smooth - np.clip(whole, -backward, forward)
        after = {**of_drive, **of_sensor, **after}
        names = dict.fromkeys(name for name, piece in pieces if piece.states)
        kept = [row for name in names for row in after[name]]
        kept += [*after["q_motor"], *after["dq_motor"], 1.0 + 0.0 * tau] if gear else []
        return [tau, delivered / p["command"], smooth, forward, backward, q + p["zero"]], kept

    def _through_gear(self, link: State, motor: State, memory: Memory, pieces: NamedPieces,
                      gear: tuple[str, Piece], p: Mapping[str, Any],
                      ) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray], Memory]:
        """Mean torque of the gear on the link, and the motor a step later, beside a moving link.

        All friction acts on the motor, whose motion is computed here; none is left for the joint.
        """
        name, transmission = gear
        of_gear = p[name]
        _, link_inertia, bearing = transmission.split(p, of_gear)  # type: ignore[misc]
        inertia = p["inertia"] - link_inertia
        h, q, q_m, dq_m = self.step / _MOTOR_SUBSTEPS, link.q, motor.q, motor.dq
        state, passed, after = memory.get(name, []), [], {}
        for _ in range(_MOTOR_SUBSTEPS):
            q, q_m = q + h / 2 * link.dq, q_m + h / 2 * dq_m
            now = dataclasses.replace(motor, q=q_m, dq=dq_m)
            torque, state = transmission.act(q_m - q, dq_m - link.dq, state, h, of_gear,
                                             link_inertia, inertia)
            opposing, of_load = opposing_torque(now, memory, pieces, p)
            driven = p["drive"] / p["torque"] * motor.u - opposing + bearing * dq_m
            dq_m = dq_m + h * (driven - torque) / inertia
            (forward, backward), of_friction = _limits(now, memory, pieces, p)
            dq_m = dq_m - np.clip(dq_m * inertia, -h * backward, h * forward) / inertia
            q, q_m = q + h / 2 * link.dq, q_m + h / 2 * dq_m
            passed.append(torque - bearing * link.dq)
            after = {**of_load, **of_friction, name: state}
        none = 0.0 * q_m
        return (sum(passed[1:], passed[0]) / _MOTOR_SUBSTEPS, (none, none),
                {**after, "q_motor": [q_m], "dq_motor": [dq_m]})


def joint_block(correction: Correction, k: int, step: float,
                effects: Sequence[Setting] | None = None, whole: bool = True,
                sees_links: bool = True) -> JointBlock:
    """Return the block of joint k.

    Parameters
    ----------
    correction : Correction
        The corrected robot.
    k : int
        The joint, from 0.
    step : float
        Step of the simulator [s].
    effects : sequence of Setting, optional
        What it holds; by default everything that acts on the joint and that it can hold.
    whole : bool
        It also holds the viscous friction and the offset of the joint.
    sees_links : bool
        Its input `tau_other` holds the weight of the links; else friction that grows with their
        load takes the torque of the motor for it.

    """
    n = len(correction.joints)
    held = effects if effects is not None else [
        one for one in correction.at(k) if not why_no_block(one, n)]
    return JointBlock(correction.joints[k], tuple(held), step, k, n, whole, correction.joints,
                      correction.of_links if sees_links else ())


def _at_joint(act: Callable[..., Any], k: int, robot: tuple[np.ndarray, ...],
              ratio: np.ndarray) -> Callable[..., Any]:
    """A piece of the whole robot as one of joint k, whose own signals are those of the block.

    It has no memory: no effect that couples joints has one.
    """
    def act_at_joint(s: State, z: list[np.ndarray], p: Mapping[str, Any],
                     ) -> tuple[Any, list[np.ndarray]]:
        q, dq, u = (np.concatenate([signal[:k], here, signal[k + 1:]])
                    for signal, here in zip(robot, (s.q, s.dq, s.u), strict=True))
        whole, _ = act(dataclasses.replace(s, q=q, dq=dq, u=u, ratio=ratio), z, p)
        if isinstance(whole, tuple):  # limits of friction
            return tuple(side[k:k + 1] for side in whole), z
        return whole[k:k + 1], z

    return act_at_joint


def _unpack(x: np.ndarray, rows: Mapping[str, int], pieces: NamedPieces) -> Memory:
    """Memory of each piece, one array (1,) per state; none of one without."""
    memory: Memory = {name: [] for name, _ in pieces}
    first = 0
    for name, count in rows.items():
        memory[name] = [x[k:k + 1] for k in range(first, first + count)]
        first += count
    return memory


def _sensor_start(memory: Memory, pieces: NamedPieces, t: float, q: np.ndarray) -> Memory:
    """Memory of the sensors, which begins as the position."""
    return {name: [np.where(t > 0.0, row, q) for row in memory[name]]
            for name, piece in pieces if piece.port == "sensor" and piece.states}


def _parameters(params: Mapping[str, np.ndarray], pieces: NamedPieces) -> dict[str, Any]:
    """Numbers of the joint, and one mapping per effect."""
    names = {name for name, _ in pieces}
    p: dict[str, Any] = {name: {} for name in names}
    for key, value in params.items():
        owner, _, parameter = key.partition(".")
        if parameter:
            p[owner][parameter] = value
        else:
            p[key] = value
    return p


def _limits(now: State, memory: Memory, pieces: NamedPieces, p: Mapping[str, Any],
            ) -> tuple[tuple[np.ndarray, np.ndarray], Memory]:
    """Largest dry friction against forward and backward motion, zero where there is none."""
    limits, after = dry_friction(now, memory, pieces, p)
    if limits is None:
        return (0.0 * now.q, 0.0 * now.q), after
    return (limits[0], limits[1]), after
