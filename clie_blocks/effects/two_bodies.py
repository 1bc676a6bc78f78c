"""A joint as two bodies, motor and link: what elasticity, backlash and hysteresis share.

The plant keeps the link and everything that it carries; the motor leaves it with its inertia and
damping and becomes a body of its own, so that the equations are those of the elastic-joint robot::

    motor_inertia q_motor'' + motor_damping q_motor' = u - torque
    (M - motor_inertia) q'' + ... = torque,    torque = spring(q_motor - q, q_motor' - q')

All torques are on the motor side, all angles at the joint: a stiffness is N m of the motor per rad
of the joint, that of the drawing divided by the gear ratio.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.effects.blocks import Dynamic, Static, filled_in
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import signals

if TYPE_CHECKING:
    import control as ct

MOTOR = (
    Parameter("motor_inertia", "kg m^2", 1e-9, 1e4, 1.0, None,
              "the motor's share of the joint's inertia; must leave some to the link"),
    Parameter("motor_damping", "N m s/rad", 0.0, 1e4, 0.0, None,
              "the motor's share of the joint's viscous friction"),
)


@dataclass(frozen=True)
class TwoBodies:
    """Block between motor and link.

    Inputs: u [N m] on the motor, q, dq of the link [rad, rad/s].  Outputs: u [N m] on the link,
    q_motor, dq_motor, and inertia [kg m^2], which the link is rid of.  State: twist
    ``q_motor - q`` [rad], zero in any pose at rest; motor_speed [rad/s]; z if there is a memory.

    Parameters
    ----------
    kernel : callable
        ``kernel(twist, twist_rate, *memory, **parameters)``, the torque of the spring [N m].
    active : callable
        ``active(**parameters)``, the joints that have two bodies; the others stay rigid.
    memory : callable or None
        ``memory(z, twist_rate, **parameters)``, the rate of a state z of the spring.

    """

    kernel: Callable
    active: Callable
    memory: Callable | None = None
    inputs = ("u", "q", "dq")
    outputs = ("u", "q_motor", "dq_motor", "inertia")

    def __call__(self, values: dict[str, np.ndarray], n: int, name: str) -> ct.NonlinearIOSystem:
        """Return the block for n joints with the given parameter vectors."""
        import control as ct

        rows = 3 if self.memory else 2

        def spring(x: np.ndarray, dq: np.ndarray, params: dict[str, np.ndarray]) -> tuple:
            parameters = {key: params[f"{name}.{key}"] for key in values}
            twist, speed, *memory = x.reshape(rows, n)
            torque = filled_in(self.kernel, parameters)(twist, speed - dq, *memory)
            return filled_in(self.active, parameters)(), torque, twist, speed, memory, parameters

        def update(t: float, x: np.ndarray, u: np.ndarray,
                   params: dict[str, np.ndarray]) -> np.ndarray:
            torque_in, _, dq = u.reshape(3, n)
            active, torque, _, speed, memory, parameters = spring(x, dq, params)
            damped = torque_in - torque - parameters["motor_damping"] * speed
            rates = [speed - dq, damped / parameters["motor_inertia"]]
            if self.memory:
                rates += [filled_in(self.memory, parameters)(z, speed - dq) for z in memory]
            return np.concatenate([np.where(active, rate, 0.0) for rate in rates])

        def output(t: float, x: np.ndarray, u: np.ndarray,
                   params: dict[str, np.ndarray]) -> np.ndarray:
            torque_in, q, dq = u.reshape(3, n)
            active, torque, twist, speed, _, parameters = spring(x, dq, params)
            # The plant damps the link with the motor's share as well: give that back.
            passed = torque + parameters["motor_damping"] * dq
            return np.concatenate((
                np.where(active, passed, torque_in), np.where(active, q + twist, q),
                np.where(active, speed, dq),
                (np.eye(n) * np.where(active, -parameters["motor_inertia"], 0.0)).reshape(-1)))

        states = ("twist", "motor_speed", "z")[:rows]
        return ct.nlsys(
            update, output, name=name, states=signals(*states, n=n),
            params={f"{name}.{key}": value for key, value in values.items()},
            inputs=signals(*self.inputs, n=n),
            outputs=signals("u", "q_motor", "dq_motor", n=n) + signals("inertia", n=n * n))

    def spring(self, values: dict[str, np.ndarray], name: str) -> ct.NonlinearIOSystem:
        """Return the spring of one joint as a block of its own: twist, dtwist -> tau."""
        kernel, memory = self.kernel, self.memory
        if memory is None:
            return Static(kernel, ("twist", "dtwist"))(values, 1, name)

        @wraps(memory)
        def rate(z: np.ndarray, twist: np.ndarray, speed: np.ndarray,
                 **parameters: np.ndarray) -> np.ndarray:
            return memory(z, speed, **parameters)

        @wraps(kernel)
        def torque(z: np.ndarray, twist: np.ndarray, speed: np.ndarray,
                   **parameters: np.ndarray) -> np.ndarray:
            return kernel(twist, speed, z, **parameters)

        return Dynamic(rate, torque, ("twist", "dtwist"))(values, 1, name)

