"""Checks of the motion: which parameters it shows, what it hides, and what would show that."""

import dataclasses
import functools
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.records.checks.completeness import dead_joints
from clie_blocks.analysis.records.checks.finding import Finding
from clie_blocks.analysis.records.checks.measures import (
    centres,
    half_width,
    smooth_motion,
    triangular_mean,
)
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.repeatability import roughness
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.uncertainty import least_squares

NAMES = ("inertia", "viscous friction", "offset")
OWN_SHARE = 0.02  # of a column's energy that the others must not explain
ABOVE_NOISE = 3.0
WINDOWS = (0.05, 0.2, 0.5)  # s; slow motions show their acceleration only in long windows
WIDE = 0.5  # rad; over less the weight of a link looks like a spring
UNCERTAIN = 0.5  # half width of an interval over its estimate
CLEAR = 0.2  # the same, of an inertia that is compared with a stated one
REMEDIES = {
    frozenset({"inertia", "viscous friction"}): "move at two or more speeds: a multisine from 0.1 "
    "Hz to half the loop's bandwidth",
    frozenset({"viscous friction", "offset"}): "move in both directions: a triangle or a sine "
    "about the set-point",
    frozenset({"inertia", "offset"}): "accelerate and brake in both directions: a sine or "
    "multisine",
    frozenset({"inertia"}): "accelerate more: a multisine or chirp up to half the loop's "
    "bandwidth",
    frozenset({"viscous friction"}): "move faster over a longer path: a slow sine of large "
    "amplitude",
}
ANY_REMEDY = "a multisine from 0.1 Hz to half the loop's bandwidth on every joint, 20 s or longer"


@dataclasses.dataclass(frozen=True, eq=False)
class Motion:
    """What one joint did.

    Parameters
    ----------
    sweep, top_speed : float
        Range of the position [unit of q], largest smoothed speed [per s].
    reversals : int
        Changes of direction of the smoothed velocity, rest left out.
    slow_share : float
        Share of the moving time below a tenth of the top speed.
    frequency : float
        Mean frequency of the motion [Hz].
    noise : float
        Noise of one sample of q by its roughness.
    hidden : tuple of str
        Parameters of `NAMES` that the motion does not show on their own.
    reason : str
        Why not; empty when it shows all.

    """

    sweep: float
    top_speed: float
    reversals: int
    slow_share: float
    frequency: float
    noise: float
    hidden: tuple[str, ...]
    reason: str


@functools.lru_cache(maxsize=2)  # a record does not change, and the report needs it again
def motions(record: Record, robot: Robot | None) -> list[Motion]:
    """What each joint did, and which of inertia, viscous friction and offset that shows."""
    views = [view for window in WINDOWS if (view := _view(record, window)).at.size >= 100]
    if not views:
        return [Motion(0.0, 0.0, 0, 0.0, 0.0, np.nan, NAMES, "the log is too short")] * record.n
    noise, dead = roughness(record)[0], dead_joints(record, robot)
    return [_motion(record, k, views, noise[k], k in dead) for k in range(record.n)]


def check_excitation(record: Record, robot: Robot | None) -> list[Finding]:
    """Findings on motions that hide a parameter."""
    shown = motions(record, robot)
    dead = dead_joints(record, robot)
    weak = [k for k in range(record.n) if shown[k].reason and k not in dead]
    none_left = len(weak) + len(dead) == record.n
    return [_finding(record.joints[k], shown[k], "error" if none_left else "warning")
            for k in weak] + ([_nothing_moves()] if len(dead) == record.n else [])


def remedy(hidden: Sequence[str]) -> str:
    """Motion that would show what is hidden."""
    return REMEDIES.get(frozenset(hidden), ANY_REMEDY)


@dataclasses.dataclass(frozen=True, eq=False)
class _View:
    """Motion and force averaged over windows of one width; span is the half width [s]."""

    at: np.ndarray
    span: float
    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray
    u: np.ndarray | None


def _view(record: Record, window: float) -> _View:
    width = half_width(record, window)
    at = centres(record, width)
    q, dq, ddq = smooth_motion(record, at, width)
    force = record.u if record.u is not None else record.tau
    return _View(at, width * record.sample_time, q, dq, ddq,
                 None if force is None else triangular_mean(force, at, width))


def _motion(record: Record, k: int, views: Sequence[_View], noise: float, dead: bool) -> Motion:
    q, dq, ddq = record.q[record.valid, k], views[0].dq[:, k], views[0].ddq[:, k]
    top = np.abs(dq).max()
    moving = np.abs(dq) > 0.02 * top
    heading = np.sign(dq[moving])
    frequency = np.sqrt(np.mean(ddq**2) / max(np.mean(dq**2), 1e-300)) / (2 * np.pi)
    hidden, reason = (NAMES, "it does not move") if dead else _least_hidden(views, k, noise)
    return Motion(float(np.ptp(q)), float(top), int(np.count_nonzero(np.diff(heading))),
                  float(np.mean(np.abs(dq[moving]) < 0.1 * top)) if moving.any() else 0.0,
                  float(frequency), float(noise), hidden, reason)


