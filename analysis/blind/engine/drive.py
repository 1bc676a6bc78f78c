"""What a drive does to a command before it is a torque, where the engine has no such part.

Each part is a small function of its own and is called only where a lane has it.  Arrays have
shape (lanes, n).
"""

import numpy as np

from clie_blocks.analysis.blind.engine.actuators import STEP
from clie_blocks.analysis.blind.engine.chance import LaneRandom, RandomSwitch
from clie_blocks.analysis.blind.engine.delay_line import DelayLine
from clie_blocks.analysis.blind.engine.moment import Moment
from clie_blocks.analysis.blind.engine.parameters import Parameters
from clie_blocks.analysis.blind.engine.robot import DrawnRobot


class Drive:
    """What becomes of a command before it reaches the motor.

    Some parts act once on each command, others on the torque as the motor turns.

    Parameters
    ----------
    robot : DrawnRobot
        As stated.
    p : dict of ndarray, shape (lanes, n)
        True parameters.
    random : LaneRandom
        Source of chance.

    """

    BURST = 0.03  # s, mean length of a loss
    PARTS = 4  # of a step of the engine, in which a late command may begin
    CONTACT, OPEN = 0.5, 0.015  # s, mean times of a brush that loses its contact

    def __init__(self, robot: DrawnRobot, p: Parameters, random: LaneRandom) -> None:
        self.robot, self.p, self.random = robot, p, random
        self.kept: np.ndarray | float = 0.0
        self.until: np.ndarray | float = -1.0
        self.last: np.ndarray | None = None
        self.command: np.ndarray | float = 0.0
        self.sent, self.line = 0.0, DelayLine(p["jitter"].max(), robot.period)
        self.opens = RandomSwitch(random, self.CONTACT, self.OPEN, robot.period)
        parts = {"lost": self._lose_packets, "dead": self._dead_zone, "sag": self._sag_supply,
                 "hold": self._hold_packets, "quantum": self._quantise,
                 "source_sag": self._sag_source, "brush": self._lift_brush}
        turning = {"jitter": self._slip_clock, "phase_gain": self._commutate,
                   "droop": self._fall_short}
        self.parts = [part for key, part in parts.items() if np.any(p[key] > 0)]
        if np.isfinite(p["torque_slew"]).any():
            self.parts.append(self._slew)
        self.turning = [part for key, part in turning.items() if np.any(p[key] > 0)]

    def __call__(self, t: float, u: np.ndarray) -> np.ndarray:
        """Command that reaches the motor [N m]."""
        for part in self.parts:
            u = part(t, u)
        self.command, self.sent = u, t
        if self._slip_clock in self.turning:
            self.line.append(u)
        return u

    def torque(self, now: Moment) -> np.ndarray:
        """Torque of the motor between two commands [N m]; ``now.u`` is the command."""
        for part in self.turning:
            now = now._replace(u=part(now))
        return now.u

    def _lose_packets(self, t: float, u: np.ndarray) -> np.ndarray:
        fresh = self.random("random") < self.p["lost"] * self.robot.period / self.BURST
        hit = fresh & (t >= self.until)
        end = t + self.BURST * self.random("standard_exponential")
        self.until = np.where(hit, end, self.until)
        self.kept = np.where(t < self.until, self.kept, u)
        return self.kept

    def _dead_zone(self, t: float, u: np.ndarray) -> np.ndarray:
        return u - np.clip(u, -self.p["dead"], self.p["dead"])

    def _sag_supply(self, t: float, u: np.ndarray) -> np.ndarray:
        return u * (1 - self.p["sag"] * np.sum(np.abs(u) / self.robot.kp, axis=-1, keepdims=True))

    def _sag_source(self, t: float, u: np.ndarray) -> np.ndarray:
        """Voltage of one source behind a resistance, which the currents of all motors load."""
        load = np.sum(np.abs(u), axis=-1, keepdims=True) / self.robot.kp.mean()
        return u * np.maximum(1 - self.p["source_sag"] * load, 0.0)

    def _hold_packets(self, t: float, u: np.ndarray) -> np.ndarray:
        """Other traffic takes the bus at equal intervals; the drive keeps its last command."""
        interval = self.p["hold_interval"]
        since = (t + interval * self.p["phase"] / (2 * np.pi)) % interval
        self.last = u if self.last is None else np.where(since < self.p["hold"], self.last, u)
        return self.last

    def _quantise(self, t: float, u: np.ndarray) -> np.ndarray:
        quantum = self.p["quantum"]
        return np.where(quantum > 0, np.rint(u / np.where(quantum > 0, quantum, 1)) * quantum, u)

    def _slew(self, t: float, u: np.ndarray) -> np.ndarray:
        """Torque that changes by so much per second at most."""
        most = self.p["torque_slew"] * self.robot.period
        self.last = u if self.last is None else self.last + np.clip(u - self.last, -most, most)
        return self.last

    def _lift_brush(self, t: float, u: np.ndarray) -> np.ndarray:
        return u * (1 - self.p["brush"] * self.opens())

    def _slip_clock(self, now: Moment) -> np.ndarray:
        """Drive with a clock of its own: its commands are older the further the two have slipped.

        The age grows to ``jitter`` and falls back, ``beat`` times a second.  Commands change
        within a step of the engine, over which the torque is their mean.
        """
        p = self.p
        age = p["jitter"] * ((p["beat"] * now.t + p["phase"] / (2 * np.pi)) % 1.0)
        within = now.t - self.sent + STEP * (np.arange(self.PARTS) + 0.5) / self.PARTS
        mean = np.mean([self.line.held(age, since) for since in within], axis=0)
        return np.where(p["jitter"] > 0, mean, now.u)

    def _commutate(self, now: Moment) -> np.ndarray:
        """Two windings, of which one gets less current: its sensor reads ``1 + phase_gain``.

        The drive was calibrated as it is, so that its mean torque over a turn is the command.
        """
        angle = self.p["pole_pairs"] * self.robot.ratio * now.q + self.p["phase"]
        sine, less = np.sin(angle) ** 2, 1 / (1 + self.p["phase_gain"])
        return now.u * (sine * less + 1 - sine) / ((less + 1) / 2)

    def _fall_short(self, now: Moment) -> np.ndarray:
        """Voltage that the turning motor uses up: less torque the faster it goes."""
        fall = self.p["droop"] * now.dq
        least, most = (self.p["peak"] * np.clip(1 + sign * fall, 0, 1) for sign in (1, -1))
        return np.clip(now.u, -least, most)
