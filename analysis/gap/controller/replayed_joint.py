"""The stated law of one joint, replayed on its logs with an effect of the catalogue in it."""

import dataclasses
from typing import Any

import numpy as np

from clie_blocks.analysis.gap.controller.kernels import Signals, Values, memory, with_effect
from clie_blocks.analysis.gap.controller.law_residual import known_samples
from clie_blocks.analysis.gap.problem.law import StatedLaw
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.effects.delay import DelayLine
from clie_blocks.effects.effect import Effect

AT_LIMIT = 1.0 - 1e-9  # of the limit of a command
PIECE = 2000  # samples of a log that refute most of what may have changed its command


@dataclasses.dataclass(frozen=True, eq=False)
class JointLog:
    """Signals of one joint in one log, as columns (N, 1).

    Parameters
    ----------
    signals : dict
        ``q_d``, ``q``, ``dq`` as the law forms it, and the excitation ``pe``.
    u : ndarray
        Logged command [N m].
    used : ndarray of bool, shape (N,)
        Samples in which the law's velocity is known and its command within its limit.
    at_rest : bool
        The log begins with the controller at rest.

    """

    signals: Signals
    u: np.ndarray
    used: np.ndarray
    at_rest: bool

    def part(self, piece: slice) -> "JointLog":
        """Some of its samples."""
        return JointLog({name: x[piece] for name, x in self.signals.items()}, self.u[piece],
                        self.used[piece], self.at_rest and not piece.start)


@dataclasses.dataclass(frozen=True, eq=False)
class ReplayedJoint:
    """A joint with its logs, its stated law, and what of a command is rounding.

    Parameters
    ----------
    law : StatedLaw
        Of this joint alone.
    logs : tuple of JointLog
        Its logs.
    limit : float
        Largest RMS that rounding explains [N m].

    """

    law: StatedLaw
    logs: tuple[JointLog, ...]
    limit: float

    @property
    def period(self) -> float:
        """Sample time [s]."""
        return self.law.period

    @property
    def kp(self) -> float:
        """Position gain [N m/rad]."""
        return float(self.law.kp[0])

    def left(self, log: JointLog) -> np.ndarray:
        """Logged command less that of the law [N m]."""
        return log.u - self._command(log.signals)

    def rms_left(self) -> float:
        """RMS of what the law leaves of the commands of all logs together [N m]."""
        return float(np.sqrt(np.mean(np.concatenate(
            [self.left(log)[log.used, 0] for log in self.logs]) ** 2)))

    def setpoint_behind(self, log: JointLog) -> np.ndarray:
        """Set-point that would give the logged command, less the logged one [rad]."""
        return self.left(log) / self.kp if self.kp else np.zeros_like(log.u)

    def residuals(self, effect: Effect, values: Values, fresh: bool = False,
                  wait: float | None = None) -> list[np.ndarray]:
        """Logged command less that of the law with an effect, in each log where it is known.

        That is `wait` samples behind its start, by default the memory of the effect.  What a sum
        held when a log was cut out of a longer run is not known: a constant there.
        """
        wait = memory(effect, values, self.period) if wait is None else wait
        left = []
        for log in self.logs:
            residual = log.u - self.command(effect, values, log, fresh)
            known = residual[_settled(0.0 if np.isinf(wait) else wait, log), 0]
            unknown = np.isinf(wait) and not log.at_rest
            left.append(known - known.mean() if unknown else known)
        return left

    def command(self, effect: Effect, values: Values, log: JointLog,
                fresh: bool = False) -> np.ndarray:
        """Command of the law with an effect in it, or as a recorder with that effect writes it."""
        signals, start = self._at_start(effect, log)
        if "u" not in _outputs(effect):
            return self._command(with_effect(effect, values, signals, self.period, start,
                                             fresh))
        recorded = effect.port == "log"
        law = self._command(signals) if recorded else self._unlimited(signals)
        u = with_effect(effect, values, {**signals, "u": law}, self.period, start, fresh)["u"]
        return u if recorded else np.clip(u, -self.law.saturation, self.law.saturation)

    def piece(self) -> "ReplayedJoint":
        """The joint in the part of a log in which the law leaves most."""
        energies = [np.where(log.used, self.left(log)[:, 0] ** 2, 0.0) for log in self.logs]
        windows = [np.convolve(x, np.ones(min(PIECE, len(x))), "valid") for x in energies]
        j = int(np.argmax([window.max() for window in windows]))
        first = int(np.argmax(windows[j]))
        part = self.logs[j].part(slice(first, first + PIECE))
        return dataclasses.replace(self, logs=(part,))

    def _at_start(self, effect: Effect, log: JointLog) -> tuple[Signals, float]:
        """Signals and state with which an effect begins: of a set-point, one that rested before.

        A limiter begins at the set-point that the first command shows, which may be on its way.
        """
        signals, read = log.signals, getattr(effect.sampled, "inputs", ())
        if read[:1] != ("q_d",) or "u" in _outputs(effect):
            return signals, 0.0
        first = float(signals["q_d"][0, 0])
        behind = float(self.setpoint_behind(log)[0, 0])
        if read != ("q_d",) or not log.used[0] or self.kp * abs(behind) <= self.limit:
            return signals, first
        q_d = signals["q_d"].copy()
        q_d[0] += behind
        return {**signals, "q_d": q_d}, first + behind

    def _command(self, signals: Signals) -> np.ndarray:
        return self.law.command(signals["q_d"] - signals["q"], signals["dq"], signals["pe"])

    def _unlimited(self, signals: Signals) -> np.ndarray:
        free = dataclasses.replace(self.law, saturation=np.full(1, np.inf))
        return free.command(signals["q_d"] - signals["q"], signals["dq"], signals["pe"])


def joint_of(problem: Problem, law: StatedLaw, k: int, limit: float) -> ReplayedJoint:
    """Joint k of a problem under a law, and what its commands leave to rounding [N m]."""
    return ReplayedJoint(_law_of(law, k), tuple(_joint_log(log, law, k) for log in problem.logs),
                         limit)


def _law_of(law: StatedLaw, k: int) -> StatedLaw:
    return dataclasses.replace(law, **{
        name: getattr(law, name)[..., k:k + 1]
        for name in ("kp", "kd", "numerator", "denominator", "resolution", "saturation")})


def _joint_log(log: Log, law: StatedLaw, k: int) -> JointLog:
    column = slice(k, k + 1)
    signals = {"q_d": log.q_d[:, column], "q": log.q[:, column],
               "dq": law.rate(log.q)[:, column], "pe": log.pe[:, column]}
    used = known_samples(log, law) & (np.abs(log.u[:, k]) < AT_LIMIT * law.saturation[k])
    return JointLog(signals, log.u[:, column], used, log.at_rest)


def _outputs(effect: Effect) -> tuple[str, ...]:
    build: Any = effect.sampled or effect.build
    return build.ports if isinstance(build, DelayLine) else build.outputs


def _settled(wait: float, log: JointLog) -> np.ndarray:
    """Samples that count, but for the first ones; at most half a log is left out."""
    return log.used & (np.arange(len(log.used)) >= min(wait, len(log.used) // 2))
