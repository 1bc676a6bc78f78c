"""Laws with a model of the robot: inverse dynamics fed forward, PD+, and computed torque."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import control as ct
import numpy as np

from clie_blocks.controllers.feedforward import STATES, ReferenceRate
from clie_blocks.controllers.sampled import Params, VelocityFilter
from clie_blocks.controllers.wrapping import Signals, joints_of, with_signals
from clie_blocks.errors import nearest
from clie_blocks.labels import DiagramError

FORMS = ("inverse_dynamics", "pd_plus", "computed_torque")
Torque = Callable[[np.ndarray, np.ndarray, np.ndarray, Params], np.ndarray]


def with_inverse_dynamics(law: ct.NonlinearIOSystem, torque: Torque,
                          params: Mapping[str, np.ndarray], form: str = "inverse_dynamics", *,
                          rate: str = "trajectory",
                          velocity_filter: VelocityFilter | None = None,
                          ) -> ct.NonlinearIOSystem:
    """Law with the inverse dynamics ID of a model, eq. (1), in one of three forms.

    ``inverse_dynamics``: ``u = law(q_d, q, pe + ID(q_d, dq_d, ddq_d))``;
    ``pd_plus``: ``u = law(q_d, q, pe + M(q) ddq_d + C(q, v) dq_d + B dq_d + G(q))``;
    ``computed_torque``: ``u = ID(q, v, ddq_d + law(q_d, q, 0)) + pe``, with gains per inertia,
    Kp [1/s^2] and Kd [1/s].  v is the velocity of the joint.  Inputs: q_d, q [rad], pe [N m].
    Outputs: u [N m].  Where it is wrong: in ``computed_torque`` no limit holds the integral.

    Parameters
    ----------
    law : control.NonlinearIOSystem
        With these ports, as `sampled_pid` has them.
    torque : callable
        ``torque(q, dq, ddq, params)``, ID on the side of the command (n,) [N m].
    params : mapping
        Numbers of the model, parameters of the block.
    form : str
        One of `FORMS`.
    rate : str
        How velocity and acceleration of the reference are formed, as in `with_feedforward`.
    velocity_filter : VelocityFilter, optional
        From q to v; by default the difference of samples.

    Returns
    -------
    control.NonlinearIOSystem
        The block, with the rate and the name of the law.

    Raises
    ------
    DiagramError
        If the law has other ports, or the form or the rate is not known.

    """
    if form not in FORMS:
        raise DiagramError(f"{law.name}: no compensation is called {form!r}; "
                           f"{nearest(form, FORMS)}")
    derivatives = ReferenceRate(law, rate, velocity_filter)
    speed = velocity_filter or VelocityFilter(float(law.dt))
    if form == "computed_torque":
        return _computed_torque(law, torque, params, derivatives, speed)

    def before(memory: Sequence[np.ndarray], q_d: np.ndarray, q: np.ndarray, pe: np.ndarray,
               params: Params) -> tuple[Signals, list[np.ndarray]]:
        dq_d, ddq_d, after = derivatives(q_d, memory[:4], params)
        if form == "inverse_dynamics":
            return (q_d, q, pe + torque(q_d, dq_d, ddq_d, params)), after
        dq, of_joint = speed(q, memory[4:], params)
        return (q_d, q, pe + pd_plus_torque(torque, q, dq, dq_d, ddq_d, params)), [
            *after, *of_joint]

    names = STATES if form == "inverse_dynamics" else (*STATES, "rate_1", "rate_2")
    return with_signals(law, before, names, params)


def pd_plus_torque(torque: Torque, q: np.ndarray, dq: np.ndarray, dq_d: np.ndarray,
                   ddq_d: np.ndarray, params: Params) -> np.ndarray:
    """``M(q) ddq_d + C(q, dq) dq_d + B dq_d + G(q)``, C by polarisation of ``C(q, dq) dq``.

    C is the matrix of Christoffel symbols, which is symmetric in its velocities.
    """
    def of_speed(x: np.ndarray) -> np.ndarray:
        return torque(q, x, 0.0 * q, params)

    mixed = 0.25 * (of_speed(dq + dq_d) - of_speed(dq - dq_d) + of_speed(dq_d) - of_speed(-dq_d))
    return torque(q, 0.0 * q, ddq_d, params) + mixed


def _computed_torque(law: ct.NonlinearIOSystem, torque: Torque, params: Mapping[str, np.ndarray],
                     derivatives: ReferenceRate, speed: VelocityFilter) -> ct.NonlinearIOSystem:
    n, inner = joints_of(law), law.nstates

    def both(t: float, x: np.ndarray, u: np.ndarray,
             params: Params) -> tuple[np.ndarray, list[np.ndarray]]:
        own = x[inner:]
        memory = [own[k * n:(k + 1) * n] for k in range(6)]
        q_d, q, pe = u[:n], u[n:2 * n], u[2 * n:]
        _, ddq_d, after = derivatives(q_d, memory[:4], params)
        dq, of_joint = speed(q, memory[4:], params)
        wanted = law.outfcn(t, x[:inner], np.concatenate((q_d, q, 0.0 * pe)), params)
        return torque(q, dq, ddq_d + wanted, params) + pe, [*after, *of_joint]

    def update(t: float, x: np.ndarray, u: np.ndarray, params: Params) -> np.ndarray:
        after = both(t, x, u, params)[1]
        given = np.concatenate((u[:2 * n], 0.0 * u[2 * n:]))
        return np.concatenate((law.updfcn(t, x[:inner], given, params), *after))

    def output(t: float, x: np.ndarray, u: np.ndarray, params: Params) -> np.ndarray:
        return both(t, x, u, params)[0]

    names = [f"{name}[{k}]" for name in (*STATES, "rate_1", "rate_2") for k in range(n)]
    return ct.nlsys(update, output, dt=law.dt, name=law.name, params={**law.params, **params},
                    states=[*law.state_labels, *names], inputs=law.input_labels,
                    outputs=law.output_labels)
