"""LeRobot data sets, v2.1 (one file per episode) and v3.0 (many episodes per file).

They hold positions and goals, no velocity and no torque, on an idealised clock of index / fps.
"""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from clie_blocks.analysis.records.clock import segments
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.readers.options import Options, library_errors, need
from clie_blocks.analysis.records.units import to_si
from clie_blocks.errors import RecordError

STATE, ACTION = "observation.state", "action"
COLUMNS = (STATE, ACTION, "timestamp", "episode_index")


def read(path: Path, options: Options) -> list[Record]:
    """Return one record per episode of a LeRobot folder.

    The unit of positions is not in the data set: state it in `robot.toml` ([units] q = "deg"),
    else it is taken from the range of the values.

    """
    need("pyarrow.parquet", "reading LeRobot data sets", "parquet", "pyarrow")
    path = Path(path)
    names = _joint_names(path)
    files = sorted((path / "data").glob("chunk-*/*.parquet"))
    if not files:
        raise RecordError(f"{path} has no data/chunk-*/*.parquet; was the data set downloaded "
                          "without its data?")
    episodes = _episodes(files, len(names))
    if not episodes:
        raise RecordError(f"{path} has no frames; check the download")
    unit, note = _unit(episodes, options)
    return [_record(number, stamps, state, goal, names, unit, note, path)
            for number, (stamps, state, goal) in sorted(episodes.items())]


def _joint_names(path: Path) -> tuple[str, ...]:
    with library_errors(path / "meta" / "info.json", "JSON"):
        info = json.loads((path / "meta" / "info.json").read_text())
        feature = info["features"][STATE]
        names = feature.get("names") or [f"joint{k + 1}" for k in range(feature["shape"][0])]
        if isinstance(names, dict):
            names = next(iter(names.values()))
        return tuple(str(name).removesuffix(".pos") for name in names)


def _episodes(files: Sequence[Path], n: int) -> dict[int, list[np.ndarray]]:
    """Stamps, states and goals by episode."""
    import pyarrow.parquet as pq

    parts: dict[int, list[tuple[np.ndarray, np.ndarray, np.ndarray]]] = {}
    for file in files:
        with library_errors(file, "Parquet"):
            table = pq.read_table(file, columns=list(COLUMNS))
            stamps = table["timestamp"].to_numpy().astype(float)
            episode = table["episode_index"].to_numpy()
            state, goal = _matrix(table[STATE], n), _matrix(table[ACTION], n)
        for number in dict.fromkeys(episode.tolist()):
            rows = episode == number
            parts.setdefault(number, []).append((stamps[rows], state[rows], goal[rows]))
    return {number: [np.concatenate(group) for group in zip(*chunks)]
            for number, chunks in parts.items()}


def _matrix(column: Any, n: int) -> np.ndarray:
    flat = column.combine_chunks()
    flat = (flat.flatten() if not hasattr(flat, "chunks") else flat).to_numpy(zero_copy_only=False)
    return np.asarray(flat, float).reshape(len(column), n)


def _unit(episodes: Mapping[int, Sequence[np.ndarray]], options: Options) -> tuple[str, str]:
    stated = options.robot.units.get("q") if options.robot else None
    if stated:
        return stated, f"Positions are in {stated}, as robot.toml states."
    largest = max(float(np.abs(state[np.isfinite(state)]).max(initial=0))
                  for _, state, _ in episodes.values())
    if largest <= 2 * math.pi:
        return "rad", (f"No position exceeds {largest:.3g}: took them to be in rad; if not, state "
                       "[units] q in robot.toml.")
    if largest > 101:
        return "deg", (f"Positions reach {largest:.4g}, beyond the normalised range of 100: took "
                       "them to be in degrees and converted to rad; grippers (0 to 100) as well; "
                       "if not, state [units] q in robot.toml.")
    return "%", ("Positions may be degrees or -100..100 of the range; the data set does not say. "
                 "Kept as %: state [units] q in robot.toml to have rad.")


def _record(number: int, stamps: np.ndarray, state: np.ndarray, goal: np.ndarray,
            names: Sequence[str], unit: str, note: str, path: Path) -> Record:
    factor, base = to_si(unit, "q", str(path))
    ranges, notes = segments(stamps)
    return Record(
        time=stamps, q=state * factor, qd=goal * factor, joints=tuple(names),
        units={"q": base, "qd": base}, segments=ranges, source=f"{path} episode {number}",
        decisions=(note, "qd is the goal of the policy or of the teleoperator.",
                   "The clock is the frame number over the rate, not measured; there is neither "
                   "velocity nor torque, so friction and delay cannot be distinguished from the "
                   "firmware's loop.", *notes))
