"""Labels under seal, and a log that proves when they were opened.

The labels are encrypted with a fresh key before any diagnosis starts, and a digest of key and
text is committed to the log.  Every line of the log holds the digest of the line before, so that
none can be changed or moved later without a trace.
"""

import datetime
import hashlib
import json
import secrets
from pathlib import Path
from typing import Any

from clie_blocks.errors import RecordError
from clie_blocks.output import to_json, write

SEALED, KEY, LABELS, LOG = "labels.sealed", "labels.key", "labels.json", "run.log"


def seal(folder: Path, labels: dict[str, dict[str, Any]]) -> None:
    """Encrypt the labels of a study, by trial, and commit to them."""
    key, text = secrets.token_hex(32), to_json(labels).encode()
    encrypted = _xor_with_stream(key, text)
    write(folder / KEY, key + "\n")
    write(folder / SEALED, encrypted)
    append_event(folder, "sealed", labels=digest(encrypted), commitment=_commitment(key, text))


def unseal(folder: Path) -> dict[str, dict[str, Any]]:
    """Open the labels once the diagnoses are on disk, and check them against the commitment.

    Raises
    ------
    RecordError
        If no diagnoses are on record, or the labels are not those that were sealed.

    """
    lines = read_log(folder)
    events = [line["event"] for line in lines]
    if "diagnosed" not in events:
        raise RecordError(f"{folder / LOG} records no diagnoses yet; labels are opened after them")
    key = (folder / KEY).read_text().strip()
    text = _xor_with_stream(key, (folder / SEALED).read_bytes())
    before = lines[:events.index("diagnosed")]  # two processes may have made a study at once
    committed = [line["commitment"] for line in before if line["event"] == "sealed"][-1:]
    if [_commitment(key, text)] != committed:
        raise RecordError(f"{folder / SEALED} does not hold the labels committed to in {LOG}: the "
                          "file or its key was changed; make the study anew")
    write(folder / LABELS, text)
    append_event(folder, "unsealed", labels=digest(text))
    return json.loads(text)


def append_event(folder: Path, event: str, **facts: str | int) -> None:
    """Append an event with its digests and counts to the log of a study."""
    path = folder / LOG
    before = path.read_text() if path.is_file() else ""
    last = before.splitlines()[-1] if before else ""
    now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    line = {"time": now, "event": event, **facts, "before": digest(last.encode())}
    write(path, before + json.dumps(line) + "\n")


def read_log(folder: Path) -> list[dict[str, Any]]:
    """Return the lines of the log of a study, whose chain of digests holds.

    Raises
    ------
    RecordError
        If a line was changed, moved or left out.

    """
    path, last, lines = folder / LOG, "", []
    for number, text in enumerate(path.read_text().splitlines() if path.is_file() else (), 1):
        line = json.loads(text)
        if line["before"] != digest(last.encode()):
            raise RecordError(f"{path}:{number} does not follow the line before it: the log was "
                              "changed after it was written")
        lines.append(line)
        last = text
    return lines


def digest(content: bytes) -> str:
    """SHA-256 of bytes, as text."""
    return hashlib.sha256(content).hexdigest()


def folder_digest(folder: Path) -> str:
    """SHA-256 over names and contents of all files below a folder, but for hidden ones.

    A killed run leaves hidden files, parts of those that it was writing.
    """
    files = sorted(path for path in folder.rglob("*")
                   if path.is_file() and not path.name.startswith("."))
    return digest("".join(f"{path.relative_to(folder)} {digest(path.read_bytes())}\n"
                          for path in files).encode())


def _commitment(key: str, text: bytes) -> str:
    return digest(key.encode() + text)


def _xor_with_stream(key: str, content: bytes) -> bytes:
    """Content XOR a stream of the key: encrypts, and decrypts what was encrypted."""
    stream = hashlib.shake_256(bytes.fromhex(key)).digest(len(content))
    return bytes(a ^ b for a, b in zip(content, stream))
