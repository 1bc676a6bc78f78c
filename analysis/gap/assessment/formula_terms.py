"""Terms that a formula for a nameless torque is chosen from, and what each would do to a log.

They are products of simple factors of place, speed, load and direction, all of one effect,
`TORQUE_TERM`, so that a chosen term is inserted, drawn and exported like any effect.
"""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis
from clie_blocks.analysis.gap.method.assessment import AssessmentMethod
from clie_blocks.analysis.gap.residual.noise import rows_of
from clie_blocks.analysis.theory.sampled_loop import decimated_filter
from clie_blocks.effects.torque_term import TORQUE_TERM
from clie_blocks.linear_filters import lfilter, low_pass

Shape = dict[str, float]
"""Parameters of `TORQUE_TERM` but for its amplitudes."""
WAVE, RAMP = ("cosine", "sine"), ("slope",)
_FADES = (0.02, 0.06, 0.2, 0.5)  # of the top speed, above which a Stribeck term is gone
_EDGES = np.linspace(0.05, 0.95, 10)  # of the travel, where a stop or a slack spring may begin
_TURNS = (1, 2, 4)  # waves per motor turn: eccentric parts, and poles


@dataclasses.dataclass(frozen=True)
class Term:
    """One term at one joint.

    Parameters
    ----------
    joint : int
        Index.
    shape : dict
        Its parameters but for the amplitudes.
    amplitudes : dict
        `cosine` and `sine`, or `slope`, in N m or N m/rad of the motor side.

    """

    joint: int
    shape: Mapping[str, float]
    amplitudes: Mapping[str, float]


@dataclasses.dataclass(frozen=True, eq=False)
class Motion:
    """Motion of one joint in one log at the rate of the diagnosis, arrays (N,): q, dq, u."""

    q: np.ndarray
    dq: np.ndarray
    u: np.ndarray


@dataclasses.dataclass(frozen=True, eq=False)
class Candidates:
    """Shapes that are tried at a joint, those of each kind together.

    Parameters
    ----------
    shapes : list of dict
        One per group of columns.
    groups : list of tuple of int
        Columns of each: cosine and sine of a wave, or one.
    columns : dict
        Parameter of `TORQUE_TERM` -> array (columns,), the amplitudes too.

    """

    shapes: list[Shape]
    groups: list[tuple[int, ...]]
    columns: dict[str, np.ndarray]

    def torques(self, motion: Motion) -> np.ndarray:
        """Torque of each column at its unit amplitude, shape (N, columns) [N m]."""
        signals = (x[:, None] for x in (motion.q, motion.dq, motion.u))
        return TORQUE_TERM.build.kernel(*signals, **self.columns)

    def term(self, joint: int, group: int, theta: np.ndarray) -> Term:
        """Term of a group with its coefficients."""
        names = [next(name for name in (*WAVE, *RAMP) if self.columns[name][i])
                 for i in self.groups[group]]
        return Term(joint, self.shapes[group], dict(zip(names, map(float, theta))))


def motions_of(hypothesis: Hypothesis, j: int, method: AssessmentMethod) -> list[Motion]:
    """Motion of every joint in log j: simulated, and by what was measured where that is slow."""
    problem = hypothesis.problem
    log, rows = problem.logs[j], rows_of(problem.logs[j], problem.period)
    step = rows.ticks * problem.period
    run = hypothesis.simulator.run(log, hypothesis.of_log(j), dithered=False)
    q, u = map(rows.of_samples, run)
    q = q + low_pass(rows.of_samples(log.q) - q, 2, method.formula_corner, 1.0 / step)
    u = u + low_pass(rows.of_samples(log.u) - u, 2, method.formula_corner, 1.0 / step)
    dq = np.gradient(q, step, axis=0)
    return [Motion(*(x[:, k] for x in (q, dq, u))) for k in range(problem.n)]


def candidates(motions: Sequence[Motion], gear_ratio: float, method: AssessmentMethod,
               ) -> Candidates:
    """Return the shapes that are tried for the motions of one joint in all its logs."""
    q, dq, u = (np.concatenate([getattr(one, name) for one in motions])
                for name in ("q", "dq", "u"))
    scale = {"speed": float(np.quantile(np.abs(dq), 0.98)) + 1e-12,
             "torque": float(np.sqrt(np.mean(u**2))) + 1e-12}
    scale["reversal"] = method.map_reversal_speed * scale["speed"]
    scale["width"] = min(scale["reversal"], 1.0)
    found = [(names, {**scale, **shape}) for names, shape in
             (*_everywhere(scale["speed"]), *_waves(q, dq, gear_ratio, method), *_ramps(q))]
    shapes: list[Shape] = []
    groups: list[tuple[int, ...]] = []
    rows: list[Shape] = []
    for names, shape in found:
        groups.append(tuple(range(len(rows), len(rows) + len(names))))
        shapes.append(shape)
        rows += [{**shape, name: 1.0} for name in names]
    columns = {p.name: np.array([row.get(p.name, p.default) for row in rows])
               for p in TORQUE_TERM.parameters}
    return Candidates(shapes, groups, columns)


