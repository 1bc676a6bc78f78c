"""Loops that cannot follow a log are refused with the remedy, before anything is fitted."""

import control as ct
import numpy as np
import pytest

from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records import Record
from clie_blocks.errors import ClieError, DivergedError, NotIdentifiableError, RecordError

INERTIA, DAMPING, KP, KD, PERIOD = 0.05, 0.1, 8.0, 0.6, 2e-3
TIME = PERIOD * np.arange(3000)


def record(**changed):
    q_d = 0.4 * np.sin(3.0 * TIME)[:, None]
    q = 0.4 * np.sin(3.0 * (TIME - 0.01))[:, None]
    return Record(**{"time": TIME, "q": q, "qd": q_d, "u": KP * (q_d - q), "pe": 0.0 * q,
                     "source": "log-1", **changed})


def law(x, u):
    return KP * (u[0] - x[0]) - KD * x[1] + u[1]


def joint(x, u, motor):
    return np.array([x[1], (motor + u[2] - DAMPING * x[1]) / INERTIA])


def loop(rate, states=2, dt=None):
    """A loop with some right-hand side, in the ports of the diagnosis."""
    def update(t, x, u, params):
        return rate(x, u)

    def output(t, x, u, params):
        return np.array([x[0], law(x, u)])

    return ct.nlsys(update, output, states=states, name="mine", inputs=["q_d", "pe", "torque"],
                    outputs=["q", "u"], **({} if dt is None else {"dt": dt}))


def sound():
    return loop(lambda x, u: joint(x, u, law(x, u)))


def fails(x, u):
    return {"inertia": 1.0}["stiffness"]


def branches(x, u):
    return joint(x, u, 1.0 if law(x, u) > 1.0 else law(x, u))


@pytest.mark.parametrize("rate, words", [
    (fails, "fails with KeyError: 'stiffness'"),
    (branches, "np.where"),
    (lambda x, u: joint(x, u, law(x, u) - np.sqrt(x[1])), "gives NaN or infinity"),
    (lambda x, u: np.array([x[1]]), "returns 1 numbers where 2 are declared"),
    (lambda x, u: joint(x, -np.array(u), law(x, u)), "sign of the torque port"),
    (lambda x, u: joint(x, [u[0], u[1], 0.0], law(x, u)), "moves no joint")])
def test_a_loop_that_cannot_be_run_is_refused_with_the_remedy(rate, words):
    with pytest.raises(ClieError, match=words) as refusal:
        diagnose(Problem.from_loop(loop(rate), record()))
    assert "opaque" not in str(refusal.value)  # a remedy that a diagnosis does not have


def test_a_loop_faster_than_its_simulation_is_refused():
    current = loop(lambda x, u: np.append(joint(x, u, x[2]), 1e5 * (law(x, u) - x[2])), states=3)
    with pytest.raises(ClieError, match="pole at 1e\\+05 rad/s.*steady state"):
        diagnose(Problem.from_loop(current, record()))


def test_an_unstable_loop_is_refused_before_it_runs():
    with pytest.raises(DivergedError, match="grows e-fold every 0.1"):
        wrong_sign = loop(lambda x, u: joint(x, u, -KP * (u[0] - x[0]) - KD * x[1]))
        diagnose(Problem.from_loop(wrong_sign, record()))
    with pytest.raises(DivergedError, match="is unstable"):
        growing = loop(lambda x, u: np.array([x[0] + PERIOD * x[1],
                                              1.02 * x[1] + PERIOD * u[2] / INERTIA]), dt=PERIOD)
        diagnose(Problem.from_loop(growing, record()))


def test_a_loop_that_is_stable_at_rest_only_is_refused_where_it_diverges():
    def hardening(x, u):
        return joint(x, u, law(x, u) + 400.0 * x[0]**3)

    with pytest.raises(DivergedError, match="mine diverges.*grows without bound"):
        diagnose(Problem.from_loop(loop(hardening), record()))


def test_an_algebraic_loop_is_named():
    ring = [ct.nlsys(lambda t, x, u, p: joint(x, (0, 0, u[1]), u[0]), lambda t, x, u, p: x[:1],
                     states=2, inputs=["u", "torque"], outputs=["q"], name="plant"),
            ct.nlsys(None, lambda t, x, u, p: KP * (u[:1] - u[1:2]) - u[2:3],
                     inputs=["q_d", "q", "back"], outputs=["u"], name="pd"),
            ct.nlsys(None, lambda t, x, u, p: 0.5 * u, inputs=["u"], outputs=["back"],
                     name="inner")]
    whole = ct.interconnect(ring, inplist=["pd.q_d", "plant.torque"], inputs=["q_d", "torque"],
                            outlist=["plant.q", "pd.u"], outputs=["q", "u"], name="ring")
    with pytest.raises(ClieError, match="algebraic loop: signals pass from block to block"):
        diagnose(Problem.from_loop(whole, record()))


@pytest.mark.parametrize("logs, error, words", [
    ([], RecordError, "no record"),
    ([record(time=TIME[:50], **{key: getattr(record(), key)[:50]
                                for key in ("q", "qd", "u", "pe")})],
     NotIdentifiableError, "50 samples"),
    ([record(), record(time=2 * TIME, source="log-2")], RecordError, "every 0.004 s, log-1 every"),
    ([record(qd=None, pe=None)], RecordError, "neither a reference qd nor an excitation"),
    ([record(u=None)], RecordError, "no command u")])
def test_logs_that_do_not_fit_a_loop_are_refused(logs, error, words):
    with pytest.raises(error, match=words):
        diagnose(Problem.from_loop(sound(), logs))
