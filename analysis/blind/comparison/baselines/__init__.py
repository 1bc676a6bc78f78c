"""Methods that are in use today, each at its best practice, in the answer form of the diagnosis.

All of them see what the diagnosis sees: the logs, of which the last one is held out, the robot
file, the control law.  Each is a function from that, a `Problem`, to an answer.
"""

from collections.abc import Callable
from typing import Any

from clie_blocks.analysis.blind.comparison.baselines.inverse_dynamics import inverse_dynamics
from clie_blocks.analysis.blind.comparison.baselines.output_error import (
    friction_menu,
    simulator_fit,
)
from clie_blocks.analysis.blind.comparison.baselines.sparse_regression import sparse_regression
from clie_blocks.analysis.gap.problem.problem import Problem

BASELINES: dict[str, Callable[[Problem], dict[str, Any]]] = {
    "inverse dynamics, BIC": inverse_dynamics,
    "friction menu, closed loop": friction_menu,
    "sparse regression": sparse_regression,
    "simulator parameter fit": simulator_fit}
