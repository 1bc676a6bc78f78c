"""Motor that weakens as it heats up."""

import numpy as np

from clie_blocks.effects.blocks import Dynamic
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def faded_torque(z: np.ndarray, u: np.ndarray, fade: PerJoint) -> np.ndarray:
    """Torque of a motor that is z warmer [N m]: ``u / (1 + fade z)``."""
    return u / (1.0 + fade * z)


def final_rise(z: np.ndarray, u: np.ndarray, heating: PerJoint, fade: PerJoint) -> np.ndarray:
    """Temperature rise at which the copper loss of today ends [K]: ``heating u u_motor``."""
    return heating * u * faded_torque(z, u, fade)


def heating_rate(z: np.ndarray, u: np.ndarray, heating: PerJoint, time_constant: PerJoint,
                 fade: PerJoint) -> np.ndarray:
    """Rate of the temperature rise z [K/s]: ``(heating u u_motor - z) / time_constant``."""
    return (final_rise(z, u, heating, fade) - z) / time_constant


def heating_step(z: np.ndarray, u: np.ndarray, heating: PerJoint, time_constant: PerJoint,
                 fade: PerJoint, period: float) -> np.ndarray:
    """Temperature rise one period later [K], the copper loss held meanwhile."""
    return z + (1.0 - np.exp(-period / time_constant)) * (final_rise(z, u, heating, fade) - z)


MOTOR_HEATING = Effect(
    name="motor_heating", family="drive", port="drive",
    build=Dynamic(heating_rate, faded_torque, inputs=("u",), outputs=("u",)),
    parameters=(
        Parameter("heating", "K/(N m)^2", 0.0, 1e8, 5.0, 0.0,
                  "final rise per squared torque: copper loss times thermal resistance"),
        Parameter("time_constant", "s", 1.0, 1e5, 300.0, None, "thermal time constant"),
        Parameter("fade", "1/K", 0.0, 0.05, 1.1e-3, None,
                  "relative loss of torque per kelvin; 1.1e-3 for NdFeB magnets, "
                  "3.9e-3 more for copper behind a voltage"),
    ),
    equation="z' = (heating u u_motor - z) / time_constant, u_motor = u / (1 + fade z)",
    reference="J. R. Hendershot, T. J. E. Miller, Design of Brushless Permanent-Magnet Machines, "
              "chapter on cooling",
    signature="The gain falls over minutes of hard work and comes back after a rest.",
    confused_with={
        "friction_drift": "hold a known mass before and after: heat changes the gain at rest too",
        "torque_gain_error": "repeat the first run at the end: heat fades, a gain error stays",
        "supply_sag": "repeat at once: sag has no memory",
    },
    simulators={
        "mujoco": "actuator dcmotor thermal",
        "isaac": "none",
        "gazebo": "none",
        "simscape": "DC Motor with thermal port",
    },
    wrong="One thermal mass, copper loss alone. Exact for the winding of a motor driven by "
          "voltage; behind a current loop magnets fade in a straight line and the loss does not "
          "fall: both differ in second order of the fade.",
    symmetry="odd", sampled=Dynamic(heating_step, faded_torque, inputs=("u",), outputs=("u",)),
)
