"""Signal names as mathematics, and the room that a text takes."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import TYPE_CHECKING

from clie_blocks import output

if TYPE_CHECKING:
    from matplotlib.font_manager import FontProperties

# The glossary's words that are letters in the paper.
LETTERS = {"theta": r"\Theta", "phi": r"\Phi", "tau": r"\tau", "eps": r"\varepsilon",
           "omega": r"\omega", "gamma": r"\Gamma", "alpha": r"\alpha", "eta": r"\eta",
           "pe": r"\mathrm{PE}"}


def symbol(name: str) -> str:
    """Port name as the paper writes it, in mathtext: 'dq_model' becomes q with a dot and an index.

    Words that stand for no letter stay words.
    """
    base = re.sub(r"\[\d+\]$", "", name)
    index = name[len(base):]
    core, *marks = base.split("_")
    rate = re.fullmatch(r"(d{1,2})([a-z])", core)
    letter = rate[2] if rate else LETTERS.get(core, core)
    if not re.fullmatch(r"[A-Za-z]|\\.+", letter) or not all(m.isalnum() for m in marks):
        return plain(name)
    if "hat" in marks:
        marks.remove("hat")
        letter = rf"\hat{{{letter.upper() if letter in 'abd' else letter}}}"
    if rate:
        letter = rf"\{'dot' if rate[1] == 'd' else 'ddot'}{{{letter}}}"
    low = r",".join(mark if len(mark) == 1 else rf"\mathrm{{{mark}}}" for mark in marks)
    return f"${letter}{f'_{{{low}}}' if low else ''}${index}"


def plain(name: str) -> str:
    """Return a name as words, safe against mathtext."""
    return output.plain(name.replace("_", " ")).strip()


def wrapped(name: str, limit: int = 16) -> str:
    """Return a block's name as words, in lines of about `limit` letters."""
    lines = [""]
    for word in plain(name).split():
        if lines[-1] and len(lines[-1]) + len(word) >= limit:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return "\n".join(lines)


def font(size: float, bold: bool = False) -> FontProperties:
    """Font of all texts, independent of the user's Matplotlib settings."""
    from matplotlib.font_manager import FontProperties

    return FontProperties(family="DejaVu Sans", size=size, weight="bold" if bold else "normal",
                          math_fontfamily="stix")


@lru_cache(maxsize=4096)
def measure(text: str, size: float, bold: bool = False) -> tuple[float, float]:
    """Width and height of a text in points."""
    from matplotlib.textpath import TextPath

    lines = [line for line in text.split("\n") if line.strip()]
    if not lines:
        return 0.0, 0.0
    extents = [TextPath((0, 0), line, prop=font(size, bold)).get_extents() for line in lines]
    return (max(float(e.width) for e in extents),
            max(len(lines) * 1.2 * size, float(extents[0].height)))
