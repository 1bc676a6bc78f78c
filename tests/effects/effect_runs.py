"""Runs that several tests of effects share."""

import numpy as np

from clie_blocks.compiled import compile_diagram
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.effects import LIBRARY, with_effects
from clie_blocks.joints import decoupled_joints


def one_joint(*effects, a=2.0, b=0.5, d=0.0):
    """One joint of the paper with effects, as a plant."""
    return with_effects(decoupled_joints([a], [b], [d]), list(effects))


def run_plant(plant, torque, duration, step=1e-3, state=None, method="ode4", every=1):
    """Time, position and velocity of a plant under a torque (number or function of time)."""
    program = compile_diagram(plant)
    start = np.zeros(plant.nstates)
    for label, value in (state or {}).items():
        start[plant.state_labels.index(label)] = value
    drive = (lambda t: np.array([torque(t)])) if callable(torque) else [torque]
    response = program.run(duration, step, method, inputs={"u": drive}, initial_state=start,
                           every=every)
    return response.time, response.outputs[0].ravel(), response.outputs[1].ravel()


def run_loop(plant, q_d, duration, step=1e-3, kp=10.0, kd=5.0, method="ode4", log=None):
    """Response of the PD loop (Fig. 1) around a one-joint plant to a set-point."""
    loop = joint_loop(plant, [kp], [kd])
    drive = (lambda t: np.array([q_d(t)])) if callable(q_d) else [q_d]
    return compile_diagram(loop).run(duration, step, method, inputs={"q_d": drive, "pe": [0.0]},
                                     log=log)


def state_along(effect, t, dq, **values):
    """Torque of a friction block along a given velocity, its state by Heun's method."""
    block = LIBRARY[effect].typical(**values).block(1)
    x, torques = np.zeros(block.nstates), []
    for k, speed in enumerate(dq):
        u = np.array([speed])
        torques.append(block.output(t[k], x, u)[0])
        if k + 1 < len(t):
            h, after = t[k + 1] - t[k], np.array([dq[k + 1]])
            slope = block.dynamics(t[k], x, u)
            x = x + h / 2 * (slope + block.dynamics(t[k + 1], x + h * slope, after))
    return np.array(torques)


def block_response(setting, signal, duration, step=1e-4, method="ode4", n=1):
    """Time and outputs of an effect's block alone, its inputs given as functions of time."""
    block = setting.block(n)
    inputs = {name: (lambda t, f=f: np.full(n, f(t))) if callable(f) else np.full(n, f)
              for name, f in signal.items()}
    response = compile_diagram(block).run(duration, step, method, inputs=inputs)
    return response.time, np.atleast_2d(response.outputs)


def first_harmonic(t, y, w):
    """Complex amplitude of y at w over the last whole period, as a gain of sin(w t)."""
    period = 2 * np.pi / w
    lap = (t >= t[-1] - period - 1e-9) & (t < t[-1] - 1e-9)
    return 2j * np.mean(y[lap] * np.exp(-1j * w * t[lap]))


def frequency_response(setting, w):
    """Response of the block of a linear effect, from its input to its output."""
    import control as ct

    block = setting.block(1)
    system = ct.linearize(block, np.zeros(block.nstates), np.zeros(block.ninputs))
    return np.array([system(1j * value) for value in w]).ravel()
