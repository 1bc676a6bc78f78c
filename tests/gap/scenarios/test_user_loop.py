"""Any python-control loop instead of the paper's joint; the truth comes from solve_ivp."""

import control as ct
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.user_loop.statement import TOLERANCE
from clie_blocks.analysis.gap.report.answer import answer
from clie_blocks.analysis.records import Record
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.joints import decoupled_joints

INERTIA, DAMPING, KP, KD, PERIOD, NOISE = 0.05, 0.1, 8.0, 0.6, 2e-3, 3e-5
TIME = PERIOD * np.arange(7000)
TORQUE = {
    "coulomb": lambda t, q, dq: 0.04 * np.tanh(dq / 1e-3),
    "viscous": lambda t, q, dq: 0.05 * dq,
    "spring": lambda t, q, dq: 0.3 * q,
    "gravity": lambda t, q, dq: 0.25 * np.cos(q + 0.4),
    "torque_ripple": lambda t, q, dq: 0.03 * np.sin(14.0 * q),
    "periodic_disturbance": lambda t, q, dq: 0.03 * np.sin(2 * np.pi * 1.7 * t),
    "step_fault": lambda t, q, dq: 0.05 * (t > 6.0),
    "none": lambda t, q, dq: 0.0,
    "unknown": lambda t, q, dq: 0.05 * np.sin(9.0 * q * dq) * np.cos(1.3 * t),
}


def user_loop():
    """A closed loop in ten lines that knows nothing of this package."""
    def rate(t, x, u, params):
        q_d, pe, torque = u
        motor = params["Kp"] * (q_d - x[0]) - params["Kd"] * x[1] + pe
        return np.array([x[1], (motor + torque - DAMPING * x[1]) / INERTIA])

    def output(t, x, u, params):
        q_d, pe, torque = u
        return np.array([x[0], params["Kp"] * (q_d - x[0]) - params["Kd"] * x[1] + pe, x[1]])

    return ct.nlsys(rate, output, states=["angle", "speed"], name="mine",
                    params={"Kp": KP, "Kd": KD}, inputs=["q_d", "pe", "torque"],
                    outputs=["q", "u", "dq"])


def drive(k):
    """Set-point and excitation of experiment k."""
    tones = np.array([0.11, 0.37, 0.83, 1.9, 3.1]) * (1.0, 1.17, 0.9)[k]
    q_d = 0.6 * np.sin(2 * np.pi * 0.09 * (1 + k / 5) * TIME)
    return q_d, 0.25 * np.sin(2 * np.pi * np.outer(TIME, tones) + 3.0 * k).sum(axis=1)


def logged(name, k):
    """Log of the true joint: held inputs, integrated by another engine."""
    q_d, pe = drive(k)
    noise = np.random.default_rng(k).normal(0, NOISE, len(TIME))

    def rate(t, x):
        i = min(int(t / PERIOD + 1e-9), len(TIME) - 1)
        motor = KP * (q_d[i] - x[0] - noise[i]) - KD * x[1] + pe[i]
        return x[1], (motor - TORQUE[name](t, *x) - DAMPING * x[1]) / INERTIA

    solution = solve_ivp(rate, (0, TIME[-1]), (0.0, 0.0), t_eval=TIME, max_step=PERIOD,
                         method="RK23", rtol=1e-6, atol=1e-9)
    q = solution.y[0] + noise
    u = KP * (q_d - q) - KD * solution.y[1] + pe
    return Record(time=TIME, q=q[:, None], u=u[:, None], qd=q_d[:, None], pe=pe[:, None],
                  source=f"log-{k + 1}")


@pytest.mark.slow
@pytest.mark.parametrize("name", [
    "coulomb", "spring", "none", "gravity", "torque_ripple", "periodic_disturbance", "step_fault",
    "viscous", "unknown"])
def test_an_effect_that_a_loop_does_not_have_is_named(name):
    diagnosis = diagnose(Problem.from_loop(user_loop(), [logged(name, k) for k in range(2)]))
    expected = {"none": ("none",), "viscous": ("parametric",), "unknown": ("unknown",)}
    assert diagnosis.ranking[0].names == expected.get(name, (name,))
    if name == "viscous":
        assert answer(diagnosis)["joint_model"]["damping"]["value"][0] == pytest.approx(
            DAMPING + 0.05, rel=0.03)
    if name == "coulomb":
        assert answer(diagnosis)["effects"][0]["parameters"]["level"]["value"][0] == pytest.approx(
            0.04, rel=0.05)
    assert any("out of reach" in decision for decision in answer(diagnosis)["decisions"])


