"""Elementary functions of several lanes in one call, where the C library has them.

glibc brings sin, cos, exp and others for 2, 4 and 8 numbers at once (libmvec); eight take about
as long as one, and they are off by 4 units in the last place at most.  Without the library every
lane calls the scalar function.
"""

import ctypes
import functools

KINDS = {8: ("avx512f", "_ZGVeN8"), 4: ("avx2", "_ZGVdN4"), 2: ("sse2", "_ZGVbN2")}


def vector_function(name: str, width: int, operands: int = 1) -> tuple[str, int] | None:
    """Return the symbol of a function of vectors and their length; None where there is none."""
    for length, (feature, prefix) in KINDS.items():
        symbol = f"{prefix}{'v' * operands}_{name}"
        if width % length == 0 and feature in _features() and hasattr(_library(), symbol):
            return symbol, length
    return None


def callable_here() -> str:
    """Load the library, and return what of it a text may call on this processor."""
    return " ".join(prefix for feature, prefix in KINDS.values()
                    if _library() and feature in _features())


def has_fused_multiplication() -> bool:
    """Return whether this processor multiplies and adds with one rounding."""
    return bool({"fma", "neon"} & _features())


@functools.cache
def _library() -> ctypes.CDLL | None:
    """The library, its functions visible to the code that is linked later; None without it."""
    try:
        return ctypes.CDLL("libmvec.so.1", mode=ctypes.RTLD_GLOBAL)
    except OSError:
        return None


@functools.cache
def _features() -> set[str]:
    import llvmlite.binding as llvm

    return {name for name, present in llvm.get_host_cpu_features().items() if present}
