"""Public names and their modules, read by `lazy_loader`, type checkers and editors."""

from .robot_loop import robot_loop as robot_loop
