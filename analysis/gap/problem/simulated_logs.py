"""Logs of the user's own simulator: missing signals are taken from the robot's logs."""

from collections.abc import Sequence

from clie_blocks.analysis.records import Record


def complete(simulated: Record, j: int, robot_records: Sequence[Record]) -> Record:
    """Simulator's log j with the reference and excitation of the robot's log j, if not logged.

    Both are logs of the same experiment.  What was filled in is in the decisions of the log.
    """
    missing = [key for key in ("qd", "pe") if getattr(simulated, key) is None]
    if not missing or j >= len(robot_records) or len(robot_records[j]) != len(simulated):
        return simulated
    logged = {key: getattr(robot_records[j], key) for key in missing}
    filled = {key: signal for key, signal in logged.items() if signal is not None}
    if not filled:
        return simulated
    return simulated.replace(**filled).noted(
        f"The simulator's log has no {' and no '.join(filled)}: taken from "
        f"{robot_records[j].source}.")
