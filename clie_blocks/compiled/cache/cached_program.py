"""Programs on disk: what an earlier process has compiled runs without its diagram.

Building a diagram, tracing it, comparing it and writing its text takes ten times as long as
reading the result.  A program is found by its identity, which must cover everything that the
program depends on: its structure, and the sources that it comes from, see `source_digest`.
"""

from __future__ import annotations

import contextlib
import functools
import gc
import importlib.util
import threading
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from clie_blocks.compiled.cache import store
from clie_blocks.compiled.cache.signature import Description, parse_description
from clie_blocks.compiled.codegen.engine import Engine
from clie_blocks.compiled.codegen.lane_layout import SINGLE, Memory
from clie_blocks.compiled.codegen.methods import SAMPLED
from clie_blocks.compiled.codegen.vector_math import callable_here
from clie_blocks.compiled.ir.layout import Layout
from clie_blocks.compiled.ir.symbols import Graph
from clie_blocks.compiled.runtime.api import Batches
from clie_blocks.compiled.runtime.inputs import Inputs, Rows, bind_inputs

if TYPE_CHECKING:
    import control as ct

    from clie_blocks.compiled.program import Program

_making = threading.RLock()  # what several threads need at a time is made once


def cached_program(identity: str,
                   make: Callable[[], ct.NonlinearIOSystem]) -> CachedProgram | Program:
    """Return a program in discrete time from the disk, or compile it and store it for others.

    Parameters
    ----------
    identity : str
        Distinguishes this program from all others.
    make : callable
        Returns the block or diagram in discrete time, where it has to be compiled.

    Returns
    -------
    CachedProgram or Program
        The latter where there is no machine code, or a block is called back.

    """
    compiled = functools.cache(lambda: _compile(make()))
    with _making:
        stored = store.load(store.key(identity))
        if stored is None or importlib.util.find_spec("llvmlite") is None:
            program = compiled()
            if program.lanes == 1:
                return program
            stored = program.description.text().encode()
            store.save(store.key(identity), stored)
    return CachedProgram(identity, parse_description(stored), compiled)


def _compile(diagram: ct.NonlinearIOSystem) -> Program:
    """Program of a diagram; python-control is imported here.

    Programs come by the dozen, share their blocks and run in batches only: each is compared at a
    few points, traced once, and without machine code for single runs.
    """
    from clie_blocks.compiled.frontend.callbacks import warn_of_callbacks
    from clie_blocks.compiled.program import QUICK_POINTS, Program
    from clie_blocks.compiled.verification import check

    with _without_collection():
        program = Program(diagram, repeated=False)
        check(program.interpreted(), diagram, QUICK_POINTS)
    warn_of_callbacks(program.name, program.callbacks)
    return program


@contextlib.contextmanager
def _without_collection() -> Iterator[None]:
    """Collect no cycles meanwhile: of the many objects of a program none is part of one."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


@functools.cache
def source_digest(*packages: str) -> str:
    """Return a digest of all source files of some packages, subfolders included."""
    specs = [importlib.util.find_spec(name) for name in packages]
    files = [file for spec in specs if spec
             for folder in spec.submodule_search_locations or ()
             for file in sorted(Path(folder).rglob("*.py"))]
    return store.key(*(file.read_text(encoding="utf-8") for file in files))


class CachedProgram(Batches):
    """A program that is known by its description and runs in batches; see `cached_program`.

    Its code is not optimised: the runs of a fit, many of them side by side, gain nothing by that.

    Its layout holds indices instead of expressions: these are in the text on disk.

    Parameters
    ----------
    identity : str
        Under which it is stored.
    description : Description
        Its labels and sizes.
    compiled : callable
        Returns the program itself, for a text that is not stored yet.

    """

    _engine = "llvm"

    def __init__(self, identity: str, description: Description,
                 compiled: Callable[[], Program]) -> None:
        self._identity, self.description, self._compiled = identity, description, compiled
        self._engines: dict[tuple, Engine] = {}
        self.name, self.period = description.name, description.period
        self.operations = description.operations
        self.inputs, self.outputs = description.inputs, description.outputs
        self.states, self.signals = description.states, list(description.slots)
        self._parameters = description.parameters
        self._layout = Layout(list(range(len(self.states))), list(range(description.record)),
                              description.slots, len(self.inputs))

    def _drive(self, inputs: Inputs, steps: int, step: float) -> tuple[Rows, Layout]:
        return bind_inputs(Graph(), self.inputs, inputs, steps, step)[0], self._layout

    def _step_of(self, step: float | None) -> float:
        return self.period or 1.0

    def _build(self, arranged: Layout, method_name: str, memory: Memory = SINGLE) -> Engine:
        from clie_blocks.compiled.codegen.native import NativeEngine

        key = tuple(arranged.record), memory.key
        with _making:
            if key not in self._engines:
                entries = [k for k in arranged.record if isinstance(k, int)]
                text = self._text(entries, memory)
                self._engines[key] = NativeEngine(arranged, SAMPLED, memory, text,
                                                  is_brief=True)
            return self._engines[key]

    def _text(self, record: list[int], memory: Memory) -> str:
        name = store.key(self._identity, callable_here(), repr(record), repr(memory.key))
        stored = store.load(name)
        if stored is not None:
            return zlib.decompress(stored).decode()
        with _without_collection():
            text = self._compiled().machine_text(record, memory)
        store.save(name, zlib.compress(text.encode(), 1))
        return text
