"""The equation of an effect, one line of plain text, as LaTeX."""

import itertools
import re

TOKEN = re.compile(r"(\s*)(\d+\.?\d*|\w+_\(\w-\d\)|[A-Za-z]\w*(?:'s\b|')?|>=|<=|\.\.\.|\S)")
NEXT = re.compile(r"[,;] (?=[^,;()]* = )")  # what follows is an equation of its own
FUNCTIONS = {name: rf"\{name}" for name in ("tanh", "exp", "sin", "cos", "max", "min")} | {
    name: rf"\operatorname{{{name}}}" for name in ("sgn", "clip", "floor", "frac", "gravity")}
SIGNS = {">=": r"\ge", "<=": r"\le", "...": r"\dots", "pi": r"\pi", "tau": r"\tau", "pe": "PE",
         "mod": r"\bmod", "Kp": "K_p", "Kd": "K_d", "ki": "k_i", "kt": "k_t"}
WORDS = frozenset("if else and for where from with the on other flank alike below contact yields "
                  "outside while sees of law Jacobian tip's".split())
INDEX = re.compile(r"(.+?)_(?:\((.+)\)|(\w+))$")


def as_latex(equation: str) -> str:
    """Return an equation of the catalogue as LaTeX.

    Parameters
    ----------
    equation : str
        As `Effect.equation` holds it: ``tau = level tanh(dq / width)``.

    """
    lines = [_line(part) for part in NEXT.split(equation)]
    return lines[0] if len(lines) == 1 else (
        r"\begin{align*}" + r" \\ ".join(line.replace(" = ", " &= ", 1) for line in lines)
        + r"\end{align*}")


def _line(equation: str) -> str:
    """One equation; two factors that a blank separates keep a thin space."""
    equation = re.sub(r"sum over (\w)( >= \w)? of", r"SUM(\1\2)", equation)
    shown, last, bars = "", "", itertools.cycle((r"\lvert", r"\rvert"))
    for blank, token in TOKEN.findall(equation):
        shown += (r"\," if blank and _is_product(last, token) else " ") + (
            next(bars) if token == "|" else _symbol(token, last))
        last = token
    return re.sub(r"SUM \((.*?)\)", r"\\sum_{\1}", shown).strip()


def _symbol(token: str, last: str) -> str:
    """One token as LaTeX; a name after ``^`` is an exponent."""
    if token in WORDS:
        return rf"\text{{ {token} }}"
    symbol = FUNCTIONS.get(token) or SIGNS.get(token) or (
        _name(token) if token[0].isalpha() else token)
    return f"{{{symbol}}}" if last == "^" else symbol


def _name(name: str) -> str:
    """A quantity: derivatives as dots, what follows an underscore as an index."""
    if name == "SUM":
        return name
    if name.endswith("'"):
        return _dotted(r"\dot", name[:-1])
    if re.match(r"d+q(_|$)", name):
        return _dotted({1: r"\dot", 2: r"\ddot"}[name.index("q")], name.lstrip("d"))
    found = INDEX.match(name)
    if found and (len(found[1]) == 1 or found[2] or len(found[3]) == 1):
        base, index = found[1], found[2] or found[3]
        return f"{_plain(base)}_{{{','.join(map(_plain, index.split('_')))}}}"
    return _plain(name)


def _dotted(dot: str, name: str) -> str:
    base, _, index = name.partition("_")
    return f"{dot}{{{_plain(base)}}}" + (f"_{{{_plain(index)}}}" if index else "")


def _plain(name: str) -> str:
    """A letter in italics, a word upright, a known symbol as itself."""
    if name in SIGNS or name == "sum":
        return SIGNS.get(name, r"\sum")
    return name if len(name) == 1 or "-" in name else rf"\mathrm{{{name}}}".replace("_", r"\_")


def _is_product(last: str, token: str) -> bool:
    """Whether two tokens stand for two factors."""
    ends = last[-1:].isalnum() or last[-1:] in ("'", ")")
    begins = token[0].isalnum() or token == "("
    return ends and begins and not ({last, token} & WORDS or last in FUNCTIONS)
