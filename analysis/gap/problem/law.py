"""The control law of a problem: what the stages ask of it, and the law of a robot file."""

import dataclasses
from typing import Any, Protocol, Self

import numpy as np

from clie_blocks.analysis.records.control_law import ControlLaw
from clie_blocks.analysis.theory.sampled_loop import held_plant, loop_polynomials

Filter = tuple[np.ndarray, np.ndarray]  # numerator and denominator in powers of z^-1


class Law(Protocol):
    """What the stages ask of a law, be it stated in a file or part of a user's loop.

    Gains, limits and filters have the shapes of `ControlLaw`; those of a user's loop are neutral.
    """

    period: float

    @property
    def kp(self) -> np.ndarray: ...  # noqa: D102

    @property
    def kd(self) -> np.ndarray: ...  # noqa: D102

    @property
    def resolution(self) -> np.ndarray: ...  # noqa: D102

    @property
    def saturation(self) -> np.ndarray: ...  # noqa: D102

    @property
    def numerator(self) -> np.ndarray: ...  # noqa: D102

    @property
    def denominator(self) -> np.ndarray: ...  # noqa: D102

    @property
    def holds_joints(self) -> bool:
        """Whether feedback holds the joints near the reference."""

    @property
    def takes_excitation(self) -> bool:
        """Whether a torque can be added to the command."""

    @property
    def is_replayable(self) -> bool:
        """Whether the command follows from the logged signals alone, without a plant."""

    def torque_sensitivity(self, k: int, inertia: float, damping: float) -> Filter:
        """S_tau(z) of joint k, position per torque [rad/(N m)]."""

    def sensor_sensitivity(self, k: int, inertia: float, damping: float) -> Filter:
        """S_0(z) of joint k, measured position per sensor error."""

    def reaches(self, cause: Any) -> bool:
        """Whether a cause can act in the loop."""


@dataclasses.dataclass(frozen=True, eq=False)
class StatedLaw(ControlLaw):
    """The sampled law that a robot file states, or the one found to have run."""

    @classmethod
    def of(cls, law: ControlLaw) -> Self:
        """The law with what the stages ask of it."""
        return cls(**{field.name: getattr(law, field.name) for field in dataclasses.fields(law)})

    @property
    def holds_joints(self) -> bool:
        """Whether any gain is stated."""
        return bool(self.kp.any() or self.kd.any())

    @property
    def takes_excitation(self) -> bool:
        """The law (11) takes one."""
        return True

    @property
    def is_replayable(self) -> bool:
        """A stated law computes its command from the logged signals."""
        return True

    def torque_sensitivity(self, k: int, inertia: float, damping: float) -> Filter:
        """S_tau(z) of joint k, position per torque [rad/(N m)]."""
        torque, _, denominator = self._polynomials(k, inertia, damping)
        return torque, denominator

    def sensor_sensitivity(self, k: int, inertia: float, damping: float) -> Filter:
        """S_0(z) of joint k, measured position per sensor error."""
        _, sensor, denominator = self._polynomials(k, inertia, damping)
        return sensor, denominator

    def reaches(self, cause: Any) -> bool:
        """Every cause of the library can act in a stated loop."""
        return True

    def _polynomials(self, k: int, inertia: float, damping: float,
                     ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return loop_polynomials(held_plant(inertia, damping, self.period), self.kp[k], self.kd[k],
                                (self.numerator[:, k], self.denominator[:, k]))
