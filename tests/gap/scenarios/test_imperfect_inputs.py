"""Logs that are not what they seem, diagnosed as a user does: written files, one command.

The robot has Coulomb friction at its first joint.  Every damage below once gave a confident wrong
name, an answer after minutes, or none.
"""

import gzip
import json
import os
import shutil
import subprocess
import sys

import pytest

from clie_blocks.analysis.blind.imperfect.damages import damage

pytestmark = pytest.mark.slow
ROWS = 10_000  # of each log, half of them
COMMAND = (sys.executable, "-c", "import sys; from clie_blocks.analysis.cli import main; "
           "sys.exit(main())")
CORRECTED = {
    "positions_in_degrees": ("units.position", "are in degrees"),
    "torque_in_mnm": ("units.torque", "are in mN m"),
    "torque_in_percent": ("units.torque", "times that of the law"),
    "torque_on_joint_side": ("torque.side", "on the joint side of the gear"),
    "command_sign": ("signs", "opposite sign"),
    "position_sign": ("signs", "opposite sign"),
    "commands_swapped": ("order", "swapped"),
    "positions_swapped": ("order", "swapped"),
    "late_command": ("lag", "too late"),
    "late_position": ("lag", "too late"),
    "lost_pe": ("missing.pe", "not logged as pe"),
    "dead_command": ("command.dead", "not recorded"),
    "position_offset": ("position.zero", "another zero"),
    "zero_offset": ("position.zero", "another zero"),
    "few_clock_digits": ("clock.coarse", "too few digits"),
    "coarse_clock": ("clock.coarse", "ticks every 0.0156 s"),
    "clock_reset": ("clock.reset", "starts again in the middle"),
    "noise_x5": ("position.noise", "did not read"),
    "noise_x20": ("position.noise", "did not read"),
    "repeated_rows": ("clock.repeated", "stamp of the next one"),
}


@pytest.fixture(scope="module")
def damaged(shared, tmp_path_factory):
    """Function from a damage to a folder with ten seconds of trial 007 that have it."""
    sound = shutil.copytree(shared / "blind" / "practice" / "trial-007",
                            tmp_path_factory.mktemp("sound") / "robot", copy_function=shutil.copy)
    sound.chmod(0o755)
    for log in sound.glob("log-*.csv.gz"):
        lines = gzip.decompress(log.read_bytes()).splitlines(keepends=True)
        log.unlink()
        log.write_bytes(gzip.compress(b"".join(lines[:1 + ROWS]), 1))

    def folder(name):
        out = tmp_path_factory.mktemp(name) / "robot"
        damage(name, sound, out, seed=7)
        return out
    return folder


def clie(*words, limit=300):
    return subprocess.run([*COMMAND, *map(str, words)], capture_output=True, text=True,
                          timeout=limit, check=False, env=dict(os.environ))


@pytest.mark.parametrize("name", CORRECTED)
def test_what_is_corrected_is_said_first_and_does_not_change_the_answer(name, damaged):
    check, words = CORRECTED[name]
    run = clie("diagnose", damaged(name), "--json")
    assert run.returncode == 0, run.stderr
    answer = json.loads(run.stdout)
    (correction,) = answer["log"]["corrections"]
    assert correction["check"] == check
    assert words in correction["what"]
    assert answer["verdict"] == "effect"
    assert answer["effects"][0]["effect"] == "coulomb" and answer["effects"][0]["joint"] == [1]
    assert answer["closed_percent"]["value"] > 95
    said = " ".join(run.stderr.split())  # lines are wrapped
    first, _, verdict = said.partition("The model is missing")
    assert "robot: Corrected in the logs: " in first and words in first
    assert verdict.startswith(" coulomb")


@pytest.mark.parametrize(("name", "code", "words"), [
    ("dead_position", 4, "Its position never changes"),
    ("joint_order", 3, "gains of joint1, joint2 in the robot file are swapped")])
def test_what_cannot_be_corrected_stops_at_once_with_the_remedy(name, code, words, damaged):
    run = clie("diagnose", damaged(name), limit=60)
    assert run.returncode == code
    assert words in run.stderr and "--trust-log" in run.stderr
    assert "Traceback" not in run.stderr
    identified = clie("identify", damaged(name), limit=60)
    assert identified.returncode == code and words in identified.stderr


def test_trusted_logs_are_taken_as_they_are(damaged):
    run = clie("diagnose", damaged("command_sign"), "--trust-log", "--json")
    answer = json.loads(run.stdout)
    assert answer["log"] == {"corrections": [], "warnings": []}
    assert not answer["controller_as_stated"]


@pytest.mark.parametrize(("name", "words"), [
    ("torque_in_percent", "times the stated inertia"),
    ("positions_in_degrees", "q were in degrees"),
    ("torque_on_joint_side", "joint side of the gear")])
def test_without_a_law_a_wrong_unit_stops(name, words, damaged):
    folder = damaged(name)
    text = (folder / "robot.toml").read_text()
    head, _, rest = text.partition("[controller]")
    (folder / "robot.toml").write_text(head + rest[rest.index("[encoder]"):])
    run = clie("diagnose", folder, limit=60)
    assert run.returncode == 3
    assert words in run.stderr


def test_check_says_what_the_diagnosis_corrects(damaged):
    run = clie("check", damaged("positions_in_degrees"))
    assert run.returncode == 0
    verdict, _, _ = run.stdout.partition("CORRECTED")
    assert "sound after 1 correction" in " ".join(verdict.split())  # wrapped, as paths are long
    assert "CORRECTED [units.position]" in run.stdout
    assert clie("check", damaged("joint_order")).returncode == 1
