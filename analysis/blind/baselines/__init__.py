"""Methods that users have today, each at its best practice, in the answer form of the diagnosis.

All of them see what the diagnosis sees: the logs, the robot file, the control law that ran.
"""

from clie_blocks.analysis.blind.baselines.friction_menu import friction_menu
from clie_blocks.analysis.blind.baselines.inverse_dynamics import inverse_dynamics
from clie_blocks.analysis.blind.baselines.simulator_fit import simulator_fit
from clie_blocks.analysis.blind.baselines.sparse_regression import sparse_regression

BASELINES = {
    "inverse dynamics, BIC": inverse_dynamics,
    "friction menu, closed loop": friction_menu,
    "sparse regression": sparse_regression,
    "simulator parameter fit": simulator_fit,
}
