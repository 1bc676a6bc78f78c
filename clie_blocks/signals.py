"""Port labels, the checks on parameters, and the strict `interconnect`.

python-control joins blocks by name and forgives mistakes in silence: equal parameter keys are
merged, unknown keys ignored, outputs of one name summed, unused signals only warned about, and a
block that stands in two diagrams carries its last parameters from one to the other.  This is the
one place where those traps are closed; every diagram of the package is built through it.
"""

import copy
from collections.abc import Iterable, Mapping, Sequence

import control as ct
import numpy as np

from clie_blocks.errors import nearest
from clie_blocks.labels import DiagramError, ports, signals, vector

__all__ = ["Diagram", "DiagramError", "check_params", "interconnect", "ports", "signal",
           "signals", "summing", "vector"]

Terminal = tuple[int, int]  # position of a block, and of one of its signals


def signal(response: ct.TimeResponseData, name: str) -> np.ndarray:
    """Vector signal of a response, such as ``signal(response, 'theta_hat')``.

    Parameters
    ----------
    response : control.TimeResponseData
        The response of a diagram.
    name : str
        Base name of an output.

    Returns
    -------
    ndarray, shape (n, samples)
        Its rows.

    Raises
    ------
    DiagramError
        If the response has no such output.

    """
    groups = ports(response.output_labels)
    if name not in groups:
        raise DiagramError(f"the response has no output {name!r}; {nearest(name, groups)}")
    rows = np.asarray(response.outputs).reshape(len(response.output_labels), -1)
    return rows[groups[name]]


class Diagram(ct.InterconnectedSystem):
    """An `InterconnectedSystem` that refuses parameters which none of its blocks has."""

    nested = False

    def _update_params(self, params: Mapping | None) -> None:
        if not self.nested:
            check_params(self, params)
        super()._update_params(params)


def check_params(system: ct.NonlinearIOSystem, params: Mapping | None) -> None:
    """Refuse a parameter that no block of the system has.

    Parameters
    ----------
    system : control.NonlinearIOSystem
        A block or a diagram.
    params : dict or None
        New values by key.

    Raises
    ------
    DiagramError
        Names the key and the nearest valid one; python-control ignores it silently.

    """
    known = {} if system.params is None else system.params
    for key in params or {}:
        if key not in known:
            raise DiagramError(
                f"{system.name}: no block has the parameter {key!r}; {nearest(key, known)}")


def interconnect(blocks: Sequence[ct.NonlinearIOSystem], connections: Sequence[tuple[str, ...]], *,
                 inputs: Mapping[str, str | Sequence[str]], outputs: Mapping[str, str], name: str,
                 unused: Iterable[str] = ()) -> Diagram:
    """Join blocks into a diagram, with every silent trap of `control.interconnect` an error.

    Parameters
    ----------
    blocks : list of control.NonlinearIOSystem or control.StateSpace
        The blocks; they are copied, so that no two diagrams share a block.
    connections : list of (str, str, ...)
        ``('plant.u', 'pd.u')`` wires an input port to an output port, whole vectors at a time;
        further sources are added, ``'-load.tau'`` subtracts.
    inputs : dict
        Diagram input to the block input port, or the list of ports, that it feeds.
    outputs : dict
        Diagram output to the block output port that it shows.
    name : str
        Name of the diagram.
    unused : iterable of str
        Output ports that are left open on purpose, such as ``'model.dq'``.

    Returns
    -------
    Diagram
        A `control.InterconnectedSystem`; its `params` are the union of those of its blocks.

    Raises
    ------
    DiagramError
        For two blocks of one name, a port that does not exist, sizes that differ, an input that
        nothing drives, an output that nothing reads, or one parameter key with two values.

    References
    ----------
    The traps, each shown against plain python-control, are in `tests/blocks/test_signals.py`.

    """
    blocks = _own_copies(blocks, name)
    index = {block.name: k for k, block in enumerate(blocks)}
    wiring = _Wiring(name, blocks, index)
    for target, *sources in connections:
        wiring.join(target, sources)
    inplist, input_labels = wiring.feed(inputs)
    outlist, output_labels = wiring.show(outputs)
    wiring.refuse_loose_ends(unused)
    return Diagram(
        blocks, connections=wiring.connections, inplist=inplist, outlist=outlist,
        inputs=input_labels, outputs=output_labels, params=_shared_params(blocks), name=name)


def summing(*terms: str, output: str, n: int, name: str) -> ct.StateSpace:
    """Summing junction of vectors, a real LTI block: ``summing('u_model', '-u', ...)``.

    Inputs: one port per term.  Outputs: `output`.  No state.

    Parameters
    ----------
    *terms : str
        Port names; a leading minus subtracts.
    output : str
        Name of the output port.
    n : int
        Length of the vectors.
    name : str
        Name of the block.

    """
    signs = [-1.0 if term.startswith("-") else 1.0 for term in terms]
    gain = np.hstack([sign * np.eye(n) for sign in signs])
    return ct.ss([], [], [], gain, name=name, outputs=signals(output, n=n),
                 inputs=signals(*(term.lstrip("-") for term in terms), n=n))