_Found = Iterator[tuple[tuple[str, ...], Shape]]


def _everywhere(top: float) -> _Found:
    """Friction that is the same at any place: Coulomb, of the load, Stribeck, of the speed."""
    one = ("cosine",)
    for load in (0.0, 1.0):
        yield one, {"dry": 1.0, "load": load}
        yield one, {"dry": 1.0, "load": load, "driving": 1.0}
        yield from ((one, {"dry": 1.0, "load": load, "slowness": 1.0 / (share * top)})
                    for share in _FADES)
    yield one, {"odd": 1.0, "linear": 1.0, "load": 1.0}
    yield one, {"odd": 1.0, "square": 1.0}
    yield one, {"linear": 1.0}
    yield one, {"square": 1.0}
    yield one, {"load": 1.0}


def _waves(q: np.ndarray, dq: np.ndarray, gear_ratio: float, method: AssessmentMethod) -> _Found:
    """Waves over the place: of a torque, of dry and of viscous friction, and of the load."""
    turn = 2 * np.pi / (np.ptp(q) + 1e-9)
    slow = turn * np.arange(0.5, method.formula_waves, 0.25)
    fastest = 2 * np.pi * method.formula_highest / (np.sqrt(np.mean(dq**2)) + 1e-12)
    orders = [*slow[slow < fastest], *(n * gear_ratio for n in _TURNS
                                       if slow[-1] < n * gear_ratio < fastest)]
    for order in orders:
        for shape in ({}, {"odd": 1.0}, {"odd": 1.0, "linear": 1.0}):
            yield WAVE, {**shape, "order": float(order)}
        if order < 2.0 * turn:
            yield WAVE, {"load": 1.0, "order": float(order)}
            yield WAVE, {"load": 1.0, "odd": 1.0, "order": float(order)}


def _ramps(q: np.ndarray) -> _Found:
    """Torques that begin at an edge: stops, slack cables, walls."""
    low, travel = q.min(), np.ptp(q)
    yield RAMP, {"edge": float(low), "side": 1.0}
    for share in _EDGES:
        for side in (1.0, -1.0):
            yield RAMP, {"edge": float(low + share * travel), "side": side}


def base_responses(hypothesis: Hypothesis, j: int, k: int) -> np.ndarray:
    """What a small change of each free parameter does to joint k in log j, (rows, parameters)."""
    moved = [hypothesis.moved([(one, hypothesis.get(one) + one.size)])
             for one in hypothesis.free_parameters
             if one.joint in (k, None) and one.log in (hypothesis.problem.runs[j], None)]
    still, *runs = hypothesis.means(j, [hypothesis.values, *moved])
    return np.stack([run[k] - still[k] for run in runs], axis=1)


def responses(hypothesis: Hypothesis, torques: np.ndarray, j: int, k: int) -> np.ndarray:
    """What opposing torques (N, columns) at joint k do to its position in log j, first order."""
    problem, values = hypothesis.problem, hypothesis.values
    rows = rows_of(problem.logs[j], problem.period)
    sensitivity = problem.law.torque_sensitivity(k, values["inertia"][k], values["damping"][k])
    return -lfilter(*decimated_filter(*sensitivity, rows.ticks, rows.stride), torques)


def written(parameters: Mapping[str, float]) -> str:
    """Return the torque of a term in symbols, without the factors that are one."""
    p = parameters
    place = " + ".join(filter(None, (
        _times(p["cosine"], f"cos({p['order']:.4g} q)" if p["order"] else ""),
        _times(p["sine"], f"sin({p['order']:.4g} q)"),
        _times(p["slope"], f"min(q - {p['edge']:.4g}, 0)" if p["side"] < 0 else
               f"max(q - {p['edge']:.4g}, 0)")))) or "0"
    place = place.replace("+ -", "- ")
    factors = [f"({place})" if " " in place else place]
    speed = "|dq|" if not p["odd"] and not p["dry"] else "dq"
    if p["linear"]:
        factors.append(f"{speed}/{p['speed']:.4g}")
    if p["square"]:
        factors.append(f"(dq/{p['speed']:.4g})^2")
    if p["slowness"]:
        factors.append(f"exp(-({p['slowness']:.4g} dq)^2)")
    if p["load"]:
        factors.append(f"|u|/{p['torque']:.4g}")
    if (p["dry"] or p["odd"]) and not p["linear"]:
        factors.append("sign(dq)")
    return " ".join(factors) + (" while u drives" if p["driving"] else "")


def _times(amplitude: float, wave: str) -> str:
    return f"{amplitude:.4g} {wave}".strip() if amplitude else ""
