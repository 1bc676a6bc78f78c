"""Control laws, one per file: those of the paper in continuous time, and sampled ones."""

from clie_blocks.controllers.cascade import sampled_cascade
from clie_blocks.controllers.dead_band import with_dead_band
from clie_blocks.controllers.feedforward import with_feedforward
from clie_blocks.controllers.inverse_dynamics import with_inverse_dynamics
from clie_blocks.controllers.law_in_c import law_in_c
from clie_blocks.controllers.limits import with_rate_limit, with_torque_speed
from clie_blocks.controllers.linearizing import linearizing_controller, linearizing_torque
from clie_blocks.controllers.pd import pd_controller, pd_torque
from clie_blocks.controllers.pid import sampled_pid
from clie_blocks.controllers.sampled import VelocityFilter
from clie_blocks.controllers.side_by_side import laws_side_by_side
from clie_blocks.controllers.signal_filters import with_filter
from clie_blocks.controllers.weight_compensation import with_weight_compensation

__all__ = ["VelocityFilter", "law_in_c", "laws_side_by_side", "linearizing_controller",
           "linearizing_torque", "pd_controller", "pd_torque", "sampled_cascade", "sampled_pid",
           "with_dead_band", "with_feedforward", "with_filter", "with_inverse_dynamics",
           "with_rate_limit", "with_torque_speed", "with_weight_compensation"]