@pytest.mark.slow
def test_one_record_and_a_diagram_of_the_package_do():
    plant = decoupled_joints([DAMPING / INERTIA], [1 / INERTIA], [0.0], name="plant")
    diagnosis = diagnose(Problem.from_loop(joint_loop(plant, [KP], [KD]), logged("spring", 0)))
    assert diagnosis.ranking[0].names == ("spring",)
    assert diagnosis.reduction.judged_on == "blocks left out of the fit"
    assert any("port 'pe'" in decision for decision in answer(diagnosis)["decisions"])


def cut_loop():
    """The same joint, cut at the motor: the torque that leaves the drive is an input."""
    def rate(t, x, u, params):
        return np.array([x[1], (u[2] - DAMPING * x[1]) / INERTIA])

    def output(t, x, u, params):
        return np.array([x[0], KP * (u[0] - x[0]) - KD * x[1] + u[1]])

    return ct.nlsys(rate, output, states=["angle", "speed"], name="cut",
                    inputs=["q_d", "pe", "u_in"], outputs=["q", "u"])


def driven(name, k):
    """Log of a joint behind a drive: Euler steps of 0.1 ms."""
    q_d, pe = drive(k)
    noise = np.random.default_rng(k).normal(0, NOISE, len(TIME))
    q = dq = lagged = bristle = 0.0
    queue, rows = [0.0] * 60, []
    wave = 2e-3 if name == "encoder_eccentricity" else 0.0

    def seen(i):
        measured = q + wave * np.sin(2.0 * q + 0.5) + noise[i]
        return measured, KP * (q_d[i] - measured) - KD * dq + pe[i]

    for i in range(len(TIME)):
        rows.append(seen(i))
        for _ in range(20):
            _, u = seen(i)
            lagged += 1e-4 * (u - lagged) / 0.012
            queue = [*queue[1:], u]
            moved = {"actuator_saturation": np.clip(u, -0.5, 0.5), "time_delay": queue[0],
                     "dead_zone": u - np.clip(u, -0.06, 0.06), "actuator_lag": lagged,
                     "torque_gain_error": 1.15 * u}.get(name, u)
            bend = (dq - abs(dq) * bristle) / 0.02
            bristle += 1e-4 * bend
            lost = {"dahl": 0.08 * bristle, "presliding": 0.08 * bristle + 4e-4 * bend}.get(
                name, 0.0)
            dq += 1e-4 * (moved - lost - DAMPING * dq) / INERTIA
            q += 1e-4 * dq
    q, u = np.array(rows).T
    return Record(time=TIME, q=q[:, None], u=u[:, None], qd=q_d[:, None], pe=pe[:, None],
                  source=f"log-{k + 1}")


def measuring_loop():
    """The joint with a port for what its encoder adds."""
    def rate(t, x, u, params):
        motor = KP * (u[0] - x[0] - u[3]) - KD * x[1] + u[1]
        return np.array([x[1], (motor + u[2] - DAMPING * x[1]) / INERTIA])

    def output(t, x, u, params):
        return np.array([x[0] + u[3], KP * (u[0] - x[0] - u[3]) - KD * x[1] + u[1]])

    return ct.nlsys(rate, output, states=["angle", "speed"], name="measuring",
                    inputs=["q_d", "pe", "torque", "sensor"], outputs=["q", "u"])


@pytest.mark.slow
def test_an_encoder_error_enters_at_a_port_of_its_own():
    logs = [driven("encoder_eccentricity", k) for k in range(2)]
    diagnosis = diagnose(Problem.from_loop(measuring_loop(), logs))
    assert diagnosis.ranking[0].names == ("encoder_eccentricity",)


@pytest.mark.slow
@pytest.mark.parametrize("name, key, value", [
    ("actuator_saturation", "limit", 0.5), ("dead_zone", "width", 0.06),
    ("actuator_lag", "lag", 0.012), ("time_delay", "delay", 6e-3),
    ("dahl", "reach", 0.02), ("presliding", "reach", 0.02), ("torque_gain_error", "error", 0.15)])
def test_a_drive_and_bristles_act_in_a_loop_cut_at_the_motor(name, key, value):
    diagnosis = diagnose(Problem.from_loop(cut_loop(), [driven(name, k) for k in range(2)]))
    assert diagnosis.ranking[0].names == (name,)
    stored = answer(diagnosis)["effects"][0]["parameters"][key]
    fitted, (low, high) = stored["value"][0], stored["interval"]
    assert fitted == pytest.approx(value, rel=0.05)
    if name == "torque_gain_error":  # the logs determine gain over inertia, the datasheet the rest
        inertia = diagnosis.model.hypothesis.values["inertia"][0]
        assert (1.0 + fitted) / inertia == pytest.approx((1.0 + value) / INERTIA, rel=2e-3)
        assert low[0] < value < high[0]
        assert high[0] - low[0] > TOLERANCE["inertia"]
