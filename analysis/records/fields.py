"""Kinds of value that a robot file holds: numbers per joint, text, flags, with their bounds."""

import dataclasses
import re
from collections.abc import Sequence
from typing import Any, NoReturn

import numpy as np

from clie_blocks.errors import RecordError, nearest, visible

LONGEST_NAME = 100  # characters
OWN_LAW = r"[^:\u0000]+\.(py|c):[A-Za-z_]\w*"  # of a law in a file of the user's own


class FixedDict(dict):
    """A dict that refuses changes, and unlike a mapping proxy can be pickled for a worker."""

    def _refuse(self, *args: Any, **kwargs: Any) -> NoReturn:
        """Refuse a change."""
        raise TypeError("a record and a robot do not change; make a copy with other values")

    __setitem__ = __delitem__ = __ior__ = _refuse
    update = pop = popitem = setdefault = clear = _refuse

    def __reduce__(self) -> "tuple[type[FixedDict], tuple[dict[str, Any]]]":
        return FixedDict, (dict(self),)


def file_field(keys: str | Sequence[str], kind: str, default: Any = None, *,
               above: float | None = None, least: float | None = None, nonzero: bool = False,
               choices: Sequence[str] = ()) -> Any:
    """Return a dataclass field with its keys in the file, the kind of its value and its bounds.

    Kinds are ``joints``, ``number``, ``vector`` of three, ``matrix``, ``lists``, ``positions``
    by name, ``names``, ``choice``, ``law`` (a choice, or FILE.py:NAME, FILE.c:NAME), ``table`` of
    a number per joint by name (of `choices`), ``numbers`` by any name, ``given`` (in no file),
    ``text`` and ``flag``.
    """
    keys = (keys,) if isinstance(keys, str) else tuple(keys)
    return dataclasses.field(default=default, metadata={
        "keys": keys, "kind": kind, "above": above, "least": least, "nonzero": nonzero,
        "choices": choices})


def check_value(value: Any, field: dataclasses.Field[Any], where: str) -> Any:
    """Return a value of a field's kind, checked against its bounds; `where` begins the message."""
    rules = field.metadata
    kind = rules["kind"]
    if kind == "text" or kind == "choice":
        return _word(value, rules["choices"], where)
    if kind == "given":
        return value
    if kind == "law":
        return _law(value, rules["choices"], where)
    if kind == "flag":
        if not isinstance(value, bool):
            raise RecordError(f"{where} must be true or false, got {value!r}")
        return value
    if kind == "lists":
        return _lists(value, where)
    if kind == "positions":
        return _positions(value, where)
    if kind == "names":
        return _names(value, where)
    if kind == "table":
        return _table(value, rules["choices"], where)
    if kind == "numbers":
        return _numbers_by_name(value, where)
    if kind == "vector":
        return _vector(value, where)
    if kind == "matrix":
        return _matrix(value, where)
    return _numbers(value, rules, where)


def _word(value: Any, choices: Sequence[str], where: str) -> str:
    if not isinstance(value, str):
        raise RecordError(f"{where} must be text in quotes, got {value!r}")
    value = visible(value, keep="\n\t")
    if choices and value not in choices:
        raise RecordError(f"{where} = {value!r} is not known; {nearest(value, choices)}")
    return value


def _law(value: Any, choices: Sequence[str], where: str) -> str:
    if isinstance(value, str) and re.fullmatch(OWN_LAW, value):
        return visible(value)
    if isinstance(value, str) and (".py" in value or value.endswith(".c") or ":" in value):
        raise RecordError(f"{where} = {value!r} names no law of your own; write FILE.py:NAME, "
                          'such as "my_law.py:controller", or FILE.c:NAME for a function in C')
    return _word(value, choices, where)


def _numbers(value: Any, rules: Any, where: str) -> float | np.ndarray:
    one = rules["kind"] == "number"
    wanted = "a number" if one else "a number per joint"
    array = _float_array(value, where, wanted)
    if array.ndim != (0 if one else 1) and not (array.ndim == 0 and not one):
        raise RecordError(f"{where} must be {wanted}, got {value!r}")
    if not np.isfinite(array).all():
        raise RecordError(f"{where} must be finite, got {value!r}")
    above, least = rules["above"], rules["least"]
    if above is not None and not (array > above).all():
        raise RecordError(f"{where} must be greater than {above}, got {value!r}")
    if least is not None and not (array >= least).all():
        raise RecordError(f"{where} must be at least {least}, got {value!r}")
    if rules["nonzero"] and not array.all():
        raise RecordError(f"{where} must not be 0, got {value!r}")
    return float(array) if one else _frozen(np.atleast_1d(array))


