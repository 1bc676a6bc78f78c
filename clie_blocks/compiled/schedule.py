"""The order in which block outputs can be computed, from feedthrough signal by signal."""

from graphlib import CycleError, TopologicalSorter

from clie_blocks.labels import DiagramError


def schedule(needs, names):
    """Return all output signals, each after those that it needs at the same instant.

    Parameters
    ----------
    needs : dict
        Output signal to the set of output signals that reach it without passing a state.
    names : dict
        Output signal to ``'block.port'``, for the message.

    Returns
    -------
    list
        The keys of `needs` in a valid order.

    Raises
    ------
    DiagramError
        If signals depend on each other at once; the message names them around the loop.

    """
    try:
        return list(TopologicalSorter(needs).static_order())
    except CycleError as error:
        path = " -> ".join(names[signal] for signal in error.args[1])
        raise DiagramError(
            f"algebraic loop: {path}. Each of these signals needs the other at the same instant; "
            "break the loop with a block that has a state, such as a filter or a delay") from None
