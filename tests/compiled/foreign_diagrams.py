"""Diagrams as users of python-control write them, from the physics of textbook systems.

They keep the habits of that style: ``params.get`` with a default, tuples taken apart, plain lists
returned, blocks joined by signal names, transfer functions among the blocks.
"""

import math

import control as ct
import numpy as np


def car(t, x, u, params):
    """Speed of a car on a slope: engine, rolling, drag."""
    m = params.get("m", 1600.0)
    ratio = params.get("ratio", 12.0)
    v = x[0]
    throttle = np.clip(u[0], 0, 1)
    slope = u[1]
    omega = ratio * v
    torque = np.clip(190.0 * (1 - 0.4 * (omega / 420.0 - 1) ** 2), 0, None)
    rolling = 0.01 * m * 9.8 * np.sign(v)
    drag = 0.5 * 1.3 * 0.32 * 2.4 * abs(v) * v
    weight = m * 9.8 * math.sin(slope)
    return (ratio * torque * throttle - rolling - drag - weight) / m


def windup_update(t, x, u, params):
    free = params["ki"] * x[0] + params["kp"] * u[0]
    return u[0] + params["kaw"] * (np.clip(free, 0, 1) - free)


def windup_output(t, x, u, params):
    return np.clip(params["ki"] * x[0] + params["kp"] * u[0], 0, 1)


def cruise_control():
    """PI control with anti-windup of a car that has a saturated throttle."""
    vehicle = ct.nlsys(car, None, name="vehicle", inputs=("u", "theta"), outputs=("v",),
                       states=("v",), params={"m": 1500.0})
    pi = ct.nlsys(windup_update, windup_output, name="control", inputs=["e"], outputs=["u"],
                  states=["z"], params={"kp": 0.5, "ki": 0.1, "kaw": 2.0})
    error = ct.summing_junction(["vref", "-v"], "e", name="error")
    return ct.interconnect((vehicle, pi, error), name="cruise", inputs=["vref", "theta"],
                           outputs=["v", "u"])


def bicycle(t, x, u, params):
    """Kinematic car: position and heading from speed and steering angle."""
    base = params.get("wheelbase", 3.0)
    limit = params.get("maxsteer", 0.5)
    delta = np.clip(u[1], -limit, limit)
    return np.array([np.cos(x[2]) * u[0], np.sin(x[2]) * u[0], u[0] / base * np.tan(delta)])


def lane_keeper(t, x, u, params):
    """Steer toward the x axis with a look-ahead angle."""
    _, lateral, heading, speed = u
    wanted = -math.atan2(lateral, params["ahead"])
    return speed, params["gain"] * (np.mod(wanted - heading + np.pi, 2 * np.pi) - np.pi)


def vehicle_steering():
    """Path following with a kinematic car."""
    vehicle = ct.nlsys(bicycle, None, states=3, name="vehicle", inputs=["v", "delta"],
                       outputs=["x", "y", "theta"], params={"wheelbase": 2.5})
    keeper = ct.nlsys(None, lane_keeper, name="keeper", inputs=["x", "y", "theta", "speed"],
                      outputs=["v", "delta"], params={"ahead": 4.0, "gain": 1.5})
    return ct.interconnect([vehicle, keeper], name="steering", inputs=["speed"],
                           outputs=["x", "y", "theta", "delta"])


def populations(t, x, u, params):
    r, d, b, k, a, c = map(params.get, ["r", "d", "b", "k", "a", "c"])
    food = u[0] if len(u) else 0
    prey, hunters = x
    eaten = a * prey * hunters / (c + prey)
    return [(r + food) * prey * (1 - prey / k) - eaten, b * eaten - d * hunters]


def predator_prey():
    """Two populations with feedback of the state on the growth of the prey."""
    world = ct.nlsys(populations, None, states=2, inputs=["u"], outputs=["H", "L"], name="world",
                     params={"r": 1.6, "d": 0.56, "b": 0.6, "k": 125, "a": 3.2, "c": 50})
    gain = np.array([[0.015, -0.01]])
    point = np.array([20.6, 29.5])

    def feedback(t, x, u, params):
        return -gain @ (u[0:2] - point) + u[2:]

    keeper = ct.nlsys(None, feedback, name="keeper", inputs=["H", "L", "extra"], outputs=["u"])
    return ct.interconnect([world, keeper], name="populations", inputs=["extra"],
                           outputs=["H", "L"])


