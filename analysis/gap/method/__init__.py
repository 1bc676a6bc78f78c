"""Every threshold of the diagnosis, with unit and reason, as one `Method`."""

from clie_blocks.analysis.gap.method.calibration import Calibration, load_calibration
from clie_blocks.analysis.gap.method.method import METHOD, Method

__all__ = ["METHOD", "Calibration", "Method", "load_calibration"]
