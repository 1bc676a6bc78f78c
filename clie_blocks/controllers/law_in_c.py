"""A function in C, such as the firmware of a robot has, as the block of a control law."""

from __future__ import annotations

import ctypes
import tempfile
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.compiled.c_trial import GAP, ORDINARY, READS, SECONDS, WRITES, tried
from clie_blocks.compiled.frontend.foreign import ForeignCall
from clie_blocks.compiled.ir.foreign import ForeignFunction
from clie_blocks.compiled.system_compiler import compiled_library, preprocessed
from clie_blocks.controllers.c_prototype import (
    INPUT,
    OUTPUT,
    PARAMETER,
    STATE,
    Argument,
    arguments_of,
)
from clie_blocks.errors import ClieError, nearest
from clie_blocks.labels import DiagramError

STEP, TRIAL = "clie_step", "clie_trial"  # functions of the wrapper
Params = Mapping[str, np.ndarray]
Placed = list[tuple[Argument, int, int]]  # argument, its place and its size


def law_in_c(path: str | PathLike[str], function: str, n: int, period: float | bool, *,
             parameters: Mapping[str, ArrayLike] | None = None) -> ct.NonlinearIOSystem:
    """Control law that a function in C computes, once per sample.

    ``void controller(const double q_d[], const double q[], const double kp[], ..., double
    integral[], double u[])``: the names of the arguments say what they are.  ``q_d``, ``q``
    [rad], ``pe`` [unit of u], ``dq`` [rad/s] and ``tau`` [unit of u] are inputs, as of any law of
    `robot_loop`; ``u`` is the command; other const arrays, and numbers, are parameters; other
    arrays are states, which begin at zero and which the function replaces by those of the next
    sample.  An array without a length has one number per joint.

    The function is compiled by the system's C compiler, tried in a process of its own, and called
    by compiled programs at its address.  A static variable is a memory that no one else sees, and
    is refused.  What it writes past the end of an argument is refused where the trial shows it.

    Parameters
    ----------
    path : path-like
        The file in C.
    function : str
        Name of the function.
    n : int
        Number of joints.
    period : float or True
        Sample time [s]; True for that of the logs.
    parameters : mapping of str to array_like, optional
        Value of every parameter by its name; a single number stands for all of an array.

    Returns
    -------
    control.NonlinearIOSystem
        The block, in discrete time, whose parameters may be fitted.

    Raises
    ------
    DiagramError
        If an argument is not what a law has, a parameter has no value, or a value no parameter.
    ClieError
        If it does not compile, with the line; crashes, does not return, or keeps a memory.

    """
    file = Path(path)
    text = preprocessed(file)
    arguments = arguments_of(text, function, file)
    values = _values(arguments, parameters or {}, n, f"{file}: {function}")
    sizes = [_size(one, n, values, f"{file}: {function}") for one in arguments]
    sized = [(one, size) for one, size in zip(arguments, sizes)]
    groups = {kind: [(one, size) for one, size in sized if one.kind == kind]
              for kind in (INPUT, STATE, PARAMETER, OUTPUT)}
    call = ForeignCall(_loaded(file, text, function, sized, groups, values))
    states = sum(size for _, size in groups[STATE])
    keys = [one.name for one, _ in groups[PARAMETER]]

    def update(t: float, x: np.ndarray, u: np.ndarray, params: Params) -> np.ndarray:
        return call(u, x, *[params[key] for key in keys])[:states]

    def output(t: float, x: np.ndarray, u: np.ndarray, params: Params) -> np.ndarray:
        return call(u, x, *[params[key] for key in keys])[states:]

    return ct.nlsys(update, output, name=function, dt=period, params=values,
                    inputs=_labels(groups[INPUT]), outputs=_labels(groups[OUTPUT]),
                    states=_labels(groups[STATE]))


def _labels(group: Sequence[tuple[Argument, int]]) -> list[str]:
    return [f"{one.name}[{k}]" for one, size in group for k in range(size)]


def _values(arguments: Sequence[Argument], given: Mapping[str, ArrayLike], n: int, where: str,
            ) -> dict[str, np.ndarray]:
    """Values of the parameters, in the order of the arguments."""
    wanted = {one.name: one for one in arguments if one.kind == PARAMETER}
    unknown = next((key for key in given if key not in wanted), None)
    if unknown is not None:
        raise DiagramError(f"{where} has no parameter {unknown!r}; {nearest(unknown, wanted)}")
    missing = [key for key in wanted if key not in given]
    if missing:
        raise DiagramError(f"{where} takes the parameters {', '.join(wanted)}, and no value is "
                           f"stated for {', '.join(missing)}; write them into [controller] of the "
                           f"robot file, parameters = {{ {missing[0]} = 1.0 }}; an array that the "
                           "law itself changes is a state, without const")
    values = {}
    for key, one in wanted.items():
        value = np.asarray(given[key], float)
        size = one.size if one.size is not None else n if value.size == 1 else value.size
        if value.ndim > 1 or value.size not in (1, size) or not np.isfinite(value).all():
            raise DiagramError(f"{where}: the parameter {key} holds {size} "
                               f"number{'s' * (size > 1)}, got {np.asarray(given[key]).tolist()}")
        values[key] = (np.array(value.reshape(-1)[0]) if one.by_value
                       else np.full(size, value) if value.size == 1 else np.array(value))
    return values


