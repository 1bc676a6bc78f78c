"""The glossary is true, and what a user reads keeps to its words."""

import ast
import re
from pathlib import Path

import pytest

from clie_blocks.analysis import cli

ROOT = Path(__file__).resolve().parents[1]
GLOSSARY = (ROOT / "docs" / "glossary.md").read_text()
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]
SPEAKING = ["analysis/gap/report", "analysis/gap/command.py", "analysis/gap/batch.py",
            "analysis/report"]  # what stands in their strings reaches a user
COMMANDS = ("diagnose", "check", "identify", "effects", "blind", "bounds", "reproduce", "loop")
# Retired house words -> the word of the glossary, or of plain English.
RETIRED = {
    r"\black(s|ing)?\b(?! of fit)": "is missing",
    r"\bwrong numbers\b|\bnumbers off\b": "parameters outside their tolerance",
    r"\bjudges?\b|\bjudging\b|\bjudged\b": "validates, hold-out log",
    r"\bteach(es)?\b|\btaught\b": "train",
    r"\brivals?\b": "confounder, alternative",
    r"\bsiblings?\b|\bcousins?\b|\bkin\b|\blook-?alikes?\b": "alternative",
    r"\bpromis(e|es|ed|ing)\b": "predicted improvement",
    r"\bdoubt(s|ed)?\b": "uncertainty",
    r"\bforetold\b": "predicted",
    r"\bmended\b": "corrected",
    r"\bleftovers?\b": "lack of fit, residual",
    r"\bsecond look\b": "backlash check",
    r"\bnine tenths\b": "90 %",
    r"\bbad news\b": "negative result",
    r"\bway of (the|a) command\b": "command path",
    r"\btorque table\b|\btable of torque\b": "torque map",
    r"\bcalled unknown\b": "reported as unknown",
    r"\bright first\b": "ranked first",
    r"\bhome to the data ?sheet\b": "MAP refinement",
    r"\bstray(s|ed|ing)?\b": "prior violation",
    r"\baccused?\b": "false attribution",
    r"\bis bent\b|\bbends itself\b|\bbent themselves\b": "is absorbed",
}


def rows():
    """Rows of all tables, as lists of cells."""
    return [[cell.strip() for cell in line.strip("|").split("|")]
            for line in GLOSSARY.splitlines()
            if line.startswith("|") and not re.match(r"\|[-| ]+\|$|\| term ", line)]


def terms():
    """Defined terms, in lower case without their abbreviation."""
    return {re.sub(r"\s*\(.*\)|`", "", name).strip().lower()
            for row in rows() for name in row[0].split(", ")}


def test_every_term_has_symbol_unit_meaning_and_module():
    assert len(rows()) > 60
    assert all(len(row) == 5 and all(row) for row in rows())
    names = [row[0] for row in rows()]
    assert len(set(names)) == len(names)


def test_every_module_exists():
    modules = {row[4].strip("`") for row in rows()}
    assert not [module for module in modules if not (ROOT / module).is_file()]


@pytest.mark.parametrize("term", [
    "clie", "input error", "mu_0", "mu_1", "mu_2", "persistent excitation", "sensitivity",
    "whitening", "excess", "chi^2 per sample", "nominal model", "hypothesis", "cause", "effect",
    "evidence", "90 % set", "reducible gap", "noise floor", "hold-out log", "confounder",
    "alternative", "prior violation", "map refinement", "racing", "screening", "lack of fit",
    "torque map"])
def test_what_a_reader_meets_is_defined(term):
    assert term in terms()


def test_no_retired_word_is_a_term():
    assert not [term for term in terms() for word in RETIRED if re.search(word, term)]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_pages_keep_to_the_words(page):
    text = re.sub(r"```.*?```|`[^`]*`|\]\([^)]*\)", " ", page.read_text(), flags=re.S)
    assert not found_in(text)


@pytest.mark.parametrize("place", SPEAKING)
def test_reports_keep_to_the_words(place):
    path = ROOT / place
    files = [path] if path.is_file() else sorted(path.rglob("*.py")) + sorted(path.rglob("*.j2"))
    texts = {file.name: found_in(" ".join(strings(file))) for file in files}
    assert not {name: words for name, words in texts.items() if words}


@pytest.mark.parametrize("verb", [verb for verb in cli.VERBS if verb in COMMANDS])
def test_help_keeps_to_the_words(verb, capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main([verb, "--help"])
    text = capsys.readouterr().out
    assert stop.value.code == 0 and "usage" in text and not found_in(text)


def found_in(text):
    """Retired words of a text, with what to write instead."""
    return {match.group(0): better for word, better in RETIRED.items()
            for match in re.finditer(word, text, re.I)}


def strings(file):
    """Sentences in a file: all strings of a module that are no key, else its whole text."""
    if file.suffix != ".py":
        return [file.read_text()]
    tree = ast.parse(file.read_text())
    return [node.value for node in ast.walk(tree)
            if isinstance(node, ast.Constant) and isinstance(node.value, str)
            and " " in node.value]


def test_the_words_are_searched_for():
    assert found_in("The model lacks friction, which no rival explains.") == {
        "lacks": "is missing", "rival": "confounder, alternative"}
    assert not found_in("The model is missing friction; displacement is measured.")
