"""What the arguments and results of a program are called, and where they lie."""

import json
from dataclasses import dataclass

import numpy as np

from clie_blocks.compiled.frontend.parameters import Parameters


@dataclass(frozen=True, eq=False)
class Description:
    """All that a program tells of itself, in plain types; without what it computes.

    Parameters
    ----------
    name : str
        Name of the diagram.
    inputs, outputs : list of str
        Labels of the diagram.
    states : list of (str, str)
        Block and label of every state.
    slots : dict
        Entry of the record by signal.
    record : int
        Entries of the record.
    parameters : Parameters
        Where each parameter lies.
    period : float or None
        Sample time of a diagram in discrete time [s].

    """

    name: str
    inputs: list
    outputs: list
    states: list
    slots: dict
    record: int
    parameters: Parameters
    period: float | None

    def text(self) -> str:
        """Return the description as text, exact in every bit."""
        numbers = self.parameters
        return json.dumps({
            **{name: value for name, value in vars(self).items() if name != "parameters"},
            "parameters": [numbers.offset, numbers.shape, numbers.defaults.tolist(),
                           sorted(numbers.frozen)]})


def described(text: bytes) -> Description:
    """Return the description that a text holds."""
    told = json.loads(text)
    offset, shape, defaults, frozen = told["parameters"]
    shape = {key: tuple(sides) for key, sides in shape.items()}
    return Description(**{**told, "states": [tuple(state) for state in told["states"]],
                          "parameters": Parameters(offset, shape, np.array(defaults),
                                                   set(frozen))})