def _positions(value: Any, where: str) -> FixedDict:
    if not isinstance(value, dict):
        raise RecordError(f"{where} must be names with numbers, such as {{ finger = 0.0 }}, got "
                          f"{value!r}")
    return FixedDict({name: float(_float_array(one, f"{where}: {name}", "a number"))
                      for name, one in value.items()})


def _table(value: Any, choices: Sequence[str], where: str) -> FixedDict:
    """Numbers per joint by name, none of which may be missing from the choices."""
    if not isinstance(value, dict):
        raise RecordError(f"{where} must be a table of {', '.join(choices)}, such as "
                          f"{{ {choices[0]} = [1.0] }}, got {value!r}")
    unknown = next((name for name in value if name not in choices), None)
    if unknown is not None:
        raise RecordError(f"{where} has no {unknown!r}; {nearest(unknown, choices)}")
    rules = {"kind": "joints", "above": None, "least": None, "nonzero": False}
    return FixedDict({name: _numbers(one, rules, f"{where}: {name}")
                      for name, one in value.items()})


def _numbers_by_name(value: Any, where: str) -> FixedDict:
    """A number, or a list of numbers, by any name."""
    if not isinstance(value, dict):
        raise RecordError(f"{where} must be names with numbers, such as {{ kp = [30.0, 20.0] }}, "
                          f"got {value!r}")
    rules = {"kind": "joints", "above": None, "least": None, "nonzero": False}
    return FixedDict({name: _numbers(one, rules, f"{where}: {name}")
                      for name, one in value.items()})


def _names(value: Any, where: str) -> tuple[str, ...]:
    if not isinstance(value, (list, tuple)) or not all(isinstance(one, str) for one in value):
        raise RecordError(f"{where} must be a list of names, got {value!r}")
    return tuple(check_name(one, where) for one in value)


def _vector(value: Any, where: str) -> np.ndarray:
    array = _float_array(value, where, "three numbers")
    if array.shape != (3,) or not np.isfinite(array).all():
        raise RecordError(f"{where} must be three numbers along x, y and z, got {value!r}")
    return _frozen(array)


def _matrix(value: Any, where: str) -> np.ndarray:
    array = _float_array(value, where, "a list of rows of numbers")
    if array.ndim != 2 or array.shape[0] != array.shape[1] or not np.isfinite(array).all():
        raise RecordError(f"{where} must have as many rows as columns, such as "
                          f"[[1, 0.5], [0, 1]], got {value!r}")
    return _frozen(array)


def _lists(value: Any, where: str) -> tuple[np.ndarray, ...]:
    if not isinstance(value, (list, tuple)):
        raise RecordError(f"{where} must be a list with one entry per joint, got {value!r}")
    return tuple(_frozen(np.atleast_1d(_float_array(row, where, "numbers"))) for row in value)


def _float_array(value: Any, where: str, wanted: str) -> np.ndarray:
    try:
        array = np.array(value)
    except ValueError:
        raise RecordError(f"{where} must be {wanted}, got {value!r}") from None
    if array.dtype.kind not in "iuf":
        raise RecordError(f"{where} must be {wanted}, got {value!r}")
    return array.astype(float)


def _frozen(array: Any) -> np.ndarray:
    array = np.array(array, float)
    array.flags.writeable = False
    return array


def check_name(name: str, where: str) -> str:
    """Return a name that can be printed in a line, in a drawing and in a simulator's file."""
    if not name.isprintable() or len(name) > LONGEST_NAME:
        raise RecordError(f"{where} {name[:40]!r} has characters that cannot be printed, or more "
                          f"than {LONGEST_NAME} of them; name it in letters, digits and marks, "
                          "such as elbow_1")
    return name


def per_joint(array: np.ndarray | None, n: int, where: str) -> np.ndarray | None:
    """Return one value per joint; a single one stands for all joints, None stays None."""
    if array is None:
        return None
    if array.size == 1 and n > 1:
        return _frozen(np.full(n, array.item()))
    if array.size != n:
        raise RecordError(f"{where} has {array.size} entries, but the robot has {n} joints; "
                          "list one value per joint")
    return array
