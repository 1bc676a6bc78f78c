"""Lag of a measured torque behind the positions in the rows of a log."""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records.corrections import Correction


@dataclasses.dataclass(frozen=True)
class TorqueLag:
    """Lag of the torque in a row of the log behind the position there.

    Parameters
    ----------
    age : float
        How much older the torque is [s]; less than zero where the position is older.
    time_constant : float
        Of a low-pass of the first order that it passed [s].

    """

    age: float = 0.0
    time_constant: float = 0.0

    def __add__(self, more: "TorqueLag") -> "TorqueLag":
        """Both together, as slow torques see them."""
        return TorqueLag(self.age + more.age, self.time_constant + more.time_constant)

    @property
    def seconds(self) -> float:
        """Delay of a torque that changes slowly [s]."""
        return self.age + self.time_constant

    @property
    def correction(self) -> Correction:
        """What the logs held, what was done about it, and by what that is shown."""
        late, other = ("torque", "position") if self.seconds > 0.0 else ("position", "torque")
        what = (f"The {late} in a row is {1e3 * abs(self.seconds):.2g} ms older than the {other} "
                "there.")
        if self.time_constant:
            corner = 1.0 / (2.0 * np.pi * self.time_constant)
            what = f"The torque passed a low-pass of about {corner:.2g} Hz before it was logged."
        return Correction(
            "torque.filtered" if self.time_constant else f"{late}.late", (), what,
            "Models are driven by the torque " + ("before the low-pass." if self.time_constant
                                                  else "of the same instant."),
            "With it they follow the motion; no torque of place, speed and load does that.",
            "channel_skew" if self.is_skew else "")

    @property
    def is_skew(self) -> bool:
        """Whether the recorder wrote a torque of another instant."""
        return self.age > 0.0 and not self.time_constant

    def compensated(self, torque: np.ndarray, period: float) -> np.ndarray:
        """Torque (N, n) at the instants of the positions, of ticks every `period` [s]."""
        before = torque + self.time_constant * np.gradient(torque, period, axis=0)
        time = period * np.arange(len(torque))
        return np.stack([np.interp(time + self.age, time, one) for one in before.T], axis=1)


def without_torque_lag(problem: Problem, lag: TorqueLag) -> Problem:
    """Problem whose models are driven by the torque of the instants of the positions."""
    def compensated(log: Log) -> Log:
        change = lag.compensated(log.u, problem.period) - log.u
        return dataclasses.replace(log, u=log.u + change, pe=log.pe + change)

    return problem.with_logs(compensated)