def _size(one: Argument, n: int, values: Mapping[str, np.ndarray], where: str) -> int:
    if one.kind == PARAMETER:
        return values[one.name].size
    if one.kind in (INPUT, OUTPUT) and one.size not in (None, n):
        raise DiagramError(f"{where}: {one.name} has {one.size} numbers and the robot {n} joints; "
                           "every joint needs one")
    return n if one.size is None else one.size


def _loaded(file: Path, text: str, function: str, sized: Sequence[tuple[Argument, int]],
            groups: Mapping[str, list[tuple[Argument, int]]], values: Params) -> ForeignFunction:
    """Compile, try and load a function."""
    operands = [*groups[INPUT], *groups[STATE], *groups[PARAMETER]]
    results = [*groups[STATE], *groups[OUTPUT]]
    wrapper = "\n".join(_wrapper(name, function, sized, _placed(operands, gap),
                                 _placed(results, gap)) for name, gap in ((STEP, 0), (TRIAL, GAP)))
    digest, library = compiled_library(file, text, wrapper)
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / f"{file.stem}.so"
        made.write_bytes(library)
        _try(file, function, made, _placed(operands, GAP), _placed(results, GAP), values)
        return ForeignFunction(digest, ctypes.CDLL(str(made)), STEP,
                               sum(size for _, size in operands), sum(size for _, size in results))


def _placed(group: Sequence[tuple[Argument, int]], gap: int) -> Placed:
    """Arguments with their places in one array, a gap before and behind each of them."""
    placed, place = [], gap
    for one, size in group:
        placed.append((one, place, size))
        place += size + gap
    return placed


def _wrapper(name: str, function: str, sized: Sequence[tuple[Argument, int]], operands: Placed,
             results: Placed) -> str:
    """C text of ``name(operands, results)``, which gives each argument its part of the two."""
    given = {one.name: place for one, place, _ in operands}
    made = {one.name: place for one, place, _ in results}
    lines = [f"void {name}(const double *clie_given, double *clie_made)", "{"]
    lines += [f"    for (int clie_k = 0; clie_k < {size}; clie_k++) clie_made[{place} + clie_k] = "
              f"clie_given[{given[one.name]} + clie_k];"
              for one, place, size in results if one.kind == STATE]
    passed = [f"clie_given[{given[one.name]}]" if one.by_value
              else f"clie_made + {made[one.name]}" if one.name in made
              else f"(double *)(clie_given + {given[one.name]})" for one, _ in sized]
    return "\n".join([*lines, f"    {function}({', '.join(passed)});", "}", ""])


def _try(file: Path, function: str, library: Path, operands: Placed, results: Placed,
         values: Params) -> None:
    """Refuse a function that its trial shows to be none of its arguments."""
    def listed(placed: Placed, kind: str) -> list[tuple[str, int, int]]:
        return [(one.name, place, size) for one, place, size in placed if one.kind == kind]

    def length(placed: Placed) -> int:
        _, place, size = placed[-1]
        return place + size + GAP

    order: dict[str, Any] = {
        "library": str(library), "symbol": TRIAL, "operands": length(operands),
        "results": length(results), "inputs": listed(operands, INPUT),
        "states": listed(operands, STATE), "parameters": listed(operands, PARAMETER),
        "after": listed(results, STATE), "outputs": listed(results, OUTPUT),
        "values": [float(number) for value in values.values() for number in value.reshape(-1)]}
    stage, fault = tried(order)
    if fault:
        raise ClieError(f"{file}: {function} {_explained(stage, fault)}")


def _explained(stage: str, fault: str) -> str:
    """What is wrong with a function, and what to do."""
    kind, _, argument = fault.partition(" ")
    at = ("ordinary inputs within 1 rad" if stage == ORDINARY
          else "inputs that are huge, infinite or NaN, as a model gives them that diverges")
    if kind == WRITES:
        return (f"writes past the end of {argument}; state its length there, double "
                f"{argument}[4], or write only what it holds")
    if kind == READS:
        return ("reads past the end of an argument, for its result depends on what lies behind "
                "one; state the lengths, such as const double kp[4], or read only what they hold")
    if kind == "remembers":
        return ("gives other results when it begins anew with the same inputs and states: it "
                "keeps a memory of its own, or reads a clock or random numbers; turn its static "
                "and global variables into states, arguments such as double integral[]")
    if kind == "time":
        return (f"does not return within {SECONDS:.0f} s at {at}; wrap an angle with "
                "remainder(x, 2 * M_PI) in place of a loop, and bound every other loop")
    return (f"ends its process ({fault}) at {at}; bound every index that a signal decides, "
            "and call no exit or abort")
