"""The control law, replayed on the measured position, to see whether the stated law ran.

The residual ``r_c = u_log - law(q_log, q_d, pe)`` needs no model of the robot.  At the level of
the log's rounding it proves that the law is understood; anything larger is a fault of the stated
law or of the log, and must not be blamed on the robot.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.records.control_law import control_law, stated_variant
from clie_blocks.analysis.records.runs import runs
from clie_blocks.analysis.records.velocity_filter import (
    discretisations,
    settling,
    velocity_filter,
)
from clie_blocks.errors import ClieError, NotIdentifiableError, nearest


@dataclasses.dataclass(frozen=True, eq=False)
class Replay:
    """The command that the stated law gives on the measured position.

    Parameters
    ----------
    u : ndarray, shape (N, n)
        Command of the law [unit of u]; NaN where the record is not valid.
    residual : ndarray, shape (N, n)
        ``r_c``, logged minus replayed command [unit of u].
    variant : str
        How the velocity was formed: a name of `variants`.
    rms : ndarray, shape (n,)
        Root mean square of the residual over `used` [unit of u].
    lsb : ndarray, shape (n,)
        `rms` in steps of the command's resolution: 0.29 is rounding alone; NaN when not stated.
    used : ndarray of bool, shape (N,)
        Samples that count: valid, drive enabled, filter no longer knowing how its run began.
    tried : dict
        `rms` by variant, of all that were tried.

    """

    u: np.ndarray
    residual: np.ndarray
    variant: str
    rms: np.ndarray
    lsb: np.ndarray
    used: np.ndarray
    tried: dict


def replay(record, controller, variant=None):
    """Replay the stated control law, eq. (11) or its kin, on the measured position.

    Parameters
    ----------
    record : Record
        The log, with q, u and q_d.
    controller : Controller
        Law, gains and velocity filter; see its docstring for the laws.
    variant : str, optional
        One of `variants`; by default the one that leaves the smallest residual.

    Returns
    -------
    Replay
        Command, residual and the variants that were tried.

    Raises
    ------
    NotIdentifiableError
        If the law is unknown, or u or q_d is not logged.
    ClieError
        If the variant is not known for this controller and record.

    Notes
    -----
    The velocity filter starts each run of samples at rest at the first measured position.  A clock
    that jitters is taken at its median step: the controller's own clock is not in the log.  Where
    the log's channel ``torque_enable`` is zero the law does not act and nothing is compared.

    """
    _check_logged(record, controller)
    known = variants(record, controller)
    if variant is not None and variant not in known:
        raise ClieError(f"no variant {variant!r} of this control law; {nearest(variant, known)}")
    found = {name: _replay(record, controller, name)
             for name in (known if variant is None else (variant,))}
    best = variant or _best({name: found[name].rms for name in found}, stated_variant(controller))
    return dataclasses.replace(found[best],
                               tried={name: result.rms for name, result in found.items()})


def variants(record, controller):
    """Names of the ways in which this controller may have formed its velocity.

    Those of `velocity_filter`, and ``exact``, the logged velocity.
    """
    if controller.law == "servo" and controller.kd is None:
        return ("none",)
    cornered = ()
    if controller.highpass is not None and controller.lowpass is not None:
        cornered = discretisations(sample_time(record, controller), _corners(controller))
    return (*cornered, "two_tap", "difference", *(("exact",) if record.dq is not None else ()))


def sample_time(record, controller):
    """Period of the controller [s]: the stated one where the log has that rate, else the log's."""
    stated, logged = controller.sample_time, record.sample_time
    agrees = stated is not None and abs(stated - logged) < 0.1 * stated
    return stated if agrees else logged


def in_steps(size, controller):
    """Size in steps of the command's stated resolution, per joint; NaN where it is not stated."""
    step = controller.command_resolution
    return size * np.nan if step is None else size / np.where(step > 0, step, np.nan)


def velocity(record, controller, variant):
    """Velocity as the controller forms it from the measured position, eq. (47).

    Parameters
    ----------
    record : Record
        The log.
    controller : Controller
        Its corners; needed for the variants that discretise G1.
    variant : str
        One of `variants`.

    Returns
    -------
    ndarray, shape (N, n)
        Velocity [unit of q per second]; NaN outside the runs of valid samples.

    """
    if variant == "exact":
        return record.dq
    b, a = velocity_filter(variant, sample_time(record, controller), _corners(controller))
    out = np.full(record.q.shape, np.nan)
    for start, stop in runs(record, least=1):
        out[start:stop] = _filtered(b, a, record.q[start:stop] - record.q[start])
    return out


def settled(record, controller, variant):
    """Mask of the samples at which the velocity filter has forgotten the start of its run."""
    wait = settling(variant, sample_time(record, controller), _corners(controller))
    used = np.zeros(len(record), bool)
    for start, stop in runs(record, least=1):
        used[start + wait:stop] = True
    return used


def _filtered(b, a, x):
    """Response from rest, exact by a transform with zero padding: scipy would start slowly."""
    forget = 40 / -np.log(max(np.abs(np.roots(a)), default=1e-9) or 1e-9)
    size = 1 << int(np.ceil(np.log2(len(x) + forget)))
    delay = np.exp(-2j * np.pi * np.arange(size // 2 + 1) / size)
    response = np.polyval(b[::-1], delay) / np.polyval(a[::-1], delay)
    return np.fft.irfft(np.fft.rfft(x, size, axis=0) * response[:, None], size, axis=0)[:len(x)]


def _corners(controller):
    return controller.highpass, controller.lowpass


def _check_logged(record, controller):
    where = record.source or "the record"
    if controller.law == "unknown":
        raise NotIdentifiableError(f"{where}: the control law is not stated, so it cannot be "
                                   "replayed; give [controller] law and gains in robot.toml")
    for name, meaning in (("u", "command"), ("qd", "reference position")):
        if getattr(record, name) is None:
            raise NotIdentifiableError(f"{where} has no {meaning} {name}, so the control law "
                                       f"cannot be replayed; log {name} too")


def _replay(record, controller, variant):
    law = control_law(controller, sample_time(record, controller), variant)
    pe = 0.0 if record.pe is None else record.pe
    u = law.command(record.qd - record.q, velocity(record, controller, variant), pe)
    residual = record.u - u
    used = settled(record, controller, variant) & np.isfinite(residual).all(axis=1)
    if "torque_enable" in record.extra:
        used &= np.atleast_2d(record.extra["torque_enable"].T).all(axis=0)
    if not used.any():
        raise NotIdentifiableError(f"{record.source or 'the record'} has no run of valid samples "
                                   "long enough for the velocity filter to settle")
    rms = np.sqrt(np.mean(residual[used] ** 2, axis=0))
    return Replay(u, residual, variant, rms, in_steps(rms, controller), used, {})


def _best(tried, stated):
    """Variant of the smallest residual; joints count alike, and the stated one wins a tie."""
    tiny = np.finfo(float).tiny
    size = {name: np.mean(np.log(rms + tiny)) for name, rms in tried.items()}
    best = min(size, key=size.get)
    return stated if stated in size and size[stated] < size[best] + 0.01 else best
