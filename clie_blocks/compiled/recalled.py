"""Programs on disk: what an earlier process has compiled runs without its diagram.

Building a diagram, tracing it, comparing it and writing its text takes ten times as long as
reading all of it.  A program is found by its identity, which has to tell all that decides it: its
structure, and the sources that it comes from, see `sources`.
"""

import functools
import importlib.util
import json
import types
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np

from clie_blocks.compiled import cache
from clie_blocks.compiled.inputs import bind
from clie_blocks.compiled.layout import Layout
from clie_blocks.compiled.methods import SAMPLED
from clie_blocks.compiled.parameters import Parameters
from clie_blocks.compiled.studies import Studies
from clie_blocks.compiled.vector_math import callable_here


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
    stored = cache.load(cache.key(identity))
    if stored is None or importlib.util.find_spec("llvmlite") is None:
        program = made()
        if program.lanes == 1:
            return program
        stored = json.dumps(_description(program)).encode()
        cache.save(cache.key(identity), stored)
    return Recalled(identity, json.loads(stored), made)


def _compiled(diagram):
    """Program of a diagram; python-control is imported here."""
    from clie_blocks.compiled.program import compile_diagram

    return compile_diagram(diagram)


def _description(program):
    """What `Recalled` knows of a program, in plain types."""
    parameters = program._trace.parameters
    return {"name": program.name, "inputs": program.inputs, "outputs": program.outputs,
            "states": program.states, "period": program.period,
            "slots": program._layout.slots, "record": len(program._layout.record),
            "offset": parameters.offset, "shape": parameters.shape,
            "defaults": parameters.defaults.tolist(), "frozen": sorted(parameters.frozen)}


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
    return cache.key(*(file.read_text(encoding="utf-8") for file in files))


class Recalled(Studies):
    """A program that is known by name and run in batches; made by `recalled`.

    Entries of its record are numbers, not expressions: these are in the text that was kept.

    Parameters
    ----------
    identity : str
        Under which it is kept.
    told : dict
        Its description.
    made : callable
        Gives the program itself, for a text that is not there yet.

    """

    _engine = "llvm"

    def __init__(self, identity, told, made):
        self._identity, self._made, self._engines = identity, made, {}
        self.name, self.inputs, self.outputs = told["name"], told["inputs"], told["outputs"]
        self.states = [tuple(state) for state in told["states"]]
        self.signals, self.period = list(told["slots"]), told["period"]
        parameters = Parameters(told["offset"],
                                {key: tuple(shape) for key, shape in told["shape"].items()},
                                np.array(told["defaults"]), set(told["frozen"]))
        self._trace = types.SimpleNamespace(graph=None, parameters=parameters, opaque=[])
        self._layout = Layout(list(range(len(self.states))), list(range(told["record"])),
                              told["slots"], len(self.inputs))

    def _drive(self, inputs, steps, step):
        return bind(None, self.inputs, inputs, steps, step)[0], self._layout

    def _step_of(self, step):
        return self.period

    def _build(self, arranged, method, memory):
        from clie_blocks.compiled.native import NativeEngine

        key = tuple(arranged.record), memory.key
        if key not in self._engines:
            text = self._text(arranged.record, memory)
            self._engines[key] = NativeEngine(arranged, SAMPLED, memory, lambda *parts: text)
        return self._engines[key]

    def _text(self, record, memory):
        name = cache.key(self._identity, callable_here(), repr(list(record)), repr(memory.key))
        stored = cache.load(name)
        if stored is not None:
            return zlib.decompress(stored).decode()
        from clie_blocks.compiled.native import module

        whole = self._made()._layout
        text = module(replace(whole, record=[whole.record[k] for k in record], slots={}),
                      SAMPLED, memory)
        cache.save(name, zlib.compress(text.encode(), 1))
        return text
