"""Public names and their modules, read by `lazy_loader`, type checkers and editors."""

from .contact import sticking as sticking
from .effect import Effect as Effect
from .effect import Setting as Setting
from .insertion import with_effects as with_effects
from .library import LIBRARY as LIBRARY
from .library import Library as Library
from .library import UnknownEffectError as UnknownEffectError
from .parameter import Parameter as Parameter
from .registration import register as register
from .registration import register_file as register_file
