"""What the verbs print: lines that fit, plain numbers, no warning of a library."""

import re

import pytest

from clie_blocks.analysis import cli
from clie_blocks.analysis.examples import FOLDER
from clie_blocks.output import WIDTH, format_table

EXAMPLE = str(FOLDER / "friction-arm")
LEG = str(FOLDER / "leg-without-torque")
QUICK = [
    ["example"], ["effects"], ["effects", "coulomb"], ["check", EXAMPLE], ["check", LEG],
    ["robot", "--check", f"{EXAMPLE}/robot.toml"], ["robot", "--check", f"{LEG}/robot.toml"],
    ["robot", "--gallery"], ["robot", "ur5e", "-o", "OUT"], ["robot", EXAMPLE, "-o", "OUT"],
    ["--version"], ["--help"]]
SLOW = [
    ["identify", EXAMPLE], ["identify", EXAMPLE, "--with", "coulomb,weight_cos,weight_sin"],
    ["diagnose", EXAMPLE, "--effects", "coulomb,backlash", "-o", "OUT"],
    ["loop", "--duration", "21", "-o", "OUT"], ["bounds", "-o", "OUT"]]


@pytest.mark.parametrize("words", [
    *QUICK, *(pytest.param(words, marks=pytest.mark.slow) for words in SLOW)],
    ids=" ".join)
def test_what_is_printed_can_be_read(words, tmp_path, capsys, recwarn, monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    code = cli.main([str(tmp_path) if word == "OUT" else word for word in words])
    shown = capsys.readouterr()
    assert code == 0, shown.err
    assert shown.out
    for text in (shown.out, shown.err):
        assert not re.search(r"np\.\w+\(|array\(|\bnan\b|Warning|Traceback|0x[0-9a-f]{6}", text)
        short = text.replace(str(tmp_path), "out").replace(str(FOLDER), "examples")
        assert [line for line in short.splitlines() if len(line) > 100] == []
    assert [str(one.message) for one in recwarn] == []


def test_a_table_wider_than_a_terminal_goes_on_below():
    head = ["joint", *(f"quantity {k} [N m s/rad]" for k in range(6))]
    text = format_table(head, [["shoulder", *"123456"], ["elbow", *"abcdef"]])
    parts = text.split("\n\n")
    assert len(parts) == 2 and all(len(line) <= WIDTH for line in text.splitlines())
    assert [line.split()[0] for part in parts for line in part.splitlines()] == [
        "joint", "shoulder", "elbow"] * 2
    shown = " ".join(text.split())
    assert all(cell in shown for cell in (*head, *"123456abcdef"))


def test_a_log_without_torque_is_not_refused_what_a_diagnosis_answers(capsys):
    assert cli.main(["check", LEG]) == 0
    shown = capsys.readouterr()
    able = " ".join(shown.out.split("Can be diagnosed:")[1].split("Cannot:")[0].split())
    assert "dry friction" in able and "the command is what the stated law gives" in able
    assert f"Next: clie diagnose {LEG} -o out" in shown.err
