"""A log as named columns that arrive in blocks, and how the wanted ones are packed."""

import contextlib
import dataclasses
import mmap
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import IO, Any, Self

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.errors import RecordError, visible

MOST_COLUMNS = 10_000
LONGEST_NAME = 1000  # characters
IN_MEMORY = 50_000_000  # bytes; beyond that the values go to a file that the arrays map
_ROWS_AT_ONCE = 20_000


@dataclasses.dataclass(frozen=True)
class Table:
    """Columns of a log.

    Parameters
    ----------
    names : tuple of str
        The header.
    blocks : callable
        ``blocks(indices)`` yields float arrays (m, k) of those columns, in order, row by row.
    source : str
        The file, and the part of it.
    decisions : list of str
        What the reader decided; it may grow while blocks arrive.
    time_unit : str, optional
        Unit of the clock where the format fixes it.

    """

    names: tuple[str, ...]
    blocks: Callable[[Sequence[int]], Iterator[np.ndarray]]
    source: str
    decisions: list[str] = dataclasses.field(default_factory=list)
    time_unit: str | None = None

    def __post_init__(self) -> None:
        if len(self.names) > MOST_COLUMNS:
            raise RecordError(f"{self.source} has {len(self.names)} columns, and a robot log has "
                              f"fewer than {MOST_COLUMNS}; export one row per sample and one "
                              "column per signal")
        if any(len(name) > LONGEST_NAME for name in self.names):
            raise RecordError(f"{self.source} has a column whose name is longer than "
                              f"{LONGEST_NAME} characters; it is no table with a header")
        object.__setattr__(self, "names", tuple(map(visible, self.names)))


def table_of(columns: Mapping[str, ArrayLike], source: str, **fields: Any) -> Table:
    """Return a table of whole arrays held in memory.

    Parameters
    ----------
    columns : dict of str to array_like, shape (N,) or (N, k)
        A matrix becomes columns ``name[0], name[1], ...``.
    source : str
        Where it came from.
    **fields
        Further fields of `Table`.

    """
    flat = {}
    for name, value in columns.items():
        array = np.asarray(value)
        if array.ndim == 1:
            flat[name] = array
        else:
            flat.update({f"{name}[{k}]": array[:, k] for k in range(array.shape[1])})
    sizes = {array.size for array in flat.values()}
    if len(sizes) > 1:
        listed = ", ".join(f"{name}: {array.size}" for name, array in list(flat.items())[:8])
        raise RecordError(f"{source}: the columns are not of one length ({listed})")

    def blocks(indices: Sequence[int]) -> Iterator[np.ndarray]:
        arrays = list(flat.values())
        yield np.column_stack([np.asarray(arrays[index], float) for index in indices])

    return Table(tuple(flat), blocks, source, **fields)


@dataclasses.dataclass(frozen=True)
class Packed:
    """The wanted columns of a log: the clock apart, the rest in rows, read-only."""

    stamps: np.ndarray
    values: np.ndarray
    valid: np.ndarray
    filled: np.ndarray
    dropped: int


def pack(blocks: Iterable[np.ndarray], factors: ArrayLike, needed: int) -> Packed:
    """Collect blocks whose first column is the clock.

    Parameters
    ----------
    blocks : iterable of ndarray, shape (m, 1 + k)
        Rows; those without a finite stamp are dropped and counted.
    factors : array_like, shape (k,)
        Factors to SI.
    needed : int
        A sample is valid when its first `needed` values are finite.

    Returns
    -------
    Packed
        Stamps as logged, values in SI, mask, and which columns ever held a number.

    """
    factors = np.asarray(factors, float)
    stamps, masks, dropped = [np.empty(0)], [np.empty(0, bool)], 0
    filled = np.zeros(factors.size, bool)
    with _Store(factors.size) as store:
        for block in blocks:
            good = np.isfinite(block[:, 0])
            dropped += int(good.size - np.count_nonzero(good))
            if not good.all():
                block = block[good]
            values = block[:, 1:] * factors
            finite = np.isfinite(values)
            stamps.append(block[:, 0].copy())
            masks.append(finite[:, :needed].all(axis=1))
            filled |= finite.any(axis=0)
            store.add(values)
        values = store.whole()
    return Packed(np.concatenate(stamps), values, np.concatenate(masks), filled, dropped)


class _Store:
    """Rows in memory, or once they are many, in an unnamed file that is mapped."""

    def __init__(self, width: int) -> None:
        self.width, self.rows = width, 0
        self.kept = [np.empty((0, width))]
        self.file: IO[bytes] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        if self.file is not None:
            self.file.close()  # a map of it lives on

    def add(self, block: np.ndarray) -> None:
        """Keep a block."""
        self.rows += len(block)
        self.kept.append(block)
        if self.file is not None or self.rows * self.width * 8 > IN_MEMORY:
            self._spill()

    def _spill(self) -> None:
        with _room_on_disk():
            file = self.file = self.file or tempfile.TemporaryFile()
            while self.kept:
                file.write(np.ascontiguousarray(self.kept.pop(0)).tobytes())

    def whole(self) -> np.ndarray:
        """Return all rows, read-only; in a file column after column, as most checks read them."""
        if self.file is None:
            whole = self.kept[1] if len(self.kept) == 2 else np.concatenate(self.kept)
        else:
            whole = np.asarray(self._by_column(self.file))
        whole.flags.writeable = False
        return whole

    def _by_column(self, file: IO[bytes]) -> np.ndarray:
        file.seek(0)
        with _room_on_disk(), tempfile.TemporaryFile() as columns:
            for first in range(0, self.rows, _ROWS_AT_ONCE):
                count = min(_ROWS_AT_ONCE, self.rows - first)
                block = np.frombuffer(file.read(8 * count * self.width)).reshape(count, self.width)
                for k in range(self.width):
                    columns.seek(8 * (k * self.rows + first))
                    columns.write(block[:, k].tobytes())
            columns.flush()
            return np.memmap(columns, float, "r", shape=(self.rows, self.width), order="F")


@contextlib.contextmanager
def _room_on_disk() -> Iterator[None]:
    """Say what to do where the disk is full."""
    try:
        yield
    except OSError as error:
        raise RecordError(f"the log has more than {IN_MEMORY / 1e6:.0f} MB of values and the "
                          f"folder for temporary files cannot hold them: {error.strerror}; "
                          "set TMPDIR to a larger disk") from None


def drop_pages(array: np.ndarray) -> None:
    """Give the memory of an array that maps a file back until it is read again.

    Of other arrays, and of maps that can be written to, nothing is given back.
    """
    base: Any = array
    while base is not None and not isinstance(base, np.memmap):
        base = getattr(base, "base", None)
    mapped = getattr(base, "base", None)
    if base is not None and base.mode == "r" and isinstance(mapped, mmap.mmap) \
            and hasattr(mmap, "MADV_DONTNEED"):
        mapped.madvise(mmap.MADV_DONTNEED)
