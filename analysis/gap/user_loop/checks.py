"""Faults of a user's loop, told in words before anything is fitted to it."""

import re

import numpy as np

from clie_blocks.analysis.gap.controller.replay import ControllerCheck
from clie_blocks.analysis.gap.problem.problem import LEAST_SAMPLES
from clie_blocks.errors import ClieError, DivergedError, NotIdentifiableError, RecordError

SAME_CLOCK = 1e-3  # largest relative difference of sample times
MOST_GROWTH = 7.0  # e-folds of a small error within a log: a thousandfold
FASTEST = 2.5  # pole times step, from which on a Runge-Kutta step of fourth order runs away
FAR = 1e4  # times the range of the robot's motion
CALLED_BACK = re.compile(r"[;,] or have it called back, slowly: opaque=\[.*?\]")


def check_records(records, n, name):
    """Refuse logs that do not fit a loop, or each other.

    Parameters
    ----------
    records : list of Record
        The logs.
    n : int
        Joints of the loop.
    name : str
        Of the loop.

    Raises
    ------
    RecordError
        If a log has other joints or another clock, or does not say what was asked.
    NotIdentifiableError
        If a log is too short.

    """
    if not records:
        raise RecordError("there is no record to diagnose: give one, or a list of them")
    for record in records:
        if record.q.shape[1] != n:
            raise RecordError(f"{record.source} has {record.q.shape[1]} joints and the loop "
                              f"{name!r} has {n}")
        if record.qd is None and record.pe is None:
            raise RecordError(
                f"{record.source} has neither a reference qd nor an excitation pe, so that "
                f"nothing says what the loop {name!r} was asked: log one of them")
        if len(record) < LEAST_SAMPLES:
            raise NotIdentifiableError(
                f"{record.source} has {len(record)} samples; a diagnosis needs at least "
                f"{LEAST_SAMPLES} per log, better 20 s of motion: record longer")
        period = records[0].sample_time
        if abs(record.sample_time - period) > SAME_CLOCK * period:
            raise RecordError(
                f"{record.source} has a sample every {record.sample_time:g} s, "
                f"{records[0].source} every {period:g} s; bring them to one clock with "
                "clie_blocks.analysis.records.resample")


def guarded_loop(loop):
    """Return ``f(x, u) -> (rates or next state, outputs)`` that tells a loop's faults in words.

    Parameters
    ----------
    loop : control.NonlinearIOSystem
        A loop in whose functions anything may happen.

    """
    def answer(x, u):
        try:
            with np.errstate(all="ignore"):
                moved, shown = (np.array(part, float).ravel() for part in (
                    loop.dynamics(0.0, x, u), loop.output(0.0, x, u)))
        except Exception as error:
            raise ClieError(f"{loop.name}: {_explained(error, x, u)}") from error
        for found, wanted, what in ((moved, loop.nstates, "update"),
                                    (shown, loop.noutputs, "output")):
            if len(found) != wanted:
                raise ClieError(f"{loop.name}: the {what} function returns {len(found)} numbers "
                                f"where {wanted} are declared")
            if not np.isfinite(found).all():
                raise ClieError(
                    f"{loop.name}: the {what} function gives NaN or infinity, {_at(x, u)}, where "
                    "the joints stand as in the first sample of the log or a little beside it; "
                    "keep roots, logarithms and divisions off zero")
        return moved, shown

    return answer


def _explained(error, x, u):
    if "algebraic loop" in str(error):
        return ("signals go round without a state or a sample of delay between them (algebraic "
                "loop), so that no order of its blocks exists. Solve that ring by hand, or put a "
                "filter or drive into it as the robot has it")
    return (f"the loop fails with {type(error).__name__}: {error}, {_at(x, u)}; run "
            "loop.dynamics(0, x, u) and loop.output(0, x, u) there")


def _at(x, u):
    return f"at t = 0, x = {np.round(x, 6).tolist()}, u = {np.round(u, 6).tolist()}"


