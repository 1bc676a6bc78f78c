"""A torque of fixed frequency from outside: fans, pumps, machines on the same floor."""

import numpy as np

from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.labels import PerJoint


def periodic_torque(t: float, sine: PerJoint, cosine: PerJoint,
                    frequency: PerJoint) -> np.ndarray:
    """Disturbing torque ``amplitude sin(2 pi frequency t + phase)`` [N m]."""
    phase = 2 * np.pi * frequency * t
    return sine * np.sin(phase) + cosine * np.cos(phase)


PERIODIC_DISTURBANCE = Effect(
    name="periodic_disturbance", family="environment", port="environment",
    build=Static(periodic_torque, inputs=("t",)),
    parameters=(
        Parameter("sine", "N m", -1e3, 1e3, 0.1, 0.0, "amplitude of the sine"),
        Parameter("cosine", "N m", -1e3, 1e3, 0.0, 0.0, "amplitude of the cosine, from t = 0"),
        Parameter("frequency", "Hz", 1e-3, 1e3, 2.0, None, "frequency"),
    ),
    equation="tau = sine sin(2 pi frequency t) + cosine cos(2 pi frequency t)",
    reference="M. Tomizuka, T.-C. Tsao, K.-K. Chew, Analysis and Synthesis of Discrete-Time "
              "Repetitive Controllers, ASME J. DSMC 111(3), 1989",
    signature="A line in the spectrum at one frequency, whatever the motion, also at standstill.",
    confused_with={
        "torque_ripple": "stand still: ripple is gone, a disturbance goes on",
        "kinematic_error": "two speeds: a line of the gear moves with the speed",
        "coupling": "stop the other joints: a disturbance goes on",
        "joint_elasticity": "stand still without excitation: a resonance dies out",
    },
    simulators={
        "mujoco": "qfrc_applied by the user",
        "isaac": "external torque by the user",
        "gazebo": "plugin",
        "simscape": "Ideal Torque Source with Sine Wave",
    },
    wrong="One sine of constant amplitude; machines bring harmonics and change speed.",
    passive=False, symmetry="none", curve=("t", 1.0),
)
