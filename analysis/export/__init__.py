"""A diagnosed correction in the simulator that the user has: one file per target.

`correction` reads an answer, `joint_block` makes one block per joint from the effects' own
kernels, and the targets put it where the simulator takes it.
"""
