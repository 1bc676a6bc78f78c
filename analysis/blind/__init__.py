"""Blind trials: robots of an independent engine whose hidden effects the diagnosis cannot know.

The bodies move in MuJoCo; drives and sampled controllers are written here anew, and nothing comes
from the package's own effects.  The folders in the order of the work: engine, population,
protocol, scoring, comparison, report.
"""
