"""The paper's estimators on a log: CLIE (27) and composite (40), passed over it until settled.

One rate of adaptation serves all logs.  Where the model is complete it hardly matters: on healthy
simulated robots the inertia moves by 3e-4 between 0.02 and 0.8 1/s.  Where a term is missing,
the estimates chase the missing torque within each pass, and this biases their mean in proportion
to the rate.  On EMPS (no Coulomb friction in the model, published mass 95.109 kg, closed-loop
least squares 95.04 +- 0.97 kg):

    rate [1/s]    0.02    0.05    0.1     0.2     0.4     0.8
    mass [kg]     95.08   95.02   94.96   94.85   94.57   94.04
    passes        45      22      13      8       5       4

At 0.1 1/s the bias is a seventh of the 95 % interval, at a third of the passes of 0.02 1/s; the
log with pulses and the simulated robots show the same.  A pass begins with the last estimates of
the one before; passes end when their mean no longer changes, not after a fixed count.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from clie_blocks.analysis.identification.columns import BASE
from clie_blocks.analysis.identification.log_loop import LogLoop
from clie_blocks.analysis.identification.motion import Run
from clie_blocks.analysis.identification.regression import Estimate
from clie_blocks.analysis.identification.signals_of_log import command, excitation
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.uncertainty import block_covariance, quantile95
from clie_blocks.errors import DivergedError
from clie_blocks.signals import signal

RATE = 0.1  # 1/s, of convergence: see above
SHARE = 1e-3  # of the composite law's convergence that its gradient part does, as in CASE 3
MOST_PASSES = 60
SETTLED = 1e-4  # largest relative change of the means from pass to pass
DRIFTING = 0.05  # change up to which estimates that still move are worth showing
STEP = 1e-3  # relative, of the finite differences for the interval


@dataclasses.dataclass(frozen=True, eq=False)
class LastPass:
    """The last pass over all runs, one after the other.

    Parameters
    ----------
    theta_hat : ndarray, shape (3n, N)
        Estimates.
    e_u : ndarray, shape (n, N)
        Input error (26) [unit of u].
    passes : int
        Passes until then.
    change : float
        Largest relative change of a mean estimate from the pass before.

    """

    theta_hat: np.ndarray
    e_u: np.ndarray
    passes: int
    change: float

    @property
    def theta(self) -> np.ndarray:
        """Mean estimates ``[a, b, d]``, shape (3n,)."""
        return np.mean(self.theta_hat, axis=1)

    @property
    def settled(self) -> bool:
        """Whether the means have stopped changing."""
        return self.change <= SETTLED


def clie(runs: Sequence[Run], loads: Sequence[np.ndarray]) -> tuple[list[Estimate], LastPass]:
    """CLIE with the update law (27): an estimate per joint, and the last pass.

    The interval is that of the estimates at which the mean update is zero.

    Parameters
    ----------
    runs : sequence of Run
        Experiments, passed over in turn.
    loads : sequence of ndarray, shape (N, n)
        Torque that the model contains in addition to the paper's three terms; it is taken from the
        command and from the excitation alike, so that the input error stays what it is.

    Raises
    ------
    DivergedError
        If the estimates diverge or do not settle.

    """
    loops = [LogLoop.of(record, RATE) for record in _without_loads(runs, loads)]
    last = _pass_until_settled(loops)
    widths = _half_widths(loops, last.theta) if last.settled else None
    return _estimates("CLIE (27)", loops, last, widths), last


def composite(runs: Sequence[Run], loads: Sequence[np.ndarray],
              ) -> tuple[list[Estimate], LastPass]:
    """CLIE with the composite update law (40); arguments and result as `clie`.

    Its second term compares filtered signals: u passes G2 but q passes G1 and G2, so the delay of
    G1 biases it, the more the larger its gain alpha.  It has no interval.
    """
    loops = [LogLoop.of(record, RATE, SHARE) for record in _without_loads(runs, loads)]
    last = _pass_until_settled(loops)
    return _estimates("composite (40)", loops, last, None), last


def _without_loads(runs: Sequence[Run], loads: Sequence[np.ndarray]) -> list[Record]:
    return [run.record.replace(u=command(run.record) - load, pe=excitation(run.record) - load)
            for run, load in zip(runs, loads, strict=True)]


def _estimates(method: str, loops: list[LogLoop], last: LastPass,
               widths: np.ndarray | None) -> list[Estimate]:
    n, kp, kd = loops[0].record.n, loops[0].kp, loops[0].kd
    a, b, d = last.theta.reshape(3, n)
    values = np.array([1 / b, a / b, d / b])
    widths = np.full((3, n), np.nan) if widths is None else widths
    k_bar = kd / kp * (a + b * kd) - 1
    passes = f"{last.passes} passes" + (
        "" if last.settled else f", still changing by {last.change:.1%} in each")
    outside = [f"; K-bar {value:.2f} < 0, outside Theorems 1 to 4" if value <= 0 else ""
               for value in k_bar]
    return [Estimate(method, BASE, values[:, k], widths[:, k], passes + outside[k])
            for k in range(n)]


def _pass_until_settled(loops: list[LogLoop]) -> LastPass:
    """Pass over all logs in turn until the means of the estimates no longer change."""
    n = loops[0].record.n
    theta, means = np.zeros(3 * n), np.zeros(3 * n)
    for passes in range(1, MOST_PASSES + 1):
        last = _one_pass(loops, theta, means, passes)
        theta, means = last.theta_hat[:, -1], last.theta
        physical = bool(np.all(means[n:2 * n] > 0))
        if last.settled and physical:
            return last
    if not (last.change < DRIFTING and physical):
        raise DivergedError(f"{loops[0].record.source}: the estimates do not settle in "
                            f"{MOST_PASSES} passes; the motion excites too little, or K-bar is "
                            "too far from positive ('clie check' shows both)")
    return last


def _one_pass(loops: list[LogLoop], theta: np.ndarray, before: np.ndarray,
              number: int) -> LastPass:
    """One pass from the estimates `theta`, compared with the means of the pass before."""
    estimates, errors = [], []
    for loop in loops:
        run = loop.run(theta)
        estimates.append(signal(run, "theta_hat"))
        errors.append(signal(run, "e_u"))
        theta = estimates[-1][:, -1]
    history = np.concatenate(estimates, axis=1)
    means = np.mean(history, axis=1)
    size = np.maximum(np.abs(means), np.std(history, axis=1))  # an offset may well be zero
    change = float(np.max(np.abs(means - before) / size))
    return LastPass(history, np.concatenate(errors, axis=1), number, change)


def _half_widths(loops: list[LogLoop], theta: np.ndarray) -> np.ndarray:
    """95 % half widths of J, F and c, (3, n): the sandwich of ``mean Phi e_u = 0``."""
    slopes = []
    for i, value in enumerate(theta):
        step = STEP * max(abs(value), STEP * np.abs(theta).max())
        ahead, behind = (_scores(loops, theta + shift * np.eye(len(theta))[i])
                         for shift in (step, -step))
        slopes.append((ahead.sum(axis=0) - behind.sum(axis=0)) / (2 * step))
    inverse = np.linalg.inv(np.array(slopes).T)
    middle, freedom = block_covariance(_scores(loops, theta))
    physical = _physical_slopes(theta)
    covariance = physical @ inverse @ middle @ inverse.T @ physical.T
    return quantile95(freedom) * np.sqrt(np.diag(covariance)).reshape(3, -1)


def _physical_slopes(theta: np.ndarray) -> np.ndarray:
    """Derivatives of J = 1/b, F = a/b, c = d/b by ``theta = [a, b, d]``, shape (3n, 3n)."""
    a, b, d = theta.reshape(3, -1)
    zero, eye = np.zeros((len(b), len(b))), np.eye(len(b))
    return np.block([[zero, np.diag(-1 / b**2), zero],
                     [eye / b, np.diag(-a / b**2), zero],
                     [zero, np.diag(-d / b**2), eye / b]])


def _scores(loops: list[LogLoop], theta: np.ndarray) -> np.ndarray:
    return np.vstack([loop.scores(theta) for loop in loops])
