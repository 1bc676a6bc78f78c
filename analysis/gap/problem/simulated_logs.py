"""Logs of the user's own simulator: what they are missing is taken from the robot's logs."""




def complete(record, j, robots):
    """Simulator's log with the reference and excitation that it was not logged with.

    They are those of the robot's log of the same place, as the experiments are the same.

    Parameters
    ----------
    record : Record
        The simulator's log.
    j : int
        Its place among the simulator's logs.
    robots : list of Record
        The robot's logs.

    Returns
    -------
    Record
        The simulator's log; what was filled in is in its decisions.

    """
    lacks = [key for key in ("qd", "pe") if getattr(record, key) is None]
    if not lacks or j >= len(robots) or len(robots[j]) != len(record):
        return record
    given = {key: getattr(robots[j], key) for key in lacks}
    known = [key for key in lacks if given[key] is not None]
    if not known:
        return record
    return record.replace(**{key: given[key] for key in known}).noted(
        f"The simulator's log has no {' and no '.join(known)}: taken from {robots[j].source}.")
