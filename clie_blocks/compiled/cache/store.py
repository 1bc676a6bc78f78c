"""Machine code on disk, found by its content, safe against damage and other versions.

A digest shows damage but not origin: who can write the folder can have its code run.  So the
folder is this user's alone, and another one is not used.
"""

import contextlib
import functools
import hashlib
import itertools
import os
import stat
import sys
from pathlib import Path

from clie_blocks.errors import ClieError
from clie_blocks.output import write

KEPT = 12000  # files; a study of random robots needs some 120 of each structure
CHECKED = 50  # of so many files that a process saves, at one it is looked whether there are more
_saved = itertools.count()


def folder() -> Path | None:
    """Return the cache folder, or None without one: switched off, not to be made, or not safe.

    ``CLIE_BLOCKS_CACHE`` names another folder; ``off`` switches the cache off.
    """
    chosen = os.environ.get("CLIE_BLOCKS_CACHE")
    if chosen == "off":
        return None
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    path = Path(chosen) if chosen else Path(base) / "clie_blocks" / "programs"
    try:
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
        danger = _danger(path.stat())
    except OSError:  # a cache that cannot be made is no reason to stop
        return None
    if danger:
        _report(path, danger)
    return None if danger else path


def _danger(status: os.stat_result) -> str:
    """Who else can put code into a folder of this status; empty for nobody."""
    if not hasattr(os, "getuid"):
        return ""  # Windows: a user's own folders are closed to others by their access lists
    if status.st_uid != os.getuid():
        return "belongs to another user"
    return "can be written by others" * bool(status.st_mode & (stat.S_IWGRP | stat.S_IWOTH))


@functools.cache
def _report(path: Path, danger: str) -> None:
    print(f"note: compiled programs are not kept: {path} {danger}, whose code would run here; "
          f"chmod 700 it, or name another folder in CLIE_BLOCKS_CACHE", file=sys.stderr)


def key(*parts: str) -> str:
    """Return the name under which content that depends on these texts is stored."""
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def load(name: str) -> bytes | None:
    """Return the stored bytes, or None if there are none or they are damaged."""
    path = folder()
    if path is None:
        return None
    try:
        stored = (path / f"{name}.bin").read_bytes()
    except OSError:
        return None
    digest, content = stored[:32], stored[32:]
    return content if digest == hashlib.sha256(content).digest() else None


def save(name: str, content: bytes) -> None:
    """Store bytes; a cache that cannot be written is no reason to stop."""
    path = folder()
    if path is None:
        return
    with contextlib.suppress(ClieError, OSError):
        write(path / f"{name}.bin", hashlib.sha256(content).digest() + content)
        if next(_saved) % CHECKED == 0:
            _forget_oldest(path)


def _forget_oldest(path: Path) -> None:
    """Delete a tenth where there are too many: listing all of them takes a while."""
    names = [name for name in os.listdir(path) if name.endswith(".bin")]
    if len(names) > KEPT:
        files = sorted(map(path.joinpath, names), key=lambda file: file.stat().st_mtime)
        for file in files[:len(files) - KEPT + KEPT // 10]:
            file.unlink(missing_ok=True)
