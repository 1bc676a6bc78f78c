"""Limits of a drive behind a law: how fast a command may change, and torque over speed."""

from __future__ import annotations

from collections.abc import Sequence

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.controllers.sampled import Params, VelocityFilter
from clie_blocks.controllers.wrapping import numbers, with_command

BOUNDS: dict[str, tuple[str, float | None]] = {
    "command_rate": ("N m/s", 1e-12), "stall_torque": ("N m", 1e-12),
    "no_load_speed": ("rad/s", 1e-12)}


def with_rate_limit(law: ct.NonlinearIOSystem, rate: ArrayLike) -> ct.NonlinearIOSystem:
    """Law whose command changes by no more than ``rate T`` per sample.

    Inputs: q_d, q [rad], pe [N m].  Outputs: u [N m].

    Parameters
    ----------
    law : control.NonlinearIOSystem
        With these ports, as `sampled_pid` has them.
    rate : array_like, shape (n,)
        Fastest change [N m/s]; a parameter of the block, ``command_rate``.

    Returns
    -------
    control.NonlinearIOSystem
        The block, with the rate and the name of the law.

    Raises
    ------
    DiagramError
        If the law has other ports, or a rate is not positive.

    """
    step = float(law.dt)

    def behind(memory: Sequence[np.ndarray], u: np.ndarray, q: np.ndarray,
               params: Params) -> tuple[np.ndarray, list[np.ndarray]]:
        most = step * params["command_rate"]
        sent = memory[0] + np.clip(u - memory[0], -most, most)
        return sent, [sent]

    return with_command(law, behind, ("sent",), numbers(law, BOUNDS, command_rate=rate))


def with_torque_speed(law: ct.NonlinearIOSystem, stall: ArrayLike, no_load: ArrayLike,
                      velocity_filter: VelocityFilter | None = None) -> ct.NonlinearIOSystem:
    """Law within the torque-speed line of a motor: ``stall (1 - |v|/no_load)`` where it drives.

    Inputs: q_d, q [rad], pe [N m].  Outputs: u [N m].

    Parameters
    ----------
    law : control.NonlinearIOSystem
        With these ports, as `sampled_pid` has them.
    stall, no_load : array_like, shape (n,)
        Torque at rest [N m] and speed without torque [rad/s]; parameters of the block.
    velocity_filter : VelocityFilter, optional
        From q to v; by default the difference of samples.

    Returns
    -------
    control.NonlinearIOSystem
        The block, with the rate and the name of the law.

    Raises
    ------
    DiagramError
        If the law has other ports, or a number is not positive.

    """
    speed = velocity_filter or VelocityFilter(float(law.dt))

    def behind(memory: Sequence[np.ndarray], u: np.ndarray, q: np.ndarray,
               params: Params) -> tuple[np.ndarray, list[np.ndarray]]:
        dq, after = speed(q, memory, params)
        stall, slope = params["stall_torque"], dq / params["no_load_speed"]
        forward = stall * np.clip(1.0 - slope, 0.0, 1.0)
        backward = stall * np.clip(1.0 + slope, 0.0, 1.0)
        return np.clip(u, -backward, forward), after

    return with_command(law, behind, ("speed_1", "speed_2"),
                        numbers(law, BOUNDS, stall_torque=stall, no_load_speed=no_load))
