"""What the arguments and results of a program are called, and where they lie."""

import json
from dataclasses import dataclass

import numpy as np

from clie_blocks.compiled.ir.parameters import Parameters


@dataclass(frozen=True, eq=False)
class Description:
    """The labels and sizes of a program, in plain types; not what it computes.

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
    operations : int
        How many of them a step takes, about.

    """

    name: str
    inputs: list[str]
    outputs: list[str]
    states: list[tuple[str, str]]
    slots: dict[str, int]
    record: int
    parameters: Parameters
    period: float | None
    operations: int

    def text(self) -> str:
        """Return the description as text, exact in every bit."""
        parameters = self.parameters
        return json.dumps({
            **{name: value for name, value in vars(self).items() if name != "parameters"},
            "parameters": [parameters.offset, parameters.shape, parameters.defaults.tolist(),
                           sorted(parameters.frozen)]})


def parse_description(text: bytes) -> Description:
    """Return the description that a text holds."""
    fields = json.loads(text)
    offset, shape, defaults, frozen = fields["parameters"]
    shape = {key: tuple(sides) for key, sides in shape.items()}
    return Description(**{
        **fields, "states": [tuple(state) for state in fields["states"]],
        "parameters": Parameters(offset, shape, np.array(defaults), set(frozen))})