class _Wiring:
    """Named wires as python-control's index tuples, each end checked."""

    def __init__(self, name: str, blocks: Sequence[ct.NonlinearIOSystem],
                 index: Mapping[str, int]) -> None:
        self.name, self.blocks, self.index = name, blocks, index
        self.connections: list[list] = []
        self.driven: set[Terminal] = set()
        self.read: set[Terminal] = set()

    def join(self, target: str, sources: Sequence[str]) -> None:
        into = self._find(target, "input")
        for source in sources:
            sign, start = (-1.0, source[1:]) if source.startswith("-") else (1.0, source)
            out = self._find(start, "output")
            if len(into) != len(out):
                raise DiagramError(
                    f"{self.name}: {target} has {len(into)} signals but {start} has {len(out)}; "
                    "build both blocks for the same number of joints")
            self.read |= set(out)
            self.connections += [[i, (*o, sign)] for i, o in zip(into, out)]
        self._drive(target, into)

    def feed(self, inputs: Mapping[str, str | Sequence[str]]) -> tuple[list, list[str]]:
        inplist, labels = [], []
        for label, targets in inputs.items():
            targets = [targets] if isinstance(targets, str) else list(targets)
            found = [self._find(target, "input") for target in targets]
            if len({len(into) for into in found}) != 1:
                raise DiagramError(
                    f"{self.name}: input {label!r} feeds ports of different sizes: {targets}")
            for target, into in zip(targets, found):
                self._drive(target, into)
            inplist += [list(group) for group in zip(*found)]
            labels += self._labels(label, targets[0], "input")
        return inplist, labels

    def show(self, outputs: Mapping[str, str]) -> tuple[list, list[str]]:
        outlist, labels = [], []
        for label, source in outputs.items():
            out = self._find(source, "output")
            self.read |= set(out)
            outlist += out
            labels += self._labels(label, source, "output")
        return outlist, labels

    def refuse_loose_ends(self, unused: Iterable[str]) -> None:
        for port in unused:
            self.read |= set(self._find(port, "output"))
        for k, block in enumerate(self.blocks):
            for kind, labels, used in (("input", block.input_labels, self.driven),
                                       ("output", block.output_labels, self.read)):
                loose = [label for i, label in enumerate(labels) if (k, i) not in used]
                if loose and kind == "input":
                    raise DiagramError(f"{self.name}: nothing drives {block.name}.{loose[0]}; "
                                       f"add a connection to it or make it a diagram input")
                if loose:
                    raise DiagramError(
                        f"{self.name}: nothing reads {block.name}.{loose[0]}; connect it, show "
                        f"it as a diagram output, or list it in unused=")

    def _drive(self, target: str, into: list[Terminal]) -> None:
        if self.driven & set(into):
            raise DiagramError(f"{self.name}: {target} is driven twice; python-control would add "
                               "both; write the sources of a sum in one connection")
        self.driven |= set(into)

    def _find(self, port: str, kind: str) -> list[Terminal]:
        block_name, dot, base = port.rpartition(".")
        if not dot or block_name not in self.index:
            raise DiagramError(f"{self.name}: no block {block_name or port!r} for the {kind} "
                               f"{port!r}; write 'block.port'; {nearest(block_name, self.index)}")
        k = self.index[block_name]
        labels = getattr(self.blocks[k], f"{kind}_labels")
        found = {**ports(labels), **{label: [i] for i, label in enumerate(labels)}}
        if base not in found:
            raise DiagramError(f"{self.name}: block {block_name!r} has no {kind} {base!r}; "
                               f"{nearest(base, ports(labels))}")
        return [(k, i) for i in found[base]]

    def _labels(self, label: str, port: str, kind: str) -> list[str]:
        block_name, _, base = port.rpartition(".")
        labels = getattr(self.blocks[self.index[block_name]], f"{kind}_labels")
        return [label] if base in labels else signals(label, n=len(ports(labels)[base]))


def _own_copies(blocks: Sequence[ct.NonlinearIOSystem], name: str) -> list[ct.NonlinearIOSystem]:
    seen: set[str] = set()
    for block in blocks:
        if block.name in seen:
            raise DiagramError(f"{name}: two blocks are called {block.name!r}; "
                               "give each its own name=")
        seen.add(block.name)
    copies = [copy.deepcopy(block) for block in blocks]
    for block in copies:
        if isinstance(block, Diagram):
            block.nested = True
    return copies


def _shared_params(blocks: Sequence[ct.NonlinearIOSystem]) -> dict[str, np.ndarray]:
    merged: dict[str, np.ndarray] = {}
    owner: dict[str, str] = {}
    for block in blocks:
        for key, value in (getattr(block, "params", None) or {}).items():
            if key in merged and not np.array_equal(merged[key], value):
                raise DiagramError(
                    f"parameter {key!r} is {merged[key]} in block {owner[key]!r} but {value} in "
                    f"{block.name!r}; python-control would silently use the last one in both. "
                    f"Give it one value, or qualify the key, e.g. '{block.name}.{key}'")
            merged[key], owner[key] = value, block.name
    return merged
