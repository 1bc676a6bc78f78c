"""What can go wrong for a user, and the exit code that says so to a shell."""

import difflib
from collections.abc import Iterable

CLOSE = 0.5  # likeness of two names, 0 to 1, from which on one may stand for the other
LONGEST = 2000  # characters of a message; the middle of a longer one is left out


class ClieError(Exception):
    """A fault that the user can fix; its text says what, where, why and how to fix it.

    What it quotes from files is `visible`, and a value of a million characters is cut.
    """

    exit_code = 2

    def __str__(self) -> str:
        text = visible(super().__str__(), keep="\n")
        half = LONGEST // 2
        return text if len(text) <= LONGEST else f"{text[:half]} ... {text[-half:]}"


class RecordError(ClieError):
    """A log or a robot file cannot be used as it stands."""

    exit_code = 3


class NotIdentifiableError(ClieError):
    """The data do not identify what is to be estimated."""

    exit_code = 4


class DivergedError(ClieError):
    """A simulation or an estimate diverges."""

    exit_code = 5


class MissingExtraError(ClieError):
    """A job needs an optional dependency that is not installed."""

    def __init__(self, job: str, package: str, extra: str) -> None:
        super().__init__(job, package, extra)  # as they came, so that a worker can send it

    def __str__(self) -> str:
        job, package, extra = self.args
        return f'{job} needs {package}: pip install "clie-blocks[{extra}]"'


def visible(text: object, keep: str = "") -> str:
    r"""Return a text with its control characters written out, such as ``\x1b`` for escape.

    Texts from files are shown so: a terminal would obey them, and no XML may hold them.  Those in
    `keep` stay.
    """
    text = str(text)
    hidden = [letter for letter in set(text) if not letter.isprintable() and letter not in keep]
    return text.translate({ord(letter): repr(letter)[1:-1] for letter in hidden})


def nearest(name: object, known: Iterable[object]) -> str:
    """Return a hint that names the valid names, for the end of a message.

    Parameters
    ----------
    name : str
        What the user wrote.
    known : iterable of str
        The valid names.

    Returns
    -------
    str
        ``"did you mean 'x'? known: x, y"``; all names, those most alike first.

    """
    names = [str(k) for k in known]
    alike = {k: difflib.SequenceMatcher(None, str(name).lower(), k.lower()).ratio()
             for k in names}
    close = sorted((k for k in names if alike[k] >= CLOSE), key=lambda k: (alike[k], k),
                   reverse=True)
    hint = f"did you mean {close[0]!r}? " if close else ""
    listed = [*close, *(k for k in names if k not in close)]
    return f"{hint}known: {', '.join(listed) or 'none'}"
