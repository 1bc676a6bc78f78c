"""Robots of another engine under laws that run as blocks: by their gains, or in a file."""

import re

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.blind.engine.controller import filter_coefficients  # noqa: E402
from clie_blocks.analysis.blind.population.files import write_trial  # noqa: E402
from clie_blocks.analysis.blind.population.standard import draw_trial  # noqa: E402
from clie_blocks.analysis.gap.batch import read  # noqa: E402
from clie_blocks.analysis.gap.command import main  # noqa: E402
from clie_blocks.analysis.gap.diagnosis import diagnose  # noqa: E402

LAW = '''"""PID with the velocity of the error, and the weight compensated."""

from pathlib import Path

import control as ct
import numpy as np

N, T = {n}, {period}
B, A = {b}, {a}  # velocity filter
GAINS = {{key: np.array(value) for key, value in {gains}.items()}}

Path(__file__).with_name("was_run").touch()


def filtered(z, before):
    y = B[0] * z + before[0]
    return y, [B[1] * z - A[1] * y + before[1], B[2] * z - A[2] * y]


def parts(x, u):
    (q_d, q, pe), (total, *rest) = np.split(u, 3), np.split(x, 5)
    return q_d, q, pe, total + T * (q_d - q), rest[:2], rest[2:]


def update(t, x, u, params):
    q_d, q, pe, total, of_joint, of_reference = parts(x, u)
    return np.concatenate([total, *filtered(q, of_joint)[1], *filtered(q_d, of_reference)[1]])


def output(t, x, u, params):
    q_d, q, pe, total, of_joint, of_reference = parts(x, u)
    rate = filtered(q, of_joint)[0] - params["share"] * filtered(q_d, of_reference)[0]
    return (params["kp"] * (q_d - q) + params["ki"] * total - params["kd"] * rate
            + params["weight"] * np.cos(q) + pe)


controller = ct.nlsys(
    update, output, name="pid", dt=T, states=5 * N, params=GAINS,
    inputs=[f"{{name}}[{{k}}]" for name in ("q_d", "q", "pe") for k in range(N)],
    outputs=[f"u[{{k}}]" for k in range(N)])
'''


def under_pid(rng, robot, truth):
    """True parameters with an integral part, reference velocity, and a weight compensated."""
    return {**truth, "integral": 5 * robot.kp, "reference_speed": np.ones(robot.n),
            "compensated_weight": 0.1 * robot.kp}


@pytest.fixture
def trial(tmp_path):
    """Folder of a robot under PID, with its law in a file, some gains of which may be wrong."""
    def make(effects, seed, kind, **wrong):
        made = draw_trial(np.random.default_rng(seed), 0, "parametric", effects,
                          "medium" if effects else None, kind, wrong=under_pid)
        write_trial(made, tmp_path)
        robot, one = made.robot, np.ones(made.robot.n)
        b, a = (np.append(np.ravel(side), [0.0] * (3 - np.size(side))).tolist() for side in
                filter_coefficients(*robot.corners, robot.period, robot.discretisation))
        gains = {"kp": robot.kp, "ki": 5 * robot.kp, "kd": robot.kd, "share": one,
                 "weight": 0.1 * robot.kp}
        gains = {key: (value * wrong.get(key, 1.0)).tolist() for key, value in gains.items()}
        (tmp_path / "my_law.py").write_text(
            LAW.format(n=robot.n, period=robot.period, b=b, a=a, gains=gains))
        text = (tmp_path / "robot.toml").read_text()
        (tmp_path / "robot.toml").write_text(re.sub(
            r"\[controller\].*?sample_time_s", '[controller]\nlaw = "my_law.py:controller"\n'
            "sample_time_s", text, flags=re.DOTALL))
        return made
    return make


def test_a_program_is_not_run_unless_the_user_says_so(trial, tmp_path, capsys):
    trial((), 11, "pendulum")
    assert main([str(tmp_path), "--quiet"]) == 4
    assert re.search(r"my_law.py:controller.*--run-law", capsys.readouterr().err, re.DOTALL)
    assert not (tmp_path / "was_run").exists()


@pytest.mark.slow
def test_a_sound_robot_under_its_own_law_is_sound(trial, tmp_path):
    trial((), 11, "arm")
    found = diagnose(read(tmp_path, run_law=True))
    assert found.verdict == "none" and found.controller.as_stated


