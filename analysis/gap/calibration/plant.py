"""Plain time stepping of robots to calibrate on; it shares no code with the diagnosis.

Every joint of every log of every robot is one lane of the same arrays.  Dry friction is Karnopp's:
inside a narrow band of speed a joint is held unless the torque on it exceeds the friction.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

PERIOD = 1e-3  # s
SUBSTEPS = 4
# rad/s: speed below which friction holds; four times that looks like a Stribeck effect.
HELD = 5e-5
DELAY_ROOM = 64
_NEUTRAL = dict(forward=0.0, asymmetry=0.0, excess=0.0, stribeck=1.0, quadratic=0.0, spring=0.0,
                lag=0.0, delay=0.0, dead=0.0, limit=1e9, gain=1.0, ripple=0.0, order=1.0,
                eccentric=0.0, tone=0.0, tone_hz=1.0, step=0.0, step_at=1e9, drift=0.0,
                drift_time=1.0, random_torque=0.0, modulated_damping=0.0, varying_stiffness=0.0,
                lost_commands=0.0, wavy_friction=0.0, soft_stop=0.0, heating=0.0, sag=0.0,
                hidden_integral=0.0, scaled_gain=0.0)


def simulate(lanes: Sequence[Mapping[str, Any]], rng: np.random.Generator,
             ) -> tuple[np.ndarray, np.ndarray]:
    """Simulate all lanes; returns measured positions and commands, shape (N, lanes).

    A lane holds the parameters of one joint and the motion of one log.
    """
    p = {key: np.array([lane.get(key, neutral) for lane in lanes])
         for key, neutral in _NEUTRAL.items()}
    p.update({key: np.array([lane[key] for lane in lanes])
              for key in ("inertia", "damping", "offset", "kp", "kd", "weight", "start", "lsb",
                          "sigma")})
    q_d = np.stack([lane["q_d"] for lane in lanes], axis=1)
    pe = np.stack([lane["pe"] for lane in lanes], axis=1)
    steps, count = q_d.shape
    drive, joints = _Drive(p), _Joints(p)
    past, filtered, last = np.zeros(count), np.zeros(count), None
    high, low, kp = 200.0 * PERIOD, 300.0 * PERIOD, p["kp"]
    measured, commands = np.empty((steps, count)), np.empty((steps, count))
    for i in range(steps):
        seen = joints.q
        if "eccentric" in joints.active:
            seen = seen + p["eccentric"] * np.sin(seen)
        seen = seen + p["sigma"] * rng.standard_normal(count)
        seen = p["lsb"] * np.round(seen / p["lsb"])
        last = seen if last is None else last
        fast = ((2 - high) * past + 2 * 200.0 * (seen - last)) / (2 + high)
        filtered = ((2 - low) * filtered + low * (fast + past)) / (2 + low)
        past, last = fast, seen
        u = kp * (q_d[i] - seen) - p["kd"] * filtered + pe[i]
        u = np.round(u / (2e-4 * kp)) * 2e-4 * kp
        measured[i], commands[i] = seen, u
        torque = drive.torque(i, u, q_d[i] - seen, rng.random((count,)))
        joints.advance(i * PERIOD, torque, rng.standard_normal((count,)))
    return measured, commands


def _active(p: Mapping[str, np.ndarray]) -> set[str]:
    """Parameters that differ from what leaves the motion alone: only their terms are computed."""
    return {key for key, neutral in _NEUTRAL.items() if np.any(p[key] != neutral)}


class _Drive:
    """From commands to the torque that enters the motors, with what a drive does to them."""

    def __init__(self, p: Mapping[str, np.ndarray]) -> None:
        count = p["kp"].size
        self.p, self.active = p, _active(p)
        self.queue, self.lanes = np.zeros((DELAY_ROOM, count)), np.arange(count)
        self.hit, self.kept = np.zeros(count), np.zeros(count)
        self.heat, self.integral = np.zeros(count), np.zeros(count)
        self.whole = np.minimum((p["delay"] / PERIOD).astype(int), DELAY_ROOM - 2)
        self.part = p["delay"] / PERIOD - self.whole

    def torque(self, i: int, u: np.ndarray, error: np.ndarray, dice: np.ndarray) -> np.ndarray:
        """Torque of step i for the command and the error of position, all (lanes,)."""
        p, active = self.p, self.active
        if "lost_commands" in active:
            lost = (dice < 0.02 * p["lost_commands"]) | (self.hit > 0)
            self.hit = np.where(lost, np.where(self.hit > 0, self.hit - 1, 30), 0)
            u = self.kept = np.where(lost & (p["lost_commands"] > 0), self.kept, u)
        sent = u
        if active & {"sag", "heating"}:
            load = np.abs(u) / (0.3 * p["kp"])
            self.heat = self.heat + PERIOD * load**2
            sent = u * (1 - p["sag"] * 0.1 * load
                        - p["heating"] * 0.1 * self.heat / (self.heat + 1))
        if active & {"scaled_gain", "hidden_integral"}:
            self.integral = self.integral + PERIOD * error
            sent = sent + p["kp"] * (0.05 * p["scaled_gain"] * error
                                     + 0.2 * p["hidden_integral"] * self.integral)
        if "delay" not in active:
            return sent
        self.queue[i % DELAY_ROOM] = sent
        early, late = ((i - self.whole - k) % DELAY_ROOM for k in (0, 1))
        return ((1 - self.part) * self.queue[early, self.lanes]
                + self.part * self.queue[late, self.lanes])


class _Joints:
    """Positions and velocities of the joints, and what acts on them."""

    def __init__(self, p: Mapping[str, np.ndarray]) -> None:
        count = p["kp"].size
        self.p, self.active = p, _active(p)
        self.q, self.dq = p["start"].copy(), np.zeros(count)
        self.lagged, self.slow = np.zeros(count), np.zeros(count)
        self.rate = np.where(p["lag"] > 0,
                             1 - np.exp(-PERIOD / SUBSTEPS / np.maximum(p["lag"], 1e-9)), 1.0)

    def advance(self, t: float, drive: np.ndarray, dice: np.ndarray) -> None:
        """Move by one period under the torque of the drive."""
        if "random_torque" in self.active:
            self.slow += PERIOD * (-2 * np.pi * self.slow + 3.0 * dice / np.sqrt(PERIOD))
        h = PERIOD / SUBSTEPS
        for k in range(SUBSTEPS):
            smooth = self._motor(drive) - self._opposing(t + k * h)
            q, dq, level = self.q, self.dq, self._level(smooth)
            if level is None:
                new = dq + h * smooth / self.p["inertia"]
            else:
                still, stuck = np.abs(dq) < HELD, np.abs(smooth) <= level
                friction = np.where(still, np.sign(smooth), np.sign(dq)) * level
                after = dq + h * (smooth - friction) / self.p["inertia"]
                held = stuck & (still | (after * dq < 0)) & (level > 0)
                new = np.where(held, 0.0, after)
            self.q, self.dq = q + h * (dq + new) / 2, new

    def _motor(self, drive: np.ndarray) -> np.ndarray:
        p, active = self.p, self.active
        self.lagged = torque = self.lagged + self.rate * (drive - self.lagged)
        if "dead" in active:
            torque = torque - np.clip(torque, -p["dead"], p["dead"])
        if "limit" in active:
            torque = np.clip(torque, -p["limit"], p["limit"])
        return p["gain"] * torque

    def _level(self, smooth: np.ndarray) -> np.ndarray | None:
        """Torque of dry friction (lanes,); None where there is none."""
        p, active = self.p, self.active
        if not active & {"forward", "wavy_friction"}:
            return None
        level = p["forward"]
        if "excess" in active:
            level = level * (1 + p["excess"] * np.exp(-(self.dq / p["stribeck"]) ** 2))
        if "wavy_friction" in active:
            level = level + 6e-3 * p["kp"] * p["wavy_friction"] * np.maximum(
                np.sin(9 * self.q), 0.0)
        if "asymmetry" in active:
            way = np.where(self.dq == 0, smooth, self.dq)
            level = level * np.where(way < 0, 1 - p["asymmetry"], 1.0)
        return level

    def _opposing(self, t: float) -> np.ndarray:
        """Torque that opposes the motion but for dry friction (lanes,)."""
        p, active, q, dq = self.p, self.active, self.q, self.dq
        damping, spring = p["damping"], p["spring"]
        if "modulated_damping" in active:
            damping = damping * (1 + 0.8 * p["modulated_damping"] * np.sin(5 * q))
        if "drift" in active:
            damping = damping + p["drift"] * (1 - np.exp(-t / p["drift_time"]))
        torque = damping * dq + p["offset"]
        if "quadratic" in active:
            torque = torque + p["quadratic"] * dq * np.abs(dq)
        if "varying_stiffness" in active:
            spring = spring + 0.1 * p["kp"] * p["varying_stiffness"] * np.sin(
                2.3 * t + np.sin(t))
        if active & {"spring", "varying_stiffness"}:
            torque = torque + spring * (q - p["start"])
        torque = torque + p["weight"] * np.cos(q)
        if "ripple" in active:
            torque = torque + p["ripple"] * np.sin(p["order"] * q + 1.0)
        if "tone" in active:
            torque = torque + p["tone"] * np.sin(2 * np.pi * p["tone_hz"] * t + 0.5)
        if "soft_stop" in active:
            torque = torque + 0.5 * p["kp"] * p["soft_stop"] * np.maximum(
                q - p["start"] - 0.1, 0.0)
        if "step" in active:
            torque = torque + p["step"] * (t > p["step_at"])
        if "random_torque" in active:
            torque = torque + 0.02 * p["kp"] * p["random_torque"] * self.slow
        return torque
