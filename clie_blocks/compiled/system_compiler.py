"""The C compiler of the system: a file of the user's own as a library, kept on disk."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from clie_blocks.compiled.cache import store
from clie_blocks.errors import ClieError

COMPILERS = ("cc", "gcc", "clang")
SECONDS = 60  # that it may take
# Numbers as in numpy: no fused operations.  What C only warns of, and is wrong, is an error.
FLAGS = ("-std=gnu11", "-O2", "-fPIC", "-shared", "-ffp-contract=off", "-Wuninitialized",
         *(f"-Werror={fault}" for fault in ("implicit-function-declaration", "int-conversion",
                                            "incompatible-pointer-types", "return-type",
                                            "uninitialized")))
_LINK = ("-lm",)
_SAID = re.compile(r"^(?:\S*?:\d+:(?:\d+:)? )?(?:fatal )?error: .*"
                   r"|.*undefined (?:reference|symbol).*", re.MULTILINE)


def system_compiler() -> str | None:
    """Return the path of a C compiler: that of the variable CC, or one of `COMPILERS`; or None."""
    names = [name for name in (os.environ.get("CC"), *COMPILERS) if name]
    return next((found for name in names if (found := shutil.which(name))), None)


def preprocessed(path: Path) -> str:
    """Return a C file as its compiler sees it: macros replaced, without comments.

    Raises
    ------
    ClieError
        If the file cannot be read or has an error, with its line, or there is no compiler.

    """
    return _run(["-E", "-P", str(path.resolve())], path)


def compiled_library(path: Path, text: str, wrapper: str) -> tuple[str, bytes]:
    """Return the digest and the bytes of a library of a C file with a wrapper around it.

    Parameters
    ----------
    path : Path
        The file.
    text : str
        What the compiler sees of it, see `preprocessed`.
    wrapper : str
        C text behind it.

    Raises
    ------
    ClieError
        If it does not compile; says the compiler's first error, with its line.

    """
    digest = store.key(text, wrapper, *FLAGS, *_LINK, _run(["--version"], path))
    stored = store.load(digest)
    if stored is None:
        stored = _compiled(path, wrapper)
        store.save(digest, stored)
    return digest, stored


def _compiled(path: Path, wrapper: str) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        source, made = Path(folder) / "wrapped.c", Path(folder) / "library"
        source.write_text(f'#include "{path.resolve()}"\n{wrapper}')
        closed = ("-Wl,-z,defs",) if sys.platform == "linux" else ()
        _run([*FLAGS, *closed, "-o", str(made), str(source), *_LINK], path)
        return made.read_bytes()


def _run(arguments: list[str], path: Path) -> str:
    """Output of the compiler."""
    compiler = system_compiler()
    if compiler is None:
        raise ClieError(f"{path}: no C compiler is here to compile it ({', '.join(COMPILERS)}, or "
                        "the one that the variable CC names); install one, such as gcc, or write "
                        "the law in Python, see docs/howto/own_law.md")
    try:
        path.open().close()
        done = subprocess.run([compiler, *arguments], capture_output=True, text=True, check=False,
                              timeout=SECONDS, errors="replace", env={**os.environ, "LC_ALL": "C"})
    except OSError as error:
        raise ClieError(f"{path}: the file in C cannot be read: {error}") from None
    except subprocess.TimeoutExpired:
        raise ClieError(f"{path}: {compiler} did not end within {SECONDS} s; take out of the file "
                        "what it includes or expands without end") from None
    if done.returncode:
        said = _SAID.search(done.stderr)
        line = (said.group() if said else done.stderr.strip()[-300:]).replace(
            str(path.resolve()), str(path))
        raise ClieError(f"{path} does not compile: {line}; correct the line, and try "
                        f"{Path(compiler).name} -c {path}")
    return done.stdout
