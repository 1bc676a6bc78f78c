"""Effects of a user's own: checked against the contract of the catalogue, and added to it."""

from __future__ import annotations

import ast
from os import PathLike
from pathlib import Path

import numpy as np

from clie_blocks.effects.effect import FAMILIES, PORTS, Effect
from clie_blocks.effects.library import LIBRARY
from clie_blocks.errors import ClieError, nearest
from clie_blocks.labels import DiagramError
from clie_blocks.user_files import run_file

_PROBES = np.linspace(-1.3, 1.7, 7)  # signals at which a block is asked what it adds
_JOINTS = 2


def register(effect: Effect) -> Effect:
    """Add an effect to the catalogue of this process: it can be inserted, drawn and diagnosed.

    Parameters
    ----------
    effect : Effect
        With a name that no effect has yet.

    Raises
    ------
    DiagramError
        If it breaks the contract of the catalogue; says which part, and how to mend it.

    """
    if LIBRARY.registered.get(effect.name) is effect:
        return effect
    _check(effect)
    LIBRARY.registered[effect.name] = effect
    return effect


def register_file(path: str | PathLike[str]) -> list[Effect]:
    """Register all effects that a Python file defines as variables of its own.

    The file is run: name one that you trust.

    Parameters
    ----------
    path : path-like
        Such as ``my_effects.py``.

    Raises
    ------
    ClieError
        If the file cannot be read or fails, defines no effect, or one of them breaks the contract
        of the catalogue; says in which line.

    """
    file = Path(path).resolve()
    if str(file) in _FILES_READ:
        return _FILES_READ[str(file)]
    names = run_file(path, "file of effects")
    effects = [(name, value) for name, value in names.items() if isinstance(value, Effect)
               and value not in [*_of_catalogue()]]
    if not effects:
        raise ClieError(f"{path}: it defines no effect; write MY_EFFECT = Effect(name=..., ...) "
                        "as the files of clie_blocks/effects do")
    for name, effect in effects:
        try:
            register(effect)
        except DiagramError as error:
            line = _line_defining(name, file.read_text())
            raise ClieError(f"{path}:{line}: {error}") from None
    _FILES_READ[str(file)] = [effect for _, effect in effects]
    return _FILES_READ[str(file)]


_FILES_READ: dict[str, list[Effect]] = {}


def _of_catalogue() -> list[Effect]:
    """Effects of the catalogue, which a file may import."""
    return [LIBRARY[name] for name in LIBRARY if name not in LIBRARY.registered]


def _check(effect: Effect) -> None:
    """Refuse an effect that breaks the contract of the catalogue."""
    if not effect.name.isidentifier() or effect.name != effect.name.lower():
        raise DiagramError(f"{effect.name!r} is no name for an effect: use small letters, digits "
                           "and underscores")
    if effect.name in LIBRARY:
        raise DiagramError(f"{effect.name}: the catalogue has an effect of this name; give yours "
                           "another one")
    for key, value, known in (("family", effect.family, FAMILIES), ("port", effect.port, PORTS)):
        if value not in known:
            raise DiagramError(f"{effect.name}: no {key} is called {value!r}; "
                               f"{nearest(value, known)}")
    if all(p.neutral is None for p in effect.parameters):
        raise DiagramError(f"{effect.name}: no parameter has a neutral value, so nothing removes "
                           "the effect; state neutral= for its amplitude")
    for p in effect.parameters:
        if not p.lower <= p.default <= p.upper or not p.lower <= p.typical <= p.upper:
            raise DiagramError(f"{effect.name}: {p.name} has the typical value {p.typical:g} and "
                               f"the neutral one {p.neutral}, outside its bounds [{p.lower:g}, "
                               f"{p.upper:g}]")
    _check_neutral(effect)


def _check_neutral(effect: Effect) -> None:
    """Refuse a block that does something at its neutral values, or gives no numbers."""
    for setting, is_neutral in ((effect.neutral(), True), (effect.typical(), False)):
        try:
            block = setting.block(_JOINTS)
            outputs = [np.asarray(block.output(0.3, np.zeros(block.nstates), np.full(
                block.ninputs, x)), float) for x in _PROBES]
        except Exception as error:
            raise DiagramError(f"{effect.name}: its block fails: {type(error).__name__}: {error}; "
                               "its function takes its inputs and parameters by their names, as "
                               "arrays of one value per joint") from None
        if not np.all(np.isfinite(outputs)):
            raise DiagramError(f"{effect.name}: its block gives NaN or infinite values at "
                               f"{setting.effect.typical_values()}")
        passed = 0.0 if effect.port in ("load", "environment") else _PROBES[:, None]
        if is_neutral and effect.port in ("load", "environment", "drive", "sensor") and np.any(
                np.array(outputs) != passed):
            raise DiagramError(f"{effect.name}: at its neutral values it must change nothing, "
                               "bit for bit, but its block does; check neutral= of its parameters")


def _line_defining(name: str, source: str) -> int:
    """Line in which a file assigns a variable."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Assign) and any(
                isinstance(target, ast.Name) and target.id == name for target in node.targets):
            return node.lineno
    return 1
