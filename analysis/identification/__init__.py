"""Identification of a recorded robot by the method of the paper and by its alternatives."""

from clie_blocks.analysis.identification.identification import Bias, Identification, identify

__all__ = ["Bias", "Identification", "identify"]