def check_poles(loop, poles, period, duration, most_substeps):
    """Refuse a linearised loop that no log can be held beside, or that is too fast to be run.

    Parameters
    ----------
    loop : control.NonlinearIOSystem
        The loop.
    poles : ndarray
        Of the linearised loop, in its own time [rad/s], or of z.
    period : float
        Sample time of the log [s].
    duration : float
        Of the log [s].
    most_substeps : int
        Steps of the simulation in one sample.

    Raises
    ------
    DivergedError
        If a small error grows a thousandfold within the log.
    ClieError
        If a pole is faster than the steps of the simulation.

    """
    growth = (np.log(np.abs(poles) + 1e-300) / period if loop.dt else poles.real).max(initial=0.0)
    if growth * duration > MOST_GROWTH:
        raise DivergedError(
            f"{loop.name} is unstable: linearised at the first sample of the log, an error grows "
            f"e-fold every {1.0 / growth:.3g} s, and the log lasts {duration:.3g} s, so that no "
            "model of it stays beside the log. Check the signs of the feedback and the units of "
            "the gains; a machine without feedback needs its controller in the loop")
    fastest = np.abs(poles).max(initial=0.0)
    if not loop.dt and fastest * period / most_substeps > FASTEST:
        raise ClieError(
            f"{loop.name} has a pole at {fastest:.3g} rad/s, and the diagnosis runs a loop in at "
            f"most {most_substeps} steps per sample of the log, which holds poles up to "
            f"{FASTEST * most_substeps / period:.3g} rad/s. Put what is faster, as a current "
            "controller, in its steady state: the logs cannot show it")


def check_run(law, log, values):
    """Refuse a loop that leaves every bound beside a log, or that cannot become machine code.

    Parameters
    ----------
    law : LoopLaw
        The loop and what is known of it.
    log : Log
        What it is fed with.
    values : dict
        Inertia, damping and load of its joints.

    Raises
    ------
    ClieError
        If a block of the loop cannot be traced; names the block and the remedy.
    DivergedError
        If the loop's own motion becomes infinite, or leaves the robot's by far.

    """
    from clie_blocks.compiled import TraceError

    try:
        q, _ = law.simulator(()).run(log, values)
    except TraceError as error:
        raise ClieError(f"{law.diagram.name}: the diagnosis runs a loop as machine code, and "
                        f"{CALLED_BACK.sub('', str(error))}") from error
    except DivergedError as error:
        raise _diverged(law, log) from error
    if np.abs(q - log.start).max() > FAR * max(np.ptp(log.q), np.ptp(log.q_d), 1e-6):
        raise _diverged(law, log)


def _diverged(law, log):
    return DivergedError(
        f"{law.diagram.name} runs away: fed with the reference and excitation of {log.name} it "
        f"leaves every bound, while the robot moves by {np.ptp(log.q):.3g} rad. Check signs, "
        "units and gains of the loop, and that no root or division in it meets a zero")


def assumed_controller(asked, causes):
    """Check of a loop's controller: there is none, since the loop is taken as it is."""
    n, law = asked.n, asked.law
    out = sorted({cause.name for cause in causes}
                 - {cause.name for cause in causes if law.reaches(cause)})
    said = ["the controller is part of the loop and is taken as it is",
            f"a missing torque enters at the port {law.ports.torque!r}"]
    if out:
        said.append(f"out of reach at the ports of a loop: {', '.join(out)}")
    if not law.ports.has_sensor:
        said.append("an input 'sensor' that adds to the measured position would bring "
                    "encoder_eccentricity into reach")
    still = [log.name for log in asked.logs if not np.ptp(log.q_d)]
    if still:
        said.append(f"the reference of {', '.join(still)} rests or was not logged: the loop is "
                    "asked to stay where it begins")
    zero = np.zeros(n)
    return ControllerCheck(zero, zero + np.inf, (), np.full((2, n), np.nan), (), zero, law,
                           tuple(said))
