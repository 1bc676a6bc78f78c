"""The sampled robot for a diagram: joints, drives and effects under a sampled law."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.effects.effect import Setting
from clie_blocks.labels import DiagramError
from clie_blocks.robot_loop.block import LoopBlock, Structure
from clie_blocks.robot_loop.dynamics import DELAY_TAPS
from clie_blocks.robot_loop.links import Links, no_links
from clie_blocks.robot_loop.pieces import delay_samples, pieces_of, with_delay_line
from clie_blocks.robot_loop.sampled_law import PARAMETERS, sampled_law
from clie_blocks.signals import vector

if TYPE_CHECKING:
    from control import InputOutputSystem, NonlinearIOSystem

UNLIMITED = 1e9  # N m: a limit that no command meets


def robot_loop(inertia: ArrayLike, damping: ArrayLike, kp: ArrayLike, kd: ArrayLike,
               period: float, *, load: ArrayLike = 0.0, start: ArrayLike = 0.0,
               saturation: ArrayLike = UNLIMITED, gear_ratio: ArrayLike = 1.0,
               velocity_filter: tuple[ArrayLike, ArrayLike] | None = None,
               links: Links | None = None, encoder_on_motor: bool = False,
               effects: Iterable[Setting] = (), law: InputOutputSystem | None = None,
               supplied: bool = False, name: str = "robot") -> NonlinearIOSystem:
    """Sampled loop ``inertia ddq + damping dq + load = kp (q_d - q) - kd v + pe`` with effects.

    One update is one period of the controller: measure, command, hold, move.  Dry friction acts as
    an impulse that can stop a joint but never reverse it, so that a stuck joint stays stuck.
    Inputs: q_d [rad], pe [N m], noise [rad] of the measured position.  Outputs: q [rad] as it is
    measured, u [N m], and sum, the sum of all q before.  All torques are on the motor side.

    Parameters
    ----------
    inertia, damping : array_like, shape (n,)
        Of each joint, motor side [kg m^2, N m s/rad].
    kp, kd : array_like, shape (n,)
        Gains of the law [N m/rad, N m s/rad].
    period : float
        Of the controller [s].
    load : array_like, shape (n,)
        Constant torque that opposes [N m].
    start : array_like, shape (n,)
        Position at which the law starts, at rest [rad].
    saturation : array_like, shape (n,)
        Largest command of the law [N m].
    gear_ratio : array_like, shape (n,)
        Motor turns per joint turn, of the links.
    velocity_filter : tuple of array_like, optional
        Coefficients ``b, a`` of the filter from position to velocity, three values each; by
        default the difference of two samples.  It also forms the velocity ``dq`` that a law of
        its own reads.
    links : Links, optional
        Links that weigh or push each other, see `planar_links`.
    encoder_on_motor : bool
        The encoder sits on the motor, before a soft or loose gear; by default behind it.
    effects : list of Setting
        Effects with their parameters.  A run may set a longer delay up to sixty samples; what it
        asks for beyond is zero.
    law : control.InputOutputSystem, optional
        Any law in the place of PD, in discrete time: inputs q_d[k], q[k] [rad] and, if it takes
        them, pe[k] [N m], dq[k] [rad/s] and tau[k] [N m], the torque that the drive gave in the
        sample before; outputs u[k] [N m].  It begins with zero states; `kp` and `kd` are then of
        no account.  A law that reads dq or tau gives the block the inputs noise_dq and noise_tau,
        behind noise: what the drive's sensors add to them.
    supplied : bool
        The voltage of the drives over its nominal value is a fourth input, ``supply`` [1], by
        which their torque grows, and its limit with it: motors without current control.
    name : str
        Name of the block.

    Returns
    -------
    control.NonlinearIOSystem
        A block in discrete time; parameters are those of above, and ``'<effect>.<parameter>'``.

    Raises
    ------
    DiagramError
        If a number is out of range, an effect has no form for the sampled robot, two effects
        have the same name, or the law has other ports or another rate.

    """
    if not period > 0:
        raise DiagramError(f"{name}: the period must be positive, got {period} s")
    own = vector(inertia, f"{name}: inertia", unit="kg m^2")
    n = own.size
    carried = links if links is not None else no_links(n)
    chosen = _by_name(effects, name)
    values = {"inertia": own, "start": vector(start, f"{name}: start", n=n, unit="rad"),
              "first": np.zeros(n)}
    for key, value, unit in (("damping", damping, "N m s/rad"), ("load", load, "N m"),
                             ("kp", kp, "N m/rad"), ("kd", kd, "N m s/rad"),
                             ("saturation", saturation, "N m"), ("ratio", gear_ratio, "1")):
        values[key] = vector(value, f"{name}: {key}", n=n, unit=unit)
    b, a = velocity_filter or ((1.0 / period, -1.0 / period, 0.0), (1.0, 0.0, 0.0))
    values["b"], values["a"] = (np.outer(np.asarray(c, float), np.ones(n)) for c in (b, a))
    values |= {f"links.{key}": np.asarray(getattr(carried, key), float)
               for key in carried.parameters}
    values |= {f"{label}.{key}": value * np.ones(n) for label, setting in chosen.items()
               for key, value in setting.vectors(n).items()}
    sampled = None if law is None else sampled_law(law, period)
    if sampled is not None:
        if sampled.n != n:
            raise DiagramError(f"{name}: the law {sampled.name!r} commands {sampled.n} joints, "
                               f"the robot has {n}")
        if sampled.values:
            values[PARAMETERS] = np.array(sampled.values)
    shape = Structure(n, period, carried.layout,
                      bool(np.any(values["saturation"] < UNLIMITED)), encoder_on_motor,
                      law=sampled, supplied=supplied)
    pieces = [(label, with_delay_line(piece, max(DELAY_TAPS, delay_samples(
                  piece, setting.vectors(n), period))))
              for label, setting in chosen.items()
              for piece in pieces_of(setting.effect, [p.name for p in setting.effect.parameters])]
    names = {label: tuple(p.name for p in setting.effect.parameters)
             for label, setting in chosen.items()}
    return LoopBlock(shape, pieces, names).block(values, name)


def _by_name(effects: Iterable[Setting], owner: str) -> dict[str, Setting]:
    """Settings by the name of their blocks, which must differ."""
    listed: Sequence[Setting] = list(effects)
    names = [setting.name for setting in listed]
    twice = next((label for label in names if names.count(label) > 1), None)
    if twice is not None:
        raise DiagramError(f"{owner}: two effects are called {twice!r}; give one of them another "
                           "name, with name=")
    return dict(zip(names, listed))
