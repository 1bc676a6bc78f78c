"""Identification of a recorded robot by the paper's method and by its rivals, side by side."""

from clie_blocks.analysis.identification.identification import Bias, Identification, identify

__all__ = ["Bias", "Identification", "identify"]
