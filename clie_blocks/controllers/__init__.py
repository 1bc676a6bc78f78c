"""Control laws, one per file: those of the paper in continuous time, and sampled ones."""

from clie_blocks.controllers.cascade import sampled_cascade
from clie_blocks.controllers.linearizing import linearizing_controller, linearizing_torque
from clie_blocks.controllers.pd import pd_controller, pd_torque
from clie_blocks.controllers.pid import sampled_pid
from clie_blocks.controllers.sampled import VelocityFilter
from clie_blocks.controllers.weight_compensation import with_weight_compensation

__all__ = ["VelocityFilter", "linearizing_controller", "linearizing_torque", "pd_controller",
           "pd_torque", "sampled_cascade", "sampled_pid", "with_weight_compensation"]
