"""A law of the library that gives the commands of a joint, in words and numbers."""

import dataclasses

CERTAIN = 0.995  # probability from which no number of it is told


@dataclasses.dataclass(frozen=True)
class FoundLaw:
    """The law that ran at a joint, with its probability and numbers.

    Parameters
    ----------
    joint : int
        The joint.
    name : str
        In words.
    probability : float
        Among the laws of the library that give the commands.
    numbers : dict of str to (float, float, str)
        Value, half width of its interval, and unit.
    others : tuple of (str, float)
        Other laws that give the commands, with probabilities.
    state : tuple of str
        Lines to write into [controller].

    """

    joint: int
    name: str
    probability: float
    numbers: dict[str, tuple[float, float, str]]
    others: tuple[tuple[str, float], ...]
    state: tuple[str, ...]

    def describe(self, joint: str, learned: bool = False) -> str:
        """The law as a sentence."""
        numbers = ", ".join(
            f"{name.replace('_', ' ')} {value:.4g} +- {half:.1g} {unit}".removesuffix(" 1")
            for name, (value, half, unit) in self.numbers.items())
        share = ">99 %" if self.probability > CERTAIN else f"{100 * self.probability:.0f} %"
        rivals = "".join(f", or {name} ({100 * p:.0f} %)" for name, p in self.others)
        fault = "" if learned else "; the robot file is wrong, or somebody changed the controller"
        return (f"{joint}: the law that ran is {self.name} ({share}{rivals}): {numbers}{fault}: "
                f"state {', '.join(self.state)} in [controller]")
