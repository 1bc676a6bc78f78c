"""The control law, replayed on the measured position, to see whether the stated law ran.

The residual ``r_c = u_log - law(q_log, q_d, pe)`` needs no model of the robot.  At the level of
the log's rounding it proves that the law is understood; anything larger is a fault of the stated
law or of the log, and must not be blamed on the robot.
"""

import dataclasses
import itertools

import numpy as np

from clie_blocks.analysis.records.control_law import ControlLaw, control_law, stated_variant
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.law_residual import law_residual
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.runs import runs
from clie_blocks.analysis.records.velocity_filter import (
    discretisations,
    response_from_rest,
    velocity_filter,
)
from clie_blocks.errors import ClieError, NotIdentifiableError, nearest

LOST_ROW = 1.5  # periods; a longer step of a log that is in step has lost the rows between
UNEVEN = 0.02  # spread of the log's step from which on the controller's clock is another one


@dataclasses.dataclass(frozen=True, eq=False)
class Replay:
    """The command that the stated law gives on the measured position.

    Parameters
    ----------
    law : ControlLaw
        The law that was replayed.
    u : ndarray, shape (N, n)
        Command of the law [unit of u]; NaN where the record is not valid.
    residual : ndarray, shape (N, n)
        ``r_c``, logged minus replayed command [unit of u].
    rms : ndarray, shape (n,)
        Root mean square of the residual over `used` [unit of u].
    used : ndarray of bool, shape (N,)
        Samples that count: valid, drive enabled, filter no longer knowing how its run began.

    """

    law: ControlLaw
    u: np.ndarray
    residual: np.ndarray
    rms: np.ndarray
    used: np.ndarray

    @property
    def variant(self) -> str:
        """How the velocity was formed: a name of `variants`."""
        return self.law.variant

    @property
    def lsb(self) -> np.ndarray:
        """RMS in steps of the command: 0.29 is rounding alone; NaN where no step is stated."""
        step = self.law.resolution
        return self.rms / np.where(step > 0, step, np.nan)


def replay(record: Record, controller: Controller, variant: str | None = None) -> Replay:
    """Replay the stated control law, eq. (11) or a relative, on the measured position.

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
        Command and residual.

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
    known = variants(record, controller)
    if variant is not None and variant not in known:
        raise ClieError(f"no variant {variant!r} of this control law; {nearest(variant, known)}")
    names = known if variant is None else (variant,)
    tried = {name: one for name in names
             if (one := _replay(record, controller, name)).used.any()}
    if not tried:
        raise NotIdentifiableError(f"{record.source or 'the record'} has no run of valid samples "
                                   "long enough for the velocity filter to settle")
    return tried[variant or _best(tried, stated_variant(controller))]


def variants(record: Record, controller: Controller) -> tuple[str, ...]:
    """Names of the ways in which this controller may have formed its velocity.

    Those of `velocity_filter`, and ``exact``, the logged velocity.
    """
    if controller.law == "servo" and controller.kd is None:
        return ("none",)
    cornered: tuple[str, ...] = ()
    if controller.corners is not None:
        cornered = discretisations(sample_time(record, controller), controller.corners)
    return (*cornered, "two_tap", "difference", *(("exact",) if record.dq is not None else ()))


def sample_time(record: Record, controller: Controller) -> float:
    """Period of the controller [s]: the stated one where the log has that rate, else the log's."""
    stated, logged = controller.sample_time, record.sample_time
    return stated if stated is not None and abs(stated - logged) < 0.1 * stated else logged


def is_in_step(record: Record, controller: Controller) -> bool:
    """Whether the log has a row for every cycle of the controller, as far as its clock shows."""
    steps, period = np.diff(record.time), sample_time(record, controller)
    steps = steps[(steps > 0) & (steps < LOST_ROW * period)]
    same_rate = controller.sample_time in (None, period)
    return bool(same_rate and steps.size and np.std(steps) < UNEVEN * period)


def velocity(record: Record, controller: Controller, variant: str,
             joint: int | None = None) -> np.ndarray:
    """Velocity as the controller forms it from the measured position, eq. (47).

    Parameters
    ----------
    record : Record
        The log.
    controller : Controller
        Its corners; needed for the variants that discretise G1.
    variant : str
        One of `variants`.
    joint : int, optional
        The one joint that is asked for; by default all.

    Returns
    -------
    ndarray, shape (N, n), or (N, 1) of one joint
        Velocity [unit of q per second]; NaN outside the runs of valid samples.

    """
    chosen = slice(None) if joint is None else slice(joint, joint + 1)
    if variant == "exact" and record.dq is not None:
        return record.dq[:, chosen]
    b, a = velocity_filter(variant, sample_time(record, controller), controller.corners)
    q = record.q[:, chosen]
    out = np.full(q.shape, np.nan)
    for start, stop in _cycles(record, controller):
        out[start:stop] = response_from_rest(b, a, q[start:stop] - q[start])
    return out


def settled_samples(record: Record, controller: Controller, wait: int) -> np.ndarray:
    """Mask of the samples at least `wait` samples after the start of their run."""
    used = np.zeros(len(record), bool)
    for start, stop in _cycles(record, controller):
        used[start + wait:stop] = True
    return used


def _cycles(record: Record, controller: Controller) -> list[tuple[int, int]]:
    """Runs of a record, cut where the row of a cycle of the controller was lost."""
    whole = runs(record, least=1)
    steps, period = np.diff(record.time), sample_time(record, controller)
    lost = np.flatnonzero(steps > LOST_ROW * period) + 1
    if not lost.size or not is_in_step(record, controller):
        return whole
    return [(int(a), int(b)) for start, stop in whole
            for a, b in itertools.pairwise((start, *lost[(lost > start) & (lost < stop)], stop))]


def _replay(record: Record, controller: Controller, variant: str) -> Replay:
    u, qd = _logged(record, controller)
    law = control_law(controller, sample_time(record, controller), variant)
    pe = 0.0 if record.pe is None else record.pe
    residual = law_residual(law, u, qd - record.q, velocity(record, controller, variant), pe)
    used = settled_samples(record, controller, law.settling) & np.isfinite(residual).all(axis=1)
    if "torque_enable" in record.extra:
        used &= np.atleast_2d(record.extra["torque_enable"].T).all(axis=0)
    rms = (np.sqrt(np.mean(residual[used] ** 2, axis=0)) if used.any()
           else np.full(record.n, np.nan))
    return Replay(law, u - residual, residual, rms, used)


def _logged(record: Record, controller: Controller) -> tuple[np.ndarray, np.ndarray]:
    """Command and reference, of which a replay needs both."""
    where = record.source or "the record"
    if controller.law == "unknown":
        raise NotIdentifiableError(f"{where}: the control law is not stated, so it cannot be "
                                   "replayed; give [controller] law and gains in robot.toml")
    if record.u is None or record.qd is None:
        missing = "command u" if record.u is None else "reference position qd"
        raise NotIdentifiableError(f"{where} has no {missing}, so the control law cannot be "
                                   f"replayed; log {missing.split()[-1]} too")
    return record.u, record.qd


def _best(tried: dict[str, Replay], stated: str | None) -> str:
    """Variant of the smallest residual; joints count alike, and the stated one wins a tie."""
    tiny = np.finfo(float).tiny
    size = {name: float(np.mean(np.log(result.rms + tiny))) for name, result in tried.items()}
    best = min(size, key=lambda name: size[name])
    return stated if stated in size and size[stated] < size[best] + 0.01 else best
