"""Public names and their modules, read by `lazy_loader`, type checkers and editors."""

from .document import document as document
from .files import write_report as write_report
