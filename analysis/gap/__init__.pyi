"""Public names and their modules, read by `lazy_loader`, type checkers and editors."""

from .batch import read as read
from .causes.vocabulary import searched_effects as searched_effects
from .diagnosis import Diagnosis as Diagnosis
from .interface import diagnose as diagnose
from .method.method import METHOD as METHOD
from .method.method import Method as Method
from .problem.problem import Problem as Problem

STAGES: tuple[str, ...]
