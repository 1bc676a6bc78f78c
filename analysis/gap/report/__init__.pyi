"""Public names and their modules, read by `lazy_loader`, type checkers and editors."""

from .document import document as document
from .exports import corrected_model as corrected_model
from .files import write_report as write_report
