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
    q, dq = p["start"].copy(), np.zeros(count)
    queue, lagged = np.zeros((DELAY_ROOM, count)), np.zeros(count)
    past, filtered, last = np.zeros(count), np.zeros(count), None
    hit, slow, kept = np.zeros(count), np.zeros(count), np.zeros(count)
    heat, integral = np.zeros(count), np.zeros(count)
    high, low = 200.0 * PERIOD, 300.0 * PERIOD
    measured, commands = np.empty((steps, count)), np.empty((steps, count))
    for i in range(steps):
        seen = q + p["eccentric"] * np.sin(q) + p["sigma"] * rng.standard_normal(count)
        seen = p["lsb"] * np.round(seen / p["lsb"])
        last = seen if last is None else last
        fast = ((2 - high) * past + 2 * 200.0 * (seen - last)) / (2 + high)
        filtered = ((2 - low) * filtered + low * (fast + past)) / (2 + low)
        past, last = fast, seen
        u = p["kp"] * (q_d[i] - seen) - p["kd"] * filtered + pe[i]
        u = np.round(u / (2e-4 * p["kp"])) * 2e-4 * p["kp"]
        measured[i], commands[i] = seen, u
        lost = (rng.random(count) < 0.02 * p["lost_commands"]) | (hit > 0)
        hit = np.where(lost, np.where(hit > 0, hit - 1, 30), 0)
        kept = np.where(lost & (p["lost_commands"] > 0), kept, u)
        load = np.abs(kept) / (0.3 * p["kp"])
        heat, integral = heat + PERIOD * load**2, integral + PERIOD * (q_d[i] - seen)
        queue = np.roll(queue, 1, axis=0)
        queue[0] = (kept * (1 - p["sag"] * 0.1 * load - p["heating"] * 0.1 * heat / (heat + 1))
                    + p["kp"] * (0.05 * p["scaled_gain"] * (q_d[i] - seen)
                                 + 0.2 * p["hidden_integral"] * integral))
        whole = np.minimum((p["delay"] / PERIOD).astype(int), DELAY_ROOM - 2)
        part, lane = p["delay"] / PERIOD - whole, np.arange(count)
        drive = (1 - part) * queue[whole, lane] + part * queue[whole + 1, lane]
        slow += PERIOD * (-2 * np.pi * slow + 3.0 * rng.standard_normal(count) / np.sqrt(PERIOD))
        q, dq, lagged = _advance(i * PERIOD, q, dq, lagged, drive, slow, p)
    return measured, commands


def _advance(t: float, q: np.ndarray, dq: np.ndarray, lagged: np.ndarray, drive: np.ndarray,
             slow: np.ndarray, p: Mapping[str, np.ndarray],
             ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, velocities and lagged torques after one period, all (lanes,)."""
    h = PERIOD / SUBSTEPS
    for k in range(SUBSTEPS):
        now = t + k * h
        rate = np.where(p["lag"] > 0, 1 - np.exp(-h / np.maximum(p["lag"], 1e-9)), 1.0)
        lagged = lagged + rate * (drive - lagged)
        torque = p["gain"] * np.clip(lagged - np.clip(lagged, -p["dead"], p["dead"]),
                                     -p["limit"], p["limit"])
        smooth = torque - _opposing(now, q, dq, slow, p)
        level = p["forward"] * (1 + p["excess"] * np.exp(-(dq / p["stribeck"]) ** 2))
        level = level + 6e-3 * p["kp"] * p["wavy_friction"] * np.maximum(np.sin(9 * q), 0.0)
        level = level * np.where(np.where(dq == 0, smooth, dq) < 0, 1 - p["asymmetry"], 1.0)
        still = np.abs(dq) < HELD
        held = still & (np.abs(smooth) <= level)
        friction = np.where(still, np.sign(smooth), np.sign(dq)) * level
        after = dq + h * (smooth - friction) / p["inertia"]
        turned = ~still & (after * dq < 0) & (np.abs(smooth) <= level)
        new = np.where((held | turned) & (level > 0), 0.0, after)
        q, dq = q + h * (dq + new) / 2, new
    return q, dq, lagged


def _opposing(t: float, q: np.ndarray, dq: np.ndarray, slow: np.ndarray,
              p: Mapping[str, np.ndarray]) -> np.ndarray:
    """Torque that opposes the motion but for dry friction (lanes,)."""
    drift = p["drift"] * (1 - np.exp(-t / p["drift_time"]))
    damping = p["damping"] * (1 + 0.8 * p["modulated_damping"] * np.sin(5 * q)) + drift
    spring = p["spring"] + 0.1 * p["kp"] * p["varying_stiffness"] * np.sin(2.3 * t + np.sin(t))
    return (damping * dq + p["offset"] + p["quadratic"] * dq * np.abs(dq)
            + spring * (q - p["start"]) + p["weight"] * np.cos(q)
            + p["ripple"] * np.sin(p["order"] * q + 1.0)
            + p["tone"] * np.sin(2 * np.pi * p["tone_hz"] * t + 0.5)
            + 0.5 * p["kp"] * p["soft_stop"] * np.maximum(q - p["start"] - 0.1, 0.0)
            + p["step"] * (t > p["step_at"]) + 0.02 * p["kp"] * p["random_torque"] * slow)
