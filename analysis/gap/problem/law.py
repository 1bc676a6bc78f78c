"""The control law of a problem: what the stages need of it, and the law of a robot file."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Protocol, Self

import numpy as np

from clie_blocks.analysis.records.control_law import ControlLaw
from clie_blocks.analysis.theory.sampled_loop import held_plant, loop_polynomials

Filter = tuple[np.ndarray, np.ndarray]
"""Numerator and denominator in powers of z^-1."""


class ActingPiece(Protocol):
    """What a law needs to know of a piece of a cause."""

    @property
    def port(self) -> str:
        """Port of the joint at which it acts."""

    @property
    def states(self) -> int:
        """Memory per joint."""


class ReachableCause(Protocol):
    """What a law needs to know of a cause to say whether it can act in the loop."""

    @property
    def needs_links(self) -> bool:
        """Whether it acts through link data."""

    @property
    def pieces(self) -> Sequence[ActingPiece]:
        """How it acts."""


class LawLog(Protocol):
    """What a law reads in a log."""

    @property
    def law_q(self) -> np.ndarray:
        """Positions on which the law acts [rad], shape (N, n)."""

    @property
    def q_d(self) -> np.ndarray:
        """References [rad], shape (N, n)."""

    @property
    def pe(self) -> np.ndarray:
        """Excitations, shape (N, n)."""

    @property
    def of_drive(self) -> Mapping[str, np.ndarray]:
        """What the drives measured beside the position, by the port of a law that reads it."""

    @property
    def law_state(self) -> np.ndarray | None:
        """State of a law of the user's own at the first sample."""


class Law(Protocol):
    """What the stages need of a law, be it stated in a file or part of a user's loop.

    Gains, limits and filters have the shapes of `ControlLaw`; those of a user's loop are neutral.
    """

    @property
    def period(self) -> float:
        """Sample time [s]."""

    @property
    def kp(self) -> np.ndarray:
        """Position gains [command/rad], shape (n,)."""

    @property
    def kd(self) -> np.ndarray:
        """Velocity gains [command s/rad], shape (n,)."""

    @property
    def resolution(self) -> np.ndarray:
        """Rounding step of the command, shape (n,); 0 for none."""

    @property
    def saturation(self) -> np.ndarray:
        """Limit of the command, shape (n,); infinite for none."""

    @property
    def numerator(self) -> np.ndarray:
        """Numerators of the velocity filters, shape (3, n)."""

    @property
    def denominator(self) -> np.ndarray:
        """Denominators of the velocity filters, shape (3, n)."""

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

    def reaches(self, cause: ReachableCause) -> bool:
        """Whether a cause can act in the loop."""

    @property
    def beyond_reach(self) -> str:
        """Why some causes cannot act in the loop."""


@dataclasses.dataclass(frozen=True, eq=False)
class StatedLaw(ControlLaw):
    """The sampled law that a robot file states, or the one that ran according to the logs.

    With `measured_torque` the logged command is a measured torque: what drives do to a command is
    in it.
    """

    measured_torque: bool = False

    @classmethod
    def of(cls, law: ControlLaw, measured_torque: bool = False) -> Self:
        """The law with what the stages need of it."""
        return cls(**{field.name: getattr(law, field.name) for field in dataclasses.fields(law)},
                   measured_torque=measured_torque)

    def commands(self, log: LawLog) -> np.ndarray:
        """Commands of the law on the signals of a log, shape (N, n)."""
        return self.replay(log.law_q, log.q_d, log.pe)

    @property
    def pd(self) -> "StatedLaw":
        """The law in the form of (11), with gains and a velocity filter: itself."""
        return self

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

    def reaches(self, cause: ReachableCause) -> bool:
        """Whether a cause can show: a drive acts between command and measured torque."""
        return not (self.measured_torque and any(piece.port == "drive" for piece in cause.pieces))

    @property
    def beyond_reach(self) -> str:
        """Why what a drive does cannot show."""
        return "u is a measured torque, in which nothing that a drive does can show"

    def _polynomials(self, k: int, inertia: float, damping: float,
                     ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return loop_polynomials(held_plant(inertia, damping, self.period), self.kp[k], self.kd[k],
                                (self.numerator[:, k], self.denominator[:, k]))
