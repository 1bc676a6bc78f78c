"""Labels under seal, and a log that proves when they were opened.

The labels are encrypted with a fresh key before any diagnosis starts, and a digest of key and
text is committed to the log.  Every line of the log holds the digest of the line before, so that
none can be changed or moved later without a trace.
"""

import datetime
import hashlib
import json
import secrets

from clie_blocks.errors import RecordError
from clie_blocks.output import to_json, write

SEALED, KEY, LABELS, LOG = "labels.sealed", "labels.key", "labels.json", "run.log"


def seal(folder, labels):
    """Encrypt the labels and commit to them.

    Parameters
    ----------
    folder : pathlib.Path
        Of the study.
    labels : dict
        By trial.

    """
    key, text = secrets.token_hex(32), to_json(labels).encode()
    write(folder / KEY, key + "\n")
    write(folder / SEALED, _mixed(key, text))
    note(folder, "sealed", labels=digest(_mixed(key, text)), commitment=_commitment(key, text))


def unseal(folder):
    """Open the labels once the diagnoses are on disk, and check them against the commitment.

    Parameters
    ----------
    folder : pathlib.Path
        Of the study.

    Returns
    -------
    dict
        Labels by trial.

    Raises
    ------
    RecordError
        If no diagnoses are on record, or the labels are not those that were sealed.

    """
    lines = verified(folder)
    events = [line["event"] for line in lines]
    if "diagnosed" not in events:
        raise RecordError(f"{folder / LOG} records no diagnoses yet; labels are opened after them")
    key = (folder / KEY).read_text().strip()
    text = _mixed(key, (folder / SEALED).read_bytes())
    before = lines[:events.index("diagnosed")]  # two processes may have made a study at once
    committed = [line["commitment"] for line in before if line["event"] == "sealed"][-1:]
    if [_commitment(key, text)] != committed:
        raise RecordError(f"{folder / SEALED} does not hold the labels committed to in {LOG}: the "
                          "file or its key was changed; make the study anew")
    write(folder / LABELS, text)
    note(folder, "unsealed", labels=digest(text))
    return json.loads(text)


def note(folder, event, **facts):
    """Add a line to the log of a study.

    Parameters
    ----------
    folder : pathlib.Path
        Of the study.
    event : str
        What happened.
    **facts
        Digests and counts.

    """
    path = folder / LOG
    before = path.read_text() if path.is_file() else ""
    last = before.splitlines()[-1] if before else ""
    now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    line = {"time": now, "event": event, **facts, "before": digest(last.encode())}
    write(path, before + json.dumps(line) + "\n")


def verified(folder):
    """Lines of the log of a study, whose chain of digests holds.

    Raises
    ------
    RecordError
        If a line was changed, moved or left out.

    """
    path, last, found = folder / LOG, "", []
    for number, text in enumerate(path.read_text().splitlines() if path.is_file() else (), 1):
        line = json.loads(text)
        if line["before"] != digest(last.encode()):
            raise RecordError(f"{path}:{number} does not follow the line before it: the log was "
                              "changed after it was written")
        found.append(line)
        last = text
    return found


def digest(content):
    """SHA-256 of bytes, as text."""
    return hashlib.sha256(content).hexdigest()


def folder_digest(folder):
    """SHA-256 over names and contents of all files below a folder."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return digest("".join(f"{path.relative_to(folder)} {digest(path.read_bytes())}\n"
                          for path in files).encode())


def _commitment(key, text):
    return digest(key.encode() + text)


def _mixed(key, content):
    """Content XOR a stream of the key: encrypts, and decrypts what was encrypted."""
    stream = hashlib.shake_256(bytes.fromhex(key)).digest(len(content))
    return bytes(a ^ b for a, b in zip(content, stream))
