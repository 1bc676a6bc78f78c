"""Public names and their modules, read by `lazy_loader`, type checkers and editors."""

from .codegen.methods import METHODS as METHODS
from .frontend.callbacks import OpaqueBlockWarning as OpaqueBlockWarning
from .ir.symbols import TraceError as TraceError
from .program import Program as Program
from .program import compile_diagram as compile_diagram
from .runtime.batch import Batch as Batch
from .runtime.events import Stop as Stop
from .runtime.inputs import InputError as InputError
from .runtime.inputs import held_normal as held_normal
from .runtime.sensitivities import Derivatives as Derivatives
from .sampling.loop import SampledProgram as SampledProgram
from .sampling.loop import sampled as sampled
from .verification import CompiledDifferenceError as CompiledDifferenceError
