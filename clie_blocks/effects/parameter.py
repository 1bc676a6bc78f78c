"""One parameter of an effect: unit, bounds, and the value that removes the effect."""

from dataclasses import dataclass


@dataclass(frozen=True, repr=False)
class Parameter:
    """One parameter of an effect.

    Parameters
    ----------
    name : str
        Keyword of the kernel; in a block the key is ``'<block>.<name>'``.
    unit : str
        SI unit, ``'1'`` for a pure number.
    lower, upper : float
        Bounds; values outside are refused.
    typical : float
        A value met on real joints.
    neutral : float or None
        The value that removes the effect bit for bit.  None for a shape parameter (a width, a
        frequency), which removes nothing on its own and takes `typical` when it is left out.
    meaning : str
        One phrase.
    per_joint : bool
        One value per joint; otherwise one value for the robot.
    of : str
        What it is a number of: the ``effect``, the ``robot``, whose file states it (a gear ratio,
        a length), or the ``run``, such as the width of a smoothed sign.

    """

    name: str
    unit: str
    lower: float
    upper: float
    typical: float
    neutral: float | None
    meaning: str
    per_joint: bool = True
    of: str = "effect"

    def __repr__(self) -> str:
        return (f"<parameter {self.name} [{self.unit}], {self.lower:g} to {self.upper:g}: "
                f"{self.meaning}>")

    @property
    def default(self) -> float:
        """Value of a parameter that is left out: neutral, or typical for one of the shape."""
        return self.typical if self.neutral is None else self.neutral
