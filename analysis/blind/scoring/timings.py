"""What a study cost, kept apart: equal runs give equal pages, but not equal seconds."""

from typing import Any

FILE = "timings.json"


def without_timings(board: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return a scoreboard without its seconds, and the seconds, of the methods by name.

    Parameters
    ----------
    board : dict
        From `score.score`, with what `clie blind` adds to it.

    """
    plain = {key: value for key, value in board.items() if key != "seconds"}
    timings = {"seconds": board["seconds"]}
    if "compared" in board:
        timings["methods"] = {row["method"]: row["seconds"] for row in board["compared"]}
        plain["compared"] = [{key: value for key, value in row.items() if key != "seconds"}
                             for row in board["compared"]]
    return plain, timings
