"""What the verbs print: lines that fit, plain numbers, no warning of a library."""

import re

import pytest

from clie_blocks.analysis import cli
from clie_blocks.analysis.examples import FOLDER

EXAMPLE = str(FOLDER / "friction-arm")
QUICK = [
    ["example"], ["effects"], ["effects", "coulomb"], ["check", EXAMPLE],
    ["robot", "--check", f"{EXAMPLE}/robot.toml"], ["--version"], ["--help"]]
SLOW = [
    ["identify", EXAMPLE],
    ["diagnose", EXAMPLE, "--effects", "coulomb,backlash", "-o", "OUT"],
    ["bounds", "-o", "OUT"], ["loop", "--duration", "21", "-o", "OUT"]]
TABLES = ("check", "identify", "loop")  # their lines are rows, one a joint or a parameter


@pytest.mark.parametrize("words", [
    *QUICK, *(pytest.param(words, marks=pytest.mark.slow) for words in SLOW)],
    ids=lambda words: words[0])
def test_what_is_printed_can_be_read(words, tmp_path, capsys, recwarn, monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    code = cli.main([str(tmp_path) if word == "OUT" else word for word in words])
    shown = capsys.readouterr()
    assert code == 0, shown.err
    for text in (shown.out, shown.err):
        assert not re.search(r"np\.\w+\(|array\(|\bnan\b|Warning|Traceback|0x[0-9a-f]{6}", text)
        long = [line for line in text.splitlines() if len(line) > 100 and str(tmp_path) not in line
                and EXAMPLE not in line]
        assert words[0] in TABLES or long == []
    assert [str(one.message) for one in recwarn] == []
