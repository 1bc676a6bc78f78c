"""Whatever a record holds, the check answers or refuses in words; it never breaks."""

import json

import numpy as np
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from clie_blocks.analysis.records.check_report import as_dict, as_text, check_log
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.robot_sections import Motor
from clie_blocks.errors import ClieError
from clie_blocks.output import to_json

SHAPES = ("zero", "constant", "ramp", "sine", "noise", "steps", "huge", "tiny", "holes", "empty")


def signal(kind, size, n, random):
    k = np.arange(size)[:, None] + 7.0 * np.arange(n)
    made = {
        "zero": lambda: 0.0 * k, "constant": lambda: 0.0 * k + 3.5, "ramp": lambda: 1e-3 * k,
        "sine": lambda: np.sin(0.01 * k), "noise": lambda: random.standard_normal(k.shape),
        "steps": lambda: np.floor(k / 50) % 3, "huge": lambda: 1e200 * np.sin(0.01 * k),
        "tiny": lambda: 1e-200 * np.sin(0.01 * k),
        "holes": lambda: np.where(random.random(k.shape) < 0.02, np.nan, np.sin(0.02 * k)),
        "empty": lambda: np.full(k.shape, np.nan)}
    return made[kind]()


def refuse(word):
    raise AssertionError(f"{word} is not JSON")


def clock(kind, size, random):
    even = 1e-3 * np.arange(size)
    return {"even": even, "jitter": even + 3e-4 * random.random(size), "zero": 0 * even,
            "coarse": np.floor(even / 0.01) * 0.01, "backward": even[::-1].copy(),
            "gap": even + (even > 0.1), "random": np.sort(random.random(size))}[kind]


@example(size=1500, n=2, kinds={"q": "sine", "u": "zero"}, time="random", law="pd", seed=68)
@settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))
@given(size=st.sampled_from([1, 2, 3, 5, 30, 250, 1500]), n=st.integers(1, 3),
       kinds=st.fixed_dictionaries({"q": st.sampled_from(SHAPES)}, optional={
           name: st.sampled_from(SHAPES) for name in ("u", "qd", "pe", "dq", "tau")}),
       time=st.sampled_from(["even", "jitter", "zero", "coarse", "backward", "gap", "random"]),
       law=st.sampled_from([None, "pd", "cascade", "servo", "unknown"]),
       seed=st.integers(0, 99))
def test_every_record_gets_an_answer(size, n, kinds, time, law, seed):
    random = np.random.default_rng(seed)
    gains = {"law": law, "kp": [10.0] * n, "kd": [1.0] * n, "kv": [2.0] * n, "highpass": 200.0,
             "lowpass": 300.0, "discretisation": "tustin"} if law else {}
    robot = Robot(n, controller=Controller(**gains), motor=Motor(
        gear_ratio=[50.0] * n, inertia=[1e-4] * n)) if law else None
    try:
        record = Record(clock(time, size, random), robot=robot, **{
            name: signal(kind, size, n, random) for name, kind in kinds.items()})
        report = check_log(record)
    except ClieError:
        return
    assert report.exit_code in (0, 1, 4)
    assert as_text(report).split("\n\n")[-1].startswith("Most helpful next: ")
    json.loads(to_json(as_dict(report)), parse_constant=refuse)
