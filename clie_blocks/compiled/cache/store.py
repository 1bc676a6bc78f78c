"""Machine code on disk, found by its content, safe against damage and other versions."""

import contextlib
import hashlib
import os
from pathlib import Path

from clie_blocks.errors import ClieError
from clie_blocks.output import write

KEPT = 12000  # files; a study of random robots needs some 120 of each structure


def folder() -> Path | None:
    """Return the cache folder, or None where the user has switched the cache off.

    ``CLIE_BLOCKS_CACHE`` names another folder; ``off`` switches the cache off.
    """
    chosen = os.environ.get("CLIE_BLOCKS_CACHE")
    if chosen == "off":
        return None
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(chosen) if chosen else Path(base) / "clie_blocks" / "programs"


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
        _forget_oldest(path)


def _forget_oldest(path: Path) -> None:
    """Delete a tenth at once where there are too many: listing all of them takes a while."""
    names = [name for name in os.listdir(path) if name.endswith(".bin")]
    if len(names) > KEPT:
        files = sorted(map(path.joinpath, names), key=lambda file: file.stat().st_mtime)
        for file in files[:len(files) - KEPT + KEPT // 10]:
            file.unlink(missing_ok=True)
