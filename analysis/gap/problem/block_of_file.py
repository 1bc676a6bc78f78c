"""The law of a robot file that runs as a block, with what it adds of the robot's own model."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.gap.problem.measured_velocity import filter_of
from clie_blocks.analysis.gap.problem.nominal import stated_or
from clie_blocks.analysis.gap.problem.own_law import BlockLaw, block_law
from clie_blocks.analysis.records import Robot
from clie_blocks.analysis.records.controller_section import MEASURED, MODEL_SHARES
from clie_blocks.analysis.records.law_block import law_block, velocity_of
from clie_blocks.errors import NotIdentifiableError
from clie_blocks.labels import DiagramError
from clie_blocks.rigid_body import dynamics
from clie_blocks.robot_loop.links import Links, gravity_torque
from clie_blocks.robot_loop.sampled_law import sampled_law

if TYPE_CHECKING:
    from control import NonlinearIOSystem

    from clie_blocks.controllers.inverse_dynamics import Torque


def law_of_file(robot: Robot, period: float, pose: np.ndarray, links: Links,
                ratio: np.ndarray) -> BlockLaw:
    """Law of a robot whose controller runs as a block, linearised at a pose [rad].

    Raises
    ------
    NotIdentifiableError
        If it is a program that the user has not allowed to run, or a model is missing.
    DiagramError
        If it commands another number of joints than the robot has.

    """
    return as_law(block_of_file(robot, period, links, ratio), robot, period, pose)


def as_law(block: NonlinearIOSystem, robot: Robot, period: float, pose: np.ndarray) -> BlockLaw:
    """Block as the law of a robot, with limit, rounding and unit of its command."""
    controller, n = robot.controller, len(pose)
    law = sampled_law(block, period, stated_or(controller.block_scale, n, 1.0))
    if law.n != n:
        raise DiagramError(f"{law.name}: the law commands {law.n} joints, the robot has {n}")
    return block_law(law, pose, stated_or(controller.saturation, n, np.inf),
                     stated_or(controller.command_resolution, n, 0.0),
                     controller.u_is == MEASURED,
                     velocity=filter_of(controller, period) if law.reads else None)


def block_of_file(robot: Robot, period: float, links: Links,
                  ratio: np.ndarray) -> NonlinearIOSystem:
    """Block of the law that a robot file states; errors are those of `law_of_file`."""
    from clie_blocks.controllers import with_inverse_dynamics, with_weight_compensation

    controller = robot.controller
    law = controller.block or law_block(controller, period, robot.n)
    if law is None:
        raise NotIdentifiableError(
            f"the control law is {controller.law!r}, a program of your own, and a program "
            "from a robot file is run only where you allow it: look at it, then add --run-law, in "
            "Python Problem.from_logs(..., law=block)")
    if controller.compensation is None:
        return law
    if controller.compensation == "gravity":
        return with_weight_compensation(law, _weight(links, ratio))
    shares = {f"model_{name}": stated_or((controller.model_shares or {}).get(name), robot.n, 1.0)
              for name in MODEL_SHARES}
    return with_inverse_dynamics(
        law, _dynamics(robot, links, ratio), shares, controller.compensation,
        rate=controller.reference_rate or "trajectory",
        velocity_filter=velocity_of(controller, period))


def _weight(links: Links, ratio: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Weight of the stated links, on the side of the command."""
    if not links.known:
        raise NotIdentifiableError(
            "compensation = 'gravity' adds the weight of the links, and the robot file states "
            "none: state [links] with mass_kg, length_m and com_m, or a model")
    if not links.has_gravity:
        raise NotIdentifiableError(
            "compensation = 'gravity' adds the weight of the links, and by [nominal] the robot "
            "feels none: state gravity = true there, or leave the compensation out")
    return lambda q: gravity_torque(links, q) / ratio


def _dynamics(robot: Robot, links: Links, ratio: np.ndarray) -> Torque:
    """Inverse dynamics of the stated robot, on the side of the command, with shares of it."""
    motor, n = robot.motor, robot.n
    if motor.inertia is None:
        raise NotIdentifiableError(
            f"compensation = {robot.controller.compensation!r} adds the dynamics of the robot, "
            "and the robot file states no inertia: state [motor] inertia_kgm2, and the links")
    rotor = ratio * stated_or(motor.inertia, n, 0.0)
    drag = ratio * stated_or(motor.viscous_friction, n, 0.0) + links.bearing_damping / ratio

    def torque(q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, params: object) -> np.ndarray:
        shares = [params[f"model_{name}"] for name in MODEL_SHARES]  # type: ignore[index]
        own = shares[1] * rotor * ddq + shares[2] * drag * dq
        if not links.known:
            return own
        change = shares[0] - 1.0
        model = links.with_changes(mass=change, inertia=change)
        tree = model.tree if links.has_gravity else model.tree.with_gravity((0.0, 0.0, 0.0))
        return own + dynamics.inverse_dynamics(tree, q, dq, ddq) / ratio

    return torque
