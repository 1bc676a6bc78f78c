"""One term of a formula for a torque that has no name: a model, and no effect of the catalogue.

A diagnosis that finds no cause, or leaves something beside one, describes the rest by a sum of
such terms.  Each is a product of simple factors, of which most are one.
"""

import numpy as np

from clie_blocks.effects.dry_friction import dry_friction
from clie_blocks.effects.effect import Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.effects.smoothing import WIDTH, direction
from clie_blocks.labels import PerJoint

_STEEPNESS = 10.0  # of the step from braking to driving, over the typical torque


def term_size(q: np.ndarray, dq: np.ndarray, u: np.ndarray, cosine: PerJoint, sine: PerJoint,
              order: PerJoint, slope: PerJoint, edge: PerJoint, side: PerJoint, linear: PerJoint,
              square: PerJoint, speed: PerJoint, slowness: PerJoint, load: PerJoint,
              torque: PerJoint) -> np.ndarray:
    """Size [N m] whatever the direction: place times speed times slow motion times load."""
    place = (cosine * np.cos(order * q) + sine * np.sin(order * q)
             + slope * side * np.maximum(side * (q - edge), 0.0))
    x = np.abs(dq) / speed
    fast = 1.0 - linear - square + linear * x + square * x * x
    return place * fast * np.exp(-(slowness * dq)**2) * (1.0 - load + load * np.abs(u) / torque)


def term_limits(q: np.ndarray, dq: np.ndarray, u: np.ndarray, cosine: PerJoint, sine: PerJoint,
                order: PerJoint, slope: PerJoint, edge: PerJoint, side: PerJoint,
                linear: PerJoint, square: PerJoint, speed: PerJoint, slowness: PerJoint,
                load: PerJoint, torque: PerJoint, driving: PerJoint, dry: PerJoint,
                ) -> tuple[np.ndarray, np.ndarray]:
    """Largest torque of a dry term [N m] against forward and against backward motion."""
    size = dry * term_size(q, dq, u, cosine, sine, order, slope, edge, side, linear, square,
                           speed, slowness, load, torque)
    pushed = np.tanh(_STEEPNESS * u / torque)
    return (size * (1.0 - 0.5 * driving * (1.0 - pushed)),
            size * (1.0 - 0.5 * driving * (1.0 + pushed)))


def smooth_term(q: np.ndarray, dq: np.ndarray, u: np.ndarray, cosine: PerJoint, sine: PerJoint,
                order: PerJoint, slope: PerJoint, edge: PerJoint, side: PerJoint,
                linear: PerJoint, square: PerJoint, speed: PerJoint, slowness: PerJoint,
                load: PerJoint, torque: PerJoint, driving: PerJoint, dry: PerJoint,
                odd: PerJoint, reversal: PerJoint) -> np.ndarray:
    """Torque of a term that does not stick [N m]; an odd one turns with the motion."""
    size = (1.0 - dry) * term_size(q, dq, u, cosine, sine, order, slope, edge, side, linear,
                                   square, speed, slowness, load, torque)
    way = direction(dq, reversal)
    pushed = np.tanh(_STEEPNESS * u / torque)
    return (size * (1.0 - odd + odd * way)
            * (1.0 - 0.5 * driving * (1.0 - pushed * way)))


TORQUE_TERM = Effect(
    name="torque_term", family="load", port="load",
    build=dry_friction(term_limits, inputs=("q", "dq", "u"), rest=smooth_term),
    parameters=(
        Parameter("cosine", "N m", -1e6, 1e6, 0.1, 0.0, "amplitude of the cosine over place"),
        Parameter("sine", "N m", -1e6, 1e6, 0.0, 0.0, "amplitude of the sine over place"),
        Parameter("slope", "N m/rad", -1e9, 1e9, 0.0, 0.0, "stiffness beyond an edge"),
        Parameter("order", "1", 0.0, 1e5, 0.0, None, "periods per turn; 0 anywhere alike"),
        Parameter("edge", "rad", -1e4, 1e4, 0.0, None, "place from which the slope counts"),
        Parameter("side", "1", -1.0, 1.0, 1.0, None, "the side of the edge: 1 above, -1 below"),
        Parameter("linear", "1", 0.0, 1.0, 0.0, None, "share that grows with the speed"),
        Parameter("square", "1", 0.0, 1.0, 0.0, None, "share that grows with its square"),
        Parameter("speed", "rad/s", 1e-9, 1e6, 1.0, None, "speed at which these are as stated"),
        Parameter("slowness", "s/rad", 0.0, 1e9, 0.0, None,
                  "inverse of the speed above which it fades; 0 at any speed"),
        Parameter("load", "1", 0.0, 1.0, 0.0, None, "share that grows with the carried torque"),
        Parameter("torque", "N m", 1e-12, 1e9, 1.0, None, "torque at which it is as stated"),
        Parameter("driving", "1", -1.0, 1.0, 0.0, None, "share that acts only while u drives"),
        Parameter("odd", "1", 0.0, 1.0, 0.0, None, "share that turns with the motion"),
        Parameter("reversal", "rad/s", 1e-9, 1e3, 1e-2, None, "speed at which it has turned"),
        Parameter("dry", "1", 0.0, 1.0, 0.0, None, "share that sticks, as dry friction does"),
        WIDTH,
    ),
    equation="tau = (cosine cos(order q) + sine sin(order q) + slope side max(side (q - edge), "
             "0)) (1 - linear - square + linear |dq|/speed + square (dq/speed)^2) "
             "exp(-(slowness dq)^2) (1 - load + load |u|/torque) "
             "(1 - odd + odd tanh(dq/reversal))",
    reference="S. Chen, S. A. Billings, W. Luo, Orthogonal least squares methods, Int. J. "
              "Control 50(5), 1989: how terms are chosen",
    signature="None: it describes what no effect of the catalogue explains.",
    confused_with={},
    simulators={"mujoco": "none", "isaac": "none", "gazebo": "none", "simscape": "none"},
    wrong="It names no cause, and says nothing of motions, loads and speeds that the logs do not "
          "hold.",
    symmetry="none", stiff=True,
)
