"""Blind trials: robots of an independent engine whose hidden effects the diagnosis cannot know.

The bodies move in MuJoCo, the drives and the sampled controllers are written here anew; nothing
comes from the package's own effects.  The order of work: robot, motion, hidden effect, size,
trial, seal, score, page.
"""