def aircraft(t, x, u, params):
    m, inertia, r, g, c = (params[key] for key in ("m", "J", "r", "g", "c"))
    theta, rates = x[2], x[3:]
    turn = np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])
    force = np.dot(turn, np.array([u[0], u[1] + m * g])) - c * rates[:2] - [0, m * g]
    return np.concatenate([rates, force / m, [r * u[0] / inertia]])


def pvtol():
    """Vertical take-off aircraft: an inner loop for the roll, an outer one for the position."""
    plane = ct.nlsys(
        aircraft, lambda t, x, u, params: x[0:3], name="plane", states=6, inputs=["F1", "F2"],
        outputs=["x", "y", "theta"],
        params={"m": 4.0, "J": 0.0475, "r": 0.25, "g": 9.8, "c": 0.05})
    inner = ct.tf([40.0, 80.0], [1.0, 50.0], name="inner", inputs=["e_theta"], outputs=["F1"])
    outer = ct.tf([-0.8, -0.12], [1.0, 8.0], name="outer", inputs=["e_x"], outputs=["theta_d"])
    height = ct.tf([30.0, 15.0], [1.0, 10.0], name="height", inputs=["e_y"], outputs=["F2"])
    sums = [ct.summing_junction([f"{name}_d", f"-{name}"], f"e_{name}", name=f"sum_{name}")
            for name in ("theta", "x", "y")]
    lateral = ct.interconnect([inner, outer, *sums[:2]], name="lateral",
                              inputs=["x_d", "x", "theta"], outputs=["F1"])
    return ct.interconnect([plane, lateral, height, sums[2]], name="pvtol",
                           inputs=["x_d", "y_d"], outputs=["x", "y", "theta"])


def adapt(t, x, u, params):
    """Gradient of half the squared model error, normalised."""
    error, reference, measured = u
    gamma = params["gamma"]
    scale = 1 + reference**2 + measured**2
    return [-gamma * reference * error / scale, gamma * measured * error / scale]


def adaptive_law(t, x, u, params):
    theta_r, theta_y = x
    return theta_r * u[1] - theta_y * u[2]


def model_reference_adaptive_control():
    """First-order plant that learns to follow a first-order model."""
    plant = ct.ss([[1.0]], [[0.5]], [[1.0]], [[0.0]], name="plant", inputs=["u"], outputs=["y"])
    model = ct.tf([4.0], [1.0, 4.0], name="model", inputs=["r"], outputs=["ym"])
    law = ct.nlsys(adapt, adaptive_law, name="law", states=["theta_r", "theta_y"],
                   inputs=["e", "r", "y"], outputs=["u"], params={"gamma": 2.0})
    error = ct.summing_junction(["y", "-ym"], "e", name="error")
    return ct.interconnect([plant, model, law, error], name="mrac", inputs=["r"],
                           outputs=["y", "ym", "u"])


def state_feedback():
    """python-control's own state feedback around a pendulum, gains from lqr."""
    pendulum = ct.nlsys(
        lambda t, x, u, params: [x[1], np.sin(x[0]) - 0.1 * x[1] + np.cos(x[0]) * u[0]], None,
        name="pendulum", states=["angle", "rate"], inputs=["u"], outputs=2)
    gain, _, _ = ct.lqr(pendulum.linearize([0, 0], [0]), np.eye(2), np.eye(1))
    return ct.create_statefbk_iosystem(pendulum, gain)[1]


def state_estimator():
    """python-control's own estimator of a discrete-time system."""
    system = ct.ss([[0.9, 0.1], [0.0, 0.8]], [[0.0], [0.1]], [[1.0, 0.0]], [[0.0]], 0.1)
    return ct.create_estimator_iosystem(system, 0.01 * np.eye(1), np.eye(1))


TRACED = {function.__name__: function for function in (
    cruise_control, vehicle_steering, predator_prey, pvtol, model_reference_adaptive_control,
    state_feedback, state_estimator)}
