"""LLVM text to machine code that Python can call."""

import ctypes
import functools
import itertools
import threading
from collections.abc import Callable
from typing import Any

import llvmlite
import llvmlite.binding as llvm

from clie_blocks.compiled.cache import store

_LARGE = 1500  # lines, from which passes take long and gain nothing: no operation stands twice
_lock, _library = threading.Lock(), itertools.count()
_state: dict[str, Any] = {}  # the processor and the linker, made at the first use


class Machine:
    """Loaded machine code; functions live as long as this object.

    Parameters
    ----------
    text : str
        LLVM module.
    names : list of str
        Functions that are called from Python.
    imported : dict, optional
        Address by name of the functions that the code calls, but for those of the C library.
    is_brief : bool
        The code runs for about as long as its optimisation would take.

    """

    def __init__(self, text: str, names: list[str], imported: dict[str, int] | None = None,
                 is_brief: bool = False) -> None:
        with _lock:
            target, jit = _target(1 if is_brief else 2), _jit()
            optimised = not is_brief and text.count("\n") < _LARGE
            name = store.key(text, str(optimised), str(is_brief), llvmlite.__version__,
                             str(llvm.llvm_version_info), target.triple, llvm.get_host_cpu_name(),
                             llvm.get_host_cpu_features().flatten())
            tracker = _linked_from_cache(jit, name, names, imported or {})
            self.cached = tracker is not None
            if tracker is None:
                code = _compile(text, target, optimised)
                tracker = _link(jit, code, names, imported or {})
                store.save(name, code)
            self._tracker = tracker

    def address(self, name: str) -> int:
        """Return the address of a function."""
        return self._tracker[name]

    def function(self, name: str, *types: type, result: type | None = None) -> Callable[..., Any]:
        """Return a function as a callable that frees the interpreter lock while it runs."""
        return ctypes.CFUNCTYPE(result, *types)(self.address(name))


@functools.cache
def lane_width() -> int:
    """Return how many runs of a small program this processor does best side by side.

    They fill two registers: operations of one go on while those of the other wait for results.
    """
    return 2 * register_width()


@functools.cache
def register_width() -> int:
    """Return how many numbers a register of this processor holds."""
    with _lock:
        _target(2)
    features = llvm.get_host_cpu_features()
    return 8 if features.get("avx512f") else 4 if features.get("avx") else 2


def _target(level: int) -> llvm.TargetMachine:
    """The processor, for code that takes more or less time to make; level 1 saves a tenth."""
    name = f"target {level}"
    if name not in _state:
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
        _state[name] = llvm.Target.from_default_triple().create_target_machine(
            cpu=llvm.get_host_cpu_name(), features=llvm.get_host_cpu_features().flatten(),
            opt=level, jit=True)
    return _state[name]


def _jit() -> llvm.LLJIT:
    if "jit" not in _state:
        _state["jit"] = llvm.create_lljit_compiler()
    return _state["jit"]


def _compile(text: str, target: llvm.TargetMachine, optimised: bool) -> bytes:
    module = llvm.parse_assembly(text)
    module.verify()
    options = llvm.create_pipeline_tuning_options(speed_level=2 if optimised else 0)
    options.loop_vectorization, options.slp_vectorization = True, optimised
    builder = llvm.create_pass_builder(target, options)
    builder.getModulePassManager().run(module, builder)
    return target.emit_object(module)


def _linked_from_cache(jit: llvm.LLJIT, name: str, names: list[str],
                       imported: dict[str, int]) -> llvm.ResourceTracker | None:
    stored = store.load(name)
    try:
        return _link(jit, stored, names, imported) if stored else None
    except RuntimeError:  # sound bytes, but not code that links here
        return None


def _link(jit: llvm.LLJIT, code: bytes, names: list[str],
          imported: dict[str, int]) -> llvm.ResourceTracker:
    library = llvm.JITLibraryBuilder().add_object_img(code).add_current_process()
    for name in names:
        library.export_symbol(name)
    for name, address in imported.items():
        library.import_symbol(name, address)
    return library.link(jit, f"clie_blocks_{next(_library)}")
