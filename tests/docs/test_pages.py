"""The hour of each user: every tutorial and how-to by its own commands, as a user would.

In an empty folder, with the wheel in a new environment that has what the wheel asks for only.
"""

import json
import os
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = sorted([*(DOCS / "tutorials").glob("*.md"), *(DOCS / "howto").glob("*.md")])
PLAYED = [page for page in PAGES if page.name != "own_law.md"]  # by tests/gap/scenarios
BLOCK = re.compile(r"^```(sh|python|text)\n(.*?)^```$", re.M | re.S)
FORMATS = (DOCS / "reference" / "files.md").read_text()
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+\.?\d*(?:e[-+]?\d+)?")


def script(page):
    """Commands of a page as one script; those that the README runs are left out."""
    readme = (ROOT / "README.md").read_text().replace(".venv/bin/", "")
    lines = []
    for language, code in BLOCK.findall(page.read_text()):
        if language == "sh" and code not in readme:
            lines.append(code)
        elif language == "python":
            lines.append(f"python - <<'END_OF_PYTHON'\n{code}END_OF_PYTHON\n")
    return "".join(lines)


def shown(page):
    """Outputs that a page shows."""
    return [code for language, code in BLOCK.findall(page.read_text()) if language == "text"]


def contains(said, wanted):
    """Whether an output was said: its words as they are, its numbers within 10 %."""
    said, wanted = " ".join(said.split()), " ".join(wanted.split())
    pattern = "".join(
        rf"({NUMBER.pattern})" if NUMBER.fullmatch(part) else re.escape(part)
        for part in re.split(rf"({NUMBER.pattern})", wanted))
    numbers = [float(number) for number in NUMBER.findall(wanted)]
    return any([float(number) for number in match.groups()]
               == pytest.approx(numbers, rel=0.1, abs=1e-3)
               for match in re.finditer(pattern, said))


@pytest.mark.slow
@pytest.mark.parametrize("page", PLAYED, ids=lambda page: f"{page.parent.name}/{page.stem}")
def test_a_page_is_played_as_printed(page, fresh_environment, tmp_path):
    pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    environment["PATH"] = f"{fresh_environment}:{environment['PATH']}"
    run = subprocess.run(["bash", "-euo", "pipefail"], input=script(page), text=True, cwd=tmp_path,
                         env=environment, capture_output=True, timeout=300)
    assert run.returncode == 0, run.stderr
    files = "".join(path.read_text() for path in tmp_path.rglob("*.xml"))
    for text in shown(page):
        assert contains(run.stdout + run.stderr + files, text), (text, run.stdout)
    answers = [json.loads(path.read_text()) for path in tmp_path.rglob("*.json")]
    keys = {key for answer in answers if "set_90" in answer for key in answer}
    assert not {key for key in keys if f"`{key}`" not in FORMATS}


def test_every_page_has_commands():
    assert len(PAGES) >= 14
    assert not [page.name for page in PAGES if not script(page)]


def test_an_output_with_other_words_or_numbers_is_not_the_one_of_the_page():
    said = "elbow: 0.0200 N m, 100 % of\n the gap"
    assert contains(said, "elbow: 0.0201 N m, 100 %\nof the gap")
    assert not contains(said, "elbow: 0.03 N m") and not contains(said, "shoulder: 0.02 N m")


def test_the_robot_file_of_the_page_is_valid(tmp_path):
    from clie_blocks.analysis.records import read_robot

    (text,) = re.findall(r"```toml\n(.*?)```", (DOCS / "tutorials" / "log.md").read_text(), re.S)
    (tmp_path / "robot.toml").write_text(text)
    robot = read_robot(tmp_path / "robot.toml")
    assert robot.n == 2 and robot.controller.law == "pd"
