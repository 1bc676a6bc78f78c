"""100,000 damaged logs and robot files: each gives a record, or a message in words.

The formats whose libraries can be crashed are read in a child process by every command; here such
a child reads many files, and one that dies of a file is started anew behind it.
"""

import json
import random
import subprocess
import sys
import time
import warnings
from concurrent.futures import ThreadPoolExecutor

import fuzzing
import pytest

TOTAL = 100_000
PART = 10_000  # inputs of one process, which starts as long as it reads a thousand
STUCK = 30.0  # s without a further input
FEW = {"robot": 150, "text": 100, "franka": 40, "packed": 40, "arrays": 60, "parquet": 40,
       "folders": 40, "mcap": 10}


@pytest.mark.parametrize("kind", FEW)
def test_some_damaged_files(kind, tmp_path):
    if kind in ("parquet", "folders"):
        pytest.importorskip("pyarrow")
    if kind in fuzzing.CHILD:
        pytest.importorskip("rosbags")
    name, make = fuzzing.makers(kind, tmp_path)
    read = 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for number in range(FEW[kind]):
            path = tmp_path / (name or f"set{number}")
            fuzzing.put(path, make(random.Random(f"{kind} {number}")))
            read += fuzzing.look(kind, path, number)
    assert 0 < read < FEW[kind]  # some are harmless, some are not


def test_what_a_reader_raises_is_noticed(tmp_path, monkeypatch):
    def broken(path):
        raise ZeroDivisionError

    monkeypatch.setattr(fuzzing, "read_records", broken)
    with pytest.raises(ZeroDivisionError):
        fuzzing.look("text", tmp_path / "log.csv", 1)


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_a_hundred_thousand_damaged_files(tmp_path):
    for module in ("pymatreader", "h5py", "rosbags", "pyarrow"):
        pytest.importorskip(module)
    parts = [(kind, first, min(PART, share * TOTAL // 100 - first))
             for kind, share in fuzzing.SHARES.items()
             for first in range(0, share * TOTAL // 100, PART)]
    assert sum(count for _, _, count in parts) == TOTAL
    with ThreadPoolExecutor(2) as pool:
        results = list(pool.map(lambda part: _read(tmp_path, *part), parts))
    faults = [fault for found, _, _ in results for fault in found]
    assert not faults, f"{len(faults)} faults, the first:\n{json.dumps(faults[:5], indent=1)}"
    ended = sum(ends for _, ends, _ in results)
    read = sum(accepted for _, _, accepted in results)
    print(f"{TOTAL} files: {read} read, {ended} ended the child that read them")
    assert read > TOTAL / 20
    assert ended < TOTAL / 100


def _read(folder, kind, first, count):
    """Faults, ends of the child, and records of a part of the inputs of a kind."""
    place = folder / f"{kind}-{first}"
    place.mkdir()
    (place / "number").write_text("")
    (place / "faults").touch()
    ended = accepted = 0
    faults, stop = [], first + count
    while first < stop:
        code, read = _one_process(place, kind, first, stop - first)
        accepted += read
        if code == 0:
            break
        number = int((place / "number").read_text() or first)
        ended += 1
        if kind not in fuzzing.CHILD:
            faults.append([kind, number, f"ended the process with {code}: "
                           + (place / "errors").read_text()[-800:]])
        first = number + 1
    faults += [json.loads(line) for line in (place / "faults").read_text().splitlines()]
    return faults, ended, accepted


def _one_process(place, kind, first, count):
    """Exit code of a process that reads inputs, and how many it could read."""
    with open(place / "output", "w+") as output, open(place / "errors", "w") as errors:
        process = subprocess.Popen(
            [sys.executable, fuzzing.__file__, kind, str(first), str(count), str(place)],
            stdout=output, stderr=errors)
        seen, since = "", time.monotonic()
        while process.poll() is None:
            time.sleep(0.1)
            number = (place / "number").read_text()
            if number != seen:
                seen, since = number, time.monotonic()
            elif time.monotonic() - since > STUCK:
                process.kill()
        output.seek(0)
        return process.wait(), int(output.read() or 0)