@pytest.mark.slow
def test_friction_is_named_under_a_law_of_the_users_own(trial, tmp_path):
    made = trial(("coulomb",), 12, "arm")
    answer = diagnose(read(tmp_path, run_law=True)).to_dict()
    first, level = answer["effects"][0], made.label["effects"][0]["numbers"]["level"][0]
    same = [row["probability"] for row in answer["effects"] if row["joint"] == [1]
            and row["effect"] in ("coulomb", "asymmetric_coulomb")]
    assert first["effect"] in ("coulomb", "asymmetric_coulomb") and sum(same) > 0.9
    assert answer["controller_as_stated"]
    value = next(iter(first["parameters"].values()))["value"][0]
    assert value == pytest.approx(level, rel=0.1)


@pytest.mark.slow
def test_wrong_gains_of_the_file_are_named_and_accuse_no_joint(trial, tmp_path, capsys):
    trial((), 11, "arm", ki=1.5, weight=0.0)
    assert main([str(tmp_path), "--run-law", "-o", str(tmp_path / "out")]) == 0
    said = " ".join(capsys.readouterr().out.split())  # lines are wrapped
    assert re.search(r"joint1: the law ran with ki \S+ \(stated", said)
    assert "agrees with the robot down to the sensor noise" in said
    page = next((tmp_path / "out").glob("*.html")).read_text()
    assert "The law ran with another ki and weight than stated" in page


@pytest.mark.slow
def test_a_part_that_the_file_lacks_does_not_hide_the_cause(trial, tmp_path):
    trial(("torque_ripple",), 14, "arm")
    program = (tmp_path / "my_law.py").read_text()
    (tmp_path / "my_law.py").write_text(program.replace('params["weight"] * np.cos(q)', "0.0"))
    found = diagnose(read(tmp_path, run_law=True))
    assert not found.controller.as_stated
    assert found.to_dict()["effects"][0]["effect"] == "torque_ripple"


@pytest.fixture
def by_gains(tmp_path):
    """Folder of a robot under PD or PID on the velocity of the error, stated by its gains."""
    def make(effects, seed, law, ki=5.0):
        def wrong(rng, robot, truth):
            integral = 5 * robot.kp if law == "pid" else 0 * robot.kp
            return {**truth, "integral": integral, "reference_speed": np.ones(robot.n)}

        made = draw_trial(np.random.default_rng(seed), 0, "parametric", effects,
                          "medium" if effects else None, "arm", wrong=wrong)
        write_trial(made, tmp_path)
        lines = [f'law = "{law}"', 'velocity_of = "error"']
        if law == "pid":
            lines.append(f"Ki = {(ki * made.robot.kp).tolist()}")
        text = (tmp_path / "robot.toml").read_text()
        (tmp_path / "robot.toml").write_text(
            text.replace("[controller]", "\n".join(["[controller]", *lines, "#"])))
        return made
    return make


@pytest.mark.slow
@pytest.mark.parametrize("law", ["pd", "pid"])
def test_a_sound_robot_under_a_law_of_stated_gains_is_sound(by_gains, tmp_path, law):
    by_gains((), 21, law)
    found = diagnose(read(tmp_path))
    assert found.verdict == "none" and found.controller.as_stated


@pytest.mark.slow
@pytest.mark.parametrize(("law", "effect", "seed", "names"), [
    ("pid", "actuator_lag", 22, {"actuator_lag", "time_delay"}), ("pd", "spring", 23, {"spring"}),
    ("pd", "velocity_filter_mismatch", 24, {"velocity_filter_mismatch"})])
def test_an_effect_is_named_under_a_law_of_stated_gains(by_gains, tmp_path, law, effect, seed,
                                                        names):
    made = by_gains((effect,), seed, law)
    first = diagnose(read(tmp_path)).to_dict()["effects"][0]
    assert first["effect"] in names and first["joint"] == made.label["effects"][0]["joints"]


@pytest.mark.slow
def test_an_integral_gain_that_is_stated_wrong_is_found(by_gains, tmp_path):
    made = by_gains((), 21, "pid", ki=8.0)
    found = diagnose(read(tmp_path))
    assert found.verdict == "none" and found.controller.misdescribed
    assert {one.name for one in found.controller.parameters} == {"ki"}
    for one in found.controller.parameters:
        assert one.value == pytest.approx(5 * made.robot.kp[one.joint], rel=1e-3)


@pytest.mark.slow
def test_a_filter_and_a_gain_that_are_both_stated_wrong_are_found(by_gains, tmp_path):
    made = by_gains(("velocity_filter_mismatch",), 24, "pid", ki=8.0)
    check = diagnose(read(tmp_path)).controller
    (joint,) = made.label["effects"][0]["joints"]
    assert check.other_filter == (joint - 1,) and not check.unexplained
    assert {one.name for one in check.parameters} == {"ki"}
    np.testing.assert_allclose([one.value for one in check.parameters], 5 * made.robot.kp,
                               rtol=1e-3)
