"""Units of logs and their factors to SI; a unit may stand in a column's header."""

import math
import re

from clie_blocks.errors import RecordError, nearest

TURN = 2 * math.pi
DEGREE = math.pi / 180
TO_SI = {
    "s": (1.0, "s"), "ms": (1e-3, "s"), "us": (1e-6, "s"), "ns": (1e-9, "s"),
    "min": (60.0, "s"),
    "rad": (1.0, "rad"), "mrad": (1e-3, "rad"), "deg": (DEGREE, "rad"), "rev": (TURN, "rad"),
    "m": (1.0, "m"), "mm": (1e-3, "m"), "um": (1e-6, "m"),
    "rad/s": (1.0, "rad/s"), "mrad/s": (1e-3, "rad/s"), "deg/s": (DEGREE, "rad/s"),
    "rev/s": (TURN, "rad/s"), "rpm": (TURN / 60, "rad/s"),
    "m/s": (1.0, "m/s"), "mm/s": (1e-3, "m/s"),
    "N m": (1.0, "N m"), "mN m": (1e-3, "N m"), "kN m": (1e3, "N m"), "N": (1.0, "N"),
    "A": (1.0, "A"), "mA": (1e-3, "A"), "V": (1.0, "V"), "mV": (1e-3, "V"),
    "duty": (1.0, "duty"), "%": (1.0, "%"), "1": (1.0, "u"), "u": (1.0, "u"),
}
FORCES = ("N m", "N")  # of a command that acts on the joint as it stands
SPELLINGS = {
    "sec": "s", "second": "s", "seconds": "s", "msec": "ms", "millis": "ms", "usec": "us",
    "micros": "us", "µs": "us", "μs": "us", "nsec": "ns", "nanos": "ns",
    "radian": "rad", "radians": "rad", "degree": "deg", "degrees": "deg", "°": "deg",
    "turn": "rev", "turns": "rev", "rads": "rad/s", "rad_s": "rad/s", "deg_s": "deg/s",
    "°/s": "deg/s", "dps": "deg/s",
    "Nm": "N m", "N.m": "N m", "N*m": "N m", "N·m": "N m", "N-m": "N m", "nm": "N m", "NM": "N m",
    "mNm": "mN m", "mN.m": "mN m", "kNm": "kN m", "amp": "A", "volt": "V", "volts": "V",
    "percent": "%", "-": "1", "": "1",
}
KINDS = {
    "time": ("s",),
    "q": ("rad", "m", "%"), "qd": ("rad", "m", "%"), "q_motor": ("rad", "m"),
    "dq": ("rad/s", "m/s"),
    "u": ("N m", "N", "A", "V", "duty", "%", "u"), "pe": ("N m", "N", "A", "V", "duty", "%", "u"),
    "tau": ("N m", "N", "A"), "supply": ("V",),
}


def to_si(unit: str, signal: str, where: str) -> tuple[float, str]:
    """Return the factor that brings a unit to SI, and the SI unit.

    Parameters
    ----------
    unit : str
        As written in the log or in `robot.toml`.
    signal : str
        Signal of a `Record`, or ``time``; it decides which units make sense.
    where : str
        Beginning of the message.

    Raises
    ------
    RecordError
        If the unit is unknown or not one of this signal.

    """
    name = SPELLINGS.get(unit.strip(), unit.strip())
    if name not in TO_SI:
        raise RecordError(f"{where}: unit {unit!r} is not known; "
                          f"{nearest(unit, _fitting(signal))}")
    factor, base = TO_SI[name]
    if base not in KINDS.get(signal, (base,)):
        raise RecordError(f"{where}: {signal} cannot be in {unit!r}; "
                          f"it takes {', '.join(_fitting(signal))}")
    return factor, base


def _fitting(signal: str) -> list[str]:
    return [name for name, (_, base) in TO_SI.items() if base in KINDS.get(signal, (base,))]


def split_unit(header: str) -> tuple[str, str | None]:
    """Return a column's name without its unit, and the unit or None: ``q_elbow[deg]``."""
    match = re.fullmatch(r"(.+?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))", header.strip())
    if match is None:
        return header.strip(), None
    unit = match[3] if match[2] is None else match[2]
    return (header.strip(), None) if unit.strip().isdigit() else (match[1].strip(), unit)
