"""Small files that unpack to more than memory holds."""

from pathlib import Path

from clie_blocks.errors import RecordError

FACTOR = 300  # times its packed size: no log shrinks that much
HARMLESS = 100_000_000  # bytes that may be unpacked in any case


def refuse_bomb(path: Path, unpacked: int) -> None:
    """Refuse a file whose content is that many bytes, if no log packs so well."""
    if unpacked > max(HARMLESS, FACTOR * path.stat().st_size):
        raise RecordError(f"{path} unpacks to more than {FACTOR} times its size, which no log "
                          "does; unpack it and look at it first")
