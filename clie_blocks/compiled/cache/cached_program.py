"""Programs on disk: what an earlier process has compiled runs without its diagram.

Building a diagram, tracing it, comparing it and writing its text takes ten times as long as
reading all of it.  A program is found by its identity, which has to tell all that decides it: its
structure, and the sources that it comes from, see `sources`.
"""

import functools
import importlib.util
import zlib
from dataclasses import replace
from pathlib import Path

from clie_blocks.compiled.cache import store
from clie_blocks.compiled.cache.signature import described
from clie_blocks.compiled.codegen.vector_math import callable_here
from clie_blocks.compiled.ir.layout import Layout
from clie_blocks.compiled.runtime.api import Batches
from clie_blocks.compiled.runtime.inputs import bind
from clie_blocks.compiled.runtime.methods import SAMPLED


def recalled(identity, make):
    """Return a program in discrete time from the disk, or compile it and keep it for others.

    Parameters
    ----------
    identity : str
        Tells this program from all others.
    make : callable
        Gives the block or diagram in discrete time, where it has to be compiled.

    Returns
    -------
    Recalled or Program
        The latter where there is no machine code, or a block is called back.

    """
    made = functools.cache(lambda: _compiled(make()))
    stored = store.load(store.key(identity))
    if stored is None or importlib.util.find_spec("llvmlite") is None:
        program = made()
        if program.lanes == 1:
            return program
        stored = program.description.text().encode()
        store.save(store.key(identity), stored)
    return Recalled(identity, described(stored), made)


def _compiled(diagram):
    """Program of a diagram; python-control is imported here."""
    from clie_blocks.compiled.program import compile_diagram

    return compile_diagram(diagram)


@functools.cache
def sources(*packages):
    """Return one text for the present state of all sources of some packages.

    Parameters
    ----------
    *packages : str
        Their names.

    """
    files = [file for name in packages
             for place in importlib.util.find_spec(name).submodule_search_locations
             for file in sorted(Path(place).rglob("*.py"))]
    return store.key(*(file.read_text(encoding="utf-8") for file in files))


class Recalled(Batches):
    """A program that is known by name and run in batches; made by `recalled`.

    Its layout holds places instead of expressions: these are in the text that was kept.

    Parameters
    ----------
    identity : str
        Under which it is kept.
    description : Description
        What it tells of itself.
    made : callable
        Gives the program itself, for a text that is not there yet.

    """

    _engine = "llvm"

    def __init__(self, identity, description, made):
        self._identity, self.description = identity, description
        self._made, self._engines = made, {}
        self.name, self.period = description.name, description.period
        self.inputs, self.outputs = description.inputs, description.outputs
        self.states, self.signals = description.states, list(description.slots)
        self._parameters = description.parameters
        self._layout = Layout(list(range(len(self.states))), list(range(description.record)),
                              description.slots, len(self.inputs))

    def _drive(self, inputs, steps, step):
        return bind(None, self.inputs, inputs, steps, step)[0], self._layout

    def _step_of(self, step):
        return self.period

    def _build(self, arranged, method, memory):
        from clie_blocks.compiled.codegen.native import NativeEngine

        key = tuple(arranged.record), memory.key
        if key not in self._engines:
            text = self._text(arranged.record, memory)
            self._engines[key] = NativeEngine(arranged, SAMPLED, memory, lambda *parts: text)
        return self._engines[key]

    def _text(self, record, memory):
        name = store.key(self._identity, callable_here(), repr(list(record)), repr(memory.key))
        stored = store.load(name)
        if stored is not None:
            return zlib.decompress(stored).decode()
        from clie_blocks.compiled.codegen.native import module

        whole = self._made()._layout
        text = module(replace(whole, record=[whole.record[k] for k in record], slots={}),
                      SAMPLED, memory)
        store.save(name, zlib.compress(text.encode(), 1))
        return text
