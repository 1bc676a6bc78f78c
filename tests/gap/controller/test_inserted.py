"""Effects of the catalogue inserted into a controller, and found again in the logs of its loop."""

import numpy as np
import one_joint
import pytest

from clie_blocks.analysis.gap.diagnosis import diagnose
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records import Record
from clie_blocks.effects import LIBRARY
from clie_blocks.labels import signals

ROWS = 5000
TIME = one_joint.PERIOD * np.arange(ROWS)
STEP = 1e-4  # N m, of the logged command
INSERTED = {
    "gain_error": {"kp_error": 0.12, "kd_error": -0.1},
    "control_law_form": {"share": 0.8, "corner": 80.0},
    "hidden_integral": {"ki": 20.0, "clamp": 1e4},
    "hidden_compensation": {"weight": 0.8, "friction": 0.3, "width": 0.05},
    "setpoint_slew": {"speed": 1.2},
    "setpoint_delay": {"delay": 0.02},
    "in_loop_delay": {"delay": 3.4e-3},
    "velocity_estimate_lag": {"lag": 4e-3},
    "channel_skew": {"skew": 2.4e-3},
    "sensor_gain": {"error": 0.08, "bias": 0.2},
}


class Inserted:
    """Block of an effect, run sample by sample."""

    def __init__(self, name, values):
        self.port = LIBRARY[name].port
        self.block = LIBRARY[name](**values).block(1, one_joint.PERIOD)
        self.state = np.zeros(self.block.nstates)

    def behind(self, **known):
        """Signals behind the block, of those in front of it."""
        labels = {label: name for name in known for label in signals(name, n=1)}
        read = np.array([known[labels[label]] for label in self.block.input_labels])
        out = self.block.output(0.0, self.state, read, params=self.block.params)
        if self.block.nstates:
            self.state = self.block.dynamics(0.0, self.state, read, params=self.block.params)
        return {**known, **{labels[label]: float(x)
                            for label, x in zip(self.block.output_labels, out)}}


def run(j, name, values):
    """Log of the joint under a controller, or a recorder, with an effect in it."""
    q_d = (0.7 * np.sin(2 * np.pi * 0.23 * (1 + j / 4) * TIME) + 0.2 * np.sin(4.5 * TIME + j)
           - 0.2 * np.sin(j))
    pe = 2.5 * np.sin(2 * np.pi * np.outer(TIME, [0.31, 1.7, 5.3]) + 3.0 * j).sum(axis=1)
    noise = one_joint.NOISE * np.random.default_rng(j).standard_normal(ROWS)
    effect, q, dq, rows, last = Inserted(name, values), 0.0, 0.0, [], None
    for t, set_point, excitation, error in zip(TIME, q_d.tolist(), pe.tolist(), noise.tolist()):
        measured = round((q + error) / one_joint.RESOLUTION) * one_joint.RESOLUTION
        rate = 0.0 if last is None else (measured - last) / one_joint.PERIOD
        seen, last = {"q_d": set_point, "q": measured, "dq": rate}, measured
        reads_u = "u[0]" in effect.block.output_labels
        if not reads_u:
            seen = effect.behind(**seen)
        u = (one_joint.KP * (seen["q_d"] - seen["q"]) - one_joint.KD * seen["dq"] + excitation)
        logged = u
        if reads_u:
            logged = effect.behind(**seen, u=u)["u"]
            u = u if effect.port == "log" else logged
        rows.append((measured, np.round(logged / STEP) * STEP))
        q, dq = one_joint._fine(q, dq, t, u, one_joint.Physics())
    rows = np.array(rows)
    return Record(time=TIME, q=rows[:, :1], u=rows[:, 1:], qd=q_d[:, None], pe=pe[:, None],
                  source=f"log-{j + 1}")


@pytest.mark.slow
@pytest.mark.parametrize("name", INSERTED)
def test_what_is_inserted_is_named(name):
    robot = one_joint.robot()
    found = diagnose(Problem.from_logs(robot, [run(j, name, INSERTED[name]) for j in range(3)]))
    answer = found.to_dict()
    leading = answer["effects"][0]
    assert answer["verdict"] == "effect" and not answer["controller_as_stated"]
    assert name in (leading["effect"], *leading["alike"]) and leading["joint"] == [1]
    for key, entry in leading["parameters"].items():
        (low,), (high,) = entry["interval"]
        assert low <= INSERTED[name][key] <= high, key
    assert answer["set_90"] == [leading["effect"]]
    assert answer["gap_after"] < 1.5 * answer["gap_floor"]