def _least_hidden(views: Sequence[_View], k: int, noise: float) -> tuple[tuple[str, ...], str]:
    """Answer of the first window that shows all, else of the widest, which has least noise."""
    for view in views:
        hidden, reason = _hidden(view, k, noise)
        if not hidden:
            break
    return hidden, reason


def _hidden(view: _View, k: int, noise: float) -> tuple[tuple[str, ...], str]:
    """Parameters that the joint's own columns hide in windows of one width, and why."""
    dq, ddq = view.dq[:, k], view.ddq[:, k]
    floors = {"inertia": np.sqrt(6) * noise / view.span**2,
              "viscous friction": 2 * noise / view.span}
    sizes = {"inertia": np.std(ddq), "viscous friction": np.std(dq)}
    drowned = tuple(name for name in sizes if sizes[name] < ABOVE_NOISE * floors[name])
    if drowned:
        return drowned, f"its {' and '.join(_seen_by(drowned))} is lost in the position's noise"
    columns = np.stack([ddq, dq, np.ones_like(dq)], axis=1)
    tied = _tied(columns)
    if tied:
        return tied, f"{' and '.join(tied)} have the same effect in this motion"
    if view.u is None:
        return (), ""
    inertia, interval = _inertia(view, view.u, k)
    loose = interval > UNCERTAIN * abs(inertia)
    return (("inertia",), "its share of the command is within the uncertainty") if loose else (
        (), "")


def _inertia(view: _View, command: np.ndarray, k: int, beside: Sequence[np.ndarray] = (),
             ) -> tuple[float, float]:
    """Command per acceleration of joint k, next to damping, offset, weight and dry friction.

    And next to further columns.  With its half width of 95 %, which is infinite where these do the
    same in this motion.
    """
    columns = np.stack([view.ddq[:, k], view.dq[:, k], np.ones_like(view.dq[:, k])], axis=1)
    columns = np.column_stack((columns, *_nuisance(view, k), *beside))
    try:
        fit = least_squares(columns, command[:, k])
    except np.linalg.LinAlgError:
        return 0.0, np.inf
    return float(fit.value[0]), float(fit.interval[0])


def shown_inertias(record: Record, robot: Robot | None) -> np.ndarray:
    """Inertia of each joint alone, by its command [unit of u s^2 / unit of q], shape (n,).

    NaN where the motion does not show it.  Noise makes it seem small, most of all in the shortest
    windows, so the largest counts.
    """
    noise, dead = roughness(record)[0], dead_joints(record, robot)
    found = np.full(record.n, np.nan)
    for view in (_view(record, window) for window in WINDOWS):
        for k in range(record.n):
            if view.at.size < 100 or view.u is None or k in dead or _hidden(view, k, noise[k])[0]:
                continue
            inertia, interval = _inertia(view, view.u, k, _of_other_joints(view, k))
            if interval < CLEAR * abs(inertia):
                found[k] = np.fmax(found[k], inertia)
    return found


def _of_other_joints(view: _View, k: int) -> list[np.ndarray]:
    """Push of the accelerations of other joints, and the weight of a link that they turn."""
    pushes = [view.ddq[:, j] for j in range(view.q.shape[1]) if j != k and np.ptp(view.q[:, j])]
    turned = view.q[:, :k + 1].sum(axis=1)
    return [*pushes, *([np.sin(turned), np.cos(turned)] if k and np.ptp(view.q[:, :k]) else [])]


def _nuisance(view: _View, k: int) -> list[np.ndarray]:
    """Gravity and dry friction, as far as the motion shows them, so that they bias nothing."""
    q, dq = view.q[:, k], view.dq[:, k]
    weight = [np.sin(q), np.cos(q)] if np.ptp(q) > WIDE else [q] if np.ptp(q) > 0 else []
    return [*weight, np.tanh(dq / (0.05 * np.abs(dq).max()))]


def _tied(columns: np.ndarray) -> tuple[str, ...]:
    """Names of the columns of the weakest direction, when one is explained by the others."""
    scaled = columns / np.linalg.norm(columns, axis=0)
    _, size, directions = np.linalg.svd(scaled, full_matrices=False)
    inverse = np.linalg.inv(scaled.T @ scaled) if size[-1] > 1e-9 else np.full((3, 3), np.inf)
    if 1 / np.diag(inverse).max() > OWN_SHARE:
        return ()
    return tuple(name for name, part in zip(NAMES, directions[-1], strict=True) if abs(part) > 0.3)


def _seen_by(names: Sequence[str]) -> list[str]:
    return [{"inertia": "acceleration", "viscous friction": "velocity"}[name] for name in names]


def _finding(joint: str, motion: Motion, severity: str) -> Finding:
    return Finding(severity, "excitation.weak", f"It does not show {' and '.join(motion.hidden)}: "
                   f"{motion.reason}.", "The estimate would be noise or a guess.",
                   f"To see it, {remedy(motion.hidden)}.", joint=joint)


def _nothing_moves() -> Finding:
    return Finding("error", "excitation.none", "No joint moves.", "Nothing can be learned.",
                   f"Use {ANY_REMEDY}.")
