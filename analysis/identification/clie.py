"""The paper's estimators on a record: CLIE (27) and composite (40), passed until settled."""

import numpy as np

from clie_blocks.analysis.identification.columns import BASE
from clie_blocks.analysis.identification.recorded_clie import (
    held_inputs,
    motion_regressors,
    pd_gains,
    resting_state,
    velocity_block,
)
from clie_blocks.analysis.identification.regression import Estimate
from clie_blocks.analysis.records.uncertainty import block_covariance, quantile95
from clie_blocks.compiled import compile_diagram
from clie_blocks.diagrams.recorded_composite import recorded_composite
from clie_blocks.diagrams.recorded_loop import recorded_loop
from clie_blocks.errors import DivergedError
from clie_blocks.identification import scaled_gain
from clie_blocks.signals import signal

RATE = 0.1  # 1/s, of convergence; slower means less ripple and more passes
SHARE = 1e-3  # of the composite law's convergence that its gradient part does, as in CASE 3
MOST_PASSES = 60
SETTLED = 1e-4  # largest relative change of the means from pass to pass
DRIFTING = 0.05  # change up to which estimates that still move are worth showing
STEP = 1e-3  # relative, of the finite differences for the interval


def clie(runs, loads):
    """CLIE with the update law (27).

    Parameters
    ----------
    runs : list of Run
        Experiments, passed over in turn.
    loads : list of ndarray, shape (N, n)
        Torque that the model shall know beside the paper's three terms; it is taken from the
        command and from the excitation alike, so the input error stays what it is.

    Returns
    -------
    list of Estimate
        One per joint; the interval is that of the estimates at which the mean update is zero.

    Raises
    ------
    DivergedError
        If the estimates leave every bound or do not settle.

    """
    return _identify("CLIE (27)", runs, loads, _gradient_loop, intervals=True)


def composite(runs, loads):
    """CLIE with the composite update law (40); arguments and result as `clie`.

    Its second term compares filtered signals: u passes G2 but q passes G1 and G2, so the delay of
    G1 biases it, the more the larger its gain alpha.  It has no interval.
    """
    return _identify("composite (40)", runs, loads, _composite_loop, intervals=False)


def _identify(method, runs, loads, build, intervals):
    records = [_known_apart(run.record, load) for run, load in zip(runs, loads, strict=True)]
    programs = [build(record) for record in records]
    theta, passes, change = _settled(records, programs)
    settled, n = change <= SETTLED, records[0].n
    widths = (_intervals(records, programs, theta) if intervals and settled else
              np.full((3, n), np.nan))
    a, b, d = theta.reshape(3, n)
    values = np.array([1 / b, a / b, d / b])
    kp, kd = pd_gains(records[0].robot.controller)
    k_bar = kd / kp * (a + b * kd) - 1
    said = f"{passes} passes" + ("" if settled else f", still changing by {change:.1%} in each")
    return [Estimate(method, BASE, values[:, k], widths[:, k], said + (
        "" if k_bar[k] > 0 else f"; K-bar {k_bar[k]:.2f} < 0, outside Theorems 1 to 4"))
        for k in range(n)]


def _known_apart(record, load):
    pe = np.zeros_like(record.u) if record.pe is None else record.pe
    return record.replace(u=record.u - load, pe=pe - load)


def _settled(records, programs):
    """Means of a pass that no longer change, the passes, and the last relative change."""
    n, theta = records[0].n, np.zeros(3 * records[0].n)
    means, change, passes = theta, np.inf, 0
    while passes < MOST_PASSES and not (change <= SETTLED and np.all(means[n:2 * n] > 0)):
        before, history, passes = means, [], passes + 1
        for record, program in zip(records, programs, strict=True):
            estimates = signal(_run(record, program, theta), "theta_hat")
            theta = estimates[:, -1]
            history.append(estimates)
        history = np.concatenate(history, axis=1)
        means = np.mean(history, axis=1)
        size = np.maximum(np.abs(means), np.std(history, axis=1))  # an offset may well be zero
        change = float(np.max(np.abs(means - before) / size))
    if not change < DRIFTING or np.any(means[n:2 * n] <= 0):
        raise DivergedError(f"{records[0].source}: the estimates do not settle in {passes} "
                            "passes; the motion excites too little, or K-bar is too far from "
                            "positive ('clie check' shows both)")
    return means, passes, change


def _run(record, program, theta, frozen=False):
    n, step = record.n, program.period
    start = {"model": [*record.q[0], *np.zeros(n)], "update": theta}
    blocks = {block for block, _ in program.states}
    velocity = velocity_block(record.robot.controller, n, step)
    start["velocity"] = resting_state(velocity, record.q[0])
    inputs = held_inputs(record)
    if "q[0]" in program.inputs:
        inputs["q"] = record.q
    return program.run((len(record) - 1) * step, inputs=inputs, log=None,
                       initial_state={name: x for name, x in start.items() if name in blocks},
                       params={"update.gamma": 0.0} if frozen else None)


def _parts(record):
    controller = record.robot.controller
    step = controller.sample_time or record.sample_time
    kp, kd = pd_gains(controller)
    phi, b = motion_regressors(record, step)
    return kp, kd, scaled_gain(phi, RATE, kp, kd, b), velocity_block(controller, record.n, step), b


def _gradient_loop(record):
    kp, kd, gamma, velocity, _ = _parts(record)
    return compile_diagram(recorded_loop(kp, kd, gamma, velocity))


def _composite_loop(record):
    kp, kd, gamma, velocity, b = _parts(record)
    alpha = SHARE * float(np.mean(kd / (kp * b)))
    return compile_diagram(recorded_composite(kp, kd, gamma, alpha, velocity))


def _intervals(records, programs, theta):
    """Half widths of J, F and c: the sandwich of the estimating equation ``mean Phi e_u = 0``."""
    scores = _scores(records, programs, theta)
    slopes = []
    for i, value in enumerate(theta):
        step = STEP * max(abs(value), STEP * np.abs(theta).max())
        ahead, behind = (_scores(records, programs, theta + shift * np.eye(len(theta))[i])
                         for shift in (step, -step))
        slopes.append((ahead.sum(axis=0) - behind.sum(axis=0)) / (2 * step))
    inverse = np.linalg.inv(np.array(slopes).T)
    middle, freedom = block_covariance(scores)
    a, b, d = theta.reshape(3, -1)
    n, zero, eye = len(b), np.zeros((len(b), len(b))), np.eye(len(b))
    physical = np.block([[zero, np.diag(-1 / b**2), zero],
                         [eye / b, np.diag(-a / b**2), zero],
                         [zero, np.diag(-d / b**2), eye / b]])
    covariance = physical @ inverse @ middle @ inverse.T @ physical.T
    return quantile95(freedom) * np.sqrt(np.diag(covariance)).reshape(3, n)


def _scores(records, programs, theta):
    """Terms ``Phi Kd Kp^-1 e_u`` of the update law, one row per sample, estimates held."""
    return np.vstack([_score(record, _run(record, program, theta, frozen=True))
                      for record, program in zip(records, programs, strict=True)])


def _score(record, run):
    kp, kd = pd_gains(record.robot.controller)
    dq, u, e_u = (signal(run, name) for name in ("dq_model", "u_model", "e_u"))
    weighted = (kd / kp)[:, None] * e_u
    return np.vstack((dq * weighted, -u * weighted, weighted)).T
