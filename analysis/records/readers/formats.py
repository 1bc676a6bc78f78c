"""Which reader reads what: the table of formats, and the one place that recognises them."""

import importlib
import os
import zipfile
from pathlib import Path
from types import ModuleType

from clie_blocks.analysis.records.plain_file import check_plain_file
from clie_blocks.errors import RecordError

# name: module in this folder
READERS = {
    "csv": "csv_text",
    "parquet": "parquet",
    "npz": "npz",
    "mat": "mat",
    "bag": "bag",
    "lerobot": "lerobot",
    "sage": "sage",
    "franka": "franka",
    "emps": "emps",
    "bam": "bam",
    "so101": "so101",
    "double_pendulum": "double_pendulum",
}
PICKLES = (".pkl", ".pickle", ".pt", ".pth", ".joblib")
PICKLED = (b"\x80\x02", b"\x80\x03", b"\x80\x04", b"\x80\x05")  # protocols 2 to 5
FOLDERS = (  # format: what its folder holds
    ("lerobot", ("meta/info.json",)),
    ("bag", ("metadata.yaml",)),
    ("sage", ("state_motor.csv",)),
    ("emps", ("DATA_EMPS.parquet",)),
    ("emps", ("DATA_EMPS.mat",)),
    ("bam", ("runs.parquet", "runs.json")),
    ("so101", ("so101.parquet",)),
    ("double_pendulum", ("sysid.parquet",)),
)


def reader(name: str) -> ModuleType:
    """Return the module that reads a format; it has ``read(path, options)``."""
    return importlib.import_module(f"clie_blocks.analysis.records.readers.{READERS[name]}")


def recognise(path: str | os.PathLike[str]) -> str:
    """Return the format of a file or folder, from its content.

    What is missing, unreadable, empty, a pickle, or of no known format is refused.
    """
    path = Path(path)
    try:
        check_plain_file(path)
        if path.is_dir():
            return _folder(path)
        with open(path, "rb") as file:
            head = file.read(4096)
    except FileNotFoundError:
        raise RecordError(f"{path} does not exist; check the spelling") from None
    except OSError as error:
        raise RecordError(f"cannot open {path}: {error.strerror}") from None
    if not head:
        raise RecordError(f"{path} is empty; check that the log was written to its end")
    return _file(path, head)


def _folder(path: Path) -> str:
    for name, wanted in FOLDERS:
        if all((path / entry).is_file() for entry in wanted):
            return name
    raise RecordError(f"{path} is a folder of no known format (LeRobot, ROS 2 bag, SAGE, or trial "
                      "with robot.toml and log-*.csv); point at the log file itself")


def _file(path: Path, head: bytes) -> str:
    if head.startswith(b"PAR1"):
        return "parquet"
    if head.startswith(b"\x89MCAP0\r\n") or head.startswith(b"SQLite format 3\0"):
        return "bag"
    if head.startswith(b"\x89HDF\r\n\x1a\n") or head.startswith(b"MATLAB "):
        return "mat"
    if head.startswith(b"PK\x03\x04") or head.startswith(b"PK\x05\x06"):
        return _archive(path)
    if path.suffix.lower() == ".mat":
        return "mat"
    if path.suffix.lower() in PICKLES or head[:2] in PICKLED:
        raise RecordError(_pickle(path))
    if b"cmd.tau_J_d[0]" in head and b"state.q[0]" in head:
        return "franka"
    if head.lstrip(b"\xef\xbb\xbf").startswith(b"type,timestamp,positions"):
        return "sage"
    return "csv"


def _archive(path: Path) -> str:
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError, RuntimeError) as error:
        raise RecordError(f"{path} is a damaged archive: {error}; copy or export it "
                          "again") from None
    if path.suffix.lower() in PICKLES or any(name.endswith(".pkl") for name in names):
        raise RecordError(_pickle(path))
    if "xl/workbook.xml" in names:
        raise RecordError(f"{path} is a spreadsheet; save the sheet with the log as CSV")
    if not any(name.endswith(".npy") for name in names):
        raise RecordError(f"{path} is an archive without arrays; unpack it and point at the log")
    return "npz"


def _pickle(path: Path) -> str:
    return (f"{path} is a pickle, and opening one runs whatever program is in it, so it is never "
            "loaded; where you trust it, convert it once: "
            "data = torch.load(FILE) or pickle.load(open(FILE, 'rb')); "
            "numpy.savez('log.npz', **{key: numpy.asarray(value) for key, value in data.items()})")
