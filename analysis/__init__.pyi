"""Public names and their modules, read by `lazy_loader`, type checkers and editors."""

from . import gap as gap
