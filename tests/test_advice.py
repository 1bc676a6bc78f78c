"""Commands and options that messages, reports and pages name are those that the parsers know."""

import argparse
import ast
import functools
import re
import shlex
from pathlib import Path

import pytest

from clie_blocks.analysis import cli

ROOT = Path(__file__).resolve().parents[1]
SOURCES = [path for folder in ("clie_blocks", "diagrams", "analysis")
           for path in sorted((ROOT / folder).rglob("*.py"))]
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]
READING = ("check", "identify", "diagnose")
# Whose advice it is: what a folder says must run with each of these verbs.
VERBS_OF = {"analysis/records/corrections.py": ("diagnose",),
            "analysis/records/robot_template.py": ("robot",), "analysis/records": READING,
            "analysis/gap": ("diagnose",), "analysis/identification": ("identify",),
            "analysis/stability_report": ("bounds",), "analysis/reproduction": ("reproduce",),
            "analysis/blind": ("blind",), "analysis/catalogue": ("effects",)}
# Options of other programs, by the text that stands before them.
FOREIGN = re.compile(r"python -m|pip install|pytest|git |diagrams/\w+\.py")

SHELLS = ("", "sh", "bash", "console")


class Parsed(Exception):  # noqa: N818  not an error: the work ends here
    """Raised in the place of the work of a command, with what was parsed."""


@pytest.fixture
def parse(monkeypatch):
    """Function that gives a command line to the parser of its verb, and goes no further."""
    real = argparse.ArgumentParser.parse_args

    def stop(parser, *args, **kwargs):
        raise Parsed(real(parser, *args, **kwargs))

    def parse(words):
        with pytest.raises(Parsed):
            cli._dispatch(words)

    monkeypatch.setattr(argparse.ArgumentParser, "parse_args", stop)
    return parse


@functools.cache
def options_of(verb):
    """Long options of a verb, from its help."""
    import contextlib
    import io

    text = io.StringIO()
    with contextlib.redirect_stdout(text), contextlib.suppress(SystemExit):
        cli._dispatch([verb, "--help"])
    return frozenset(re.findall(r"--[a-z][-a-z]*", text.getvalue()))


@functools.cache
def texts(path):
    """Line and text of every string of a file that is not documentation; {} for what is put in."""
    return list(_texts(path))


def _texts(path):
    tree = ast.parse(path.read_text())
    documented = {id(node.body[0].value) for node in ast.walk(tree)
                  if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef))
                  and node.body and isinstance(node.body[0], ast.Expr)}
    inner = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr)
             for part in ast.walk(node) if part is not node}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr) and id(node) not in inner:
            yield node.lineno, "".join(part.value if isinstance(part, ast.Constant) else "{}"
                                       for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(
                node) not in inner | documented:
            yield node.lineno, node.value


def verbs_of(path):
    name = path.relative_to(ROOT).as_posix()
    return next((verbs for folder, verbs in VERBS_OF.items() if name.startswith(folder)), None)


def test_every_option_that_a_message_names_is_one_of_its_command():
    unknown = []
    for path in SOURCES:
        own = set(re.findall(r"add_argument\(\s*\"(--[-a-z]+)", path.read_text()))
        for line, text in texts(path):
            if FOREIGN.search(text) or re.fullmatch("--[-a-z]+", text):
                continue
            for option in re.findall(r"(?<![-\w])--[a-z][-a-z]*", text):
                named = re.findall(r"\bclie ([a-z]+)\b", text)
                verbs = [verb for verb in named if verb in cli.VERBS] or verbs_of(path) or [
                    next((verb for verb in cli.VERBS if option in options_of(verb)), "check")]
                missing = [verb for verb in verbs if option not in options_of(verb)]
                if missing and option not in own | {"--version", "--help", "--completion"}:
                    unknown.append(f"{path.relative_to(ROOT)}:{line}: {option} is no option of "
                                   f"clie {', '.join(missing)}: {text[:60]!r}")
    assert "\n".join(unknown) == ""


def test_every_verb_that_a_message_or_a_page_names_exists():
    named = [(path, verb) for path in SOURCES for _, text in texts(path)
             for verb in re.findall(r"(?:'|`)clie ([a-z]+)", text)]
    named += [(path, verb) for path in PAGES
              for verb in re.findall(r"`clie ([a-z]+)", path.read_text())]
    assert len(named) > 20
    assert [f"{path.name}: clie {verb}" for path, verb in named if verb not in cli.VERBS] == []


def commands(path):
    """Command lines of clie in the code of a page, without what only a shell understands."""
    for language, block in re.findall(r"^```(\w*)\n(.*?)^```", path.read_text(), re.S | re.M):
        for line in block.replace("\\\n", " ").splitlines() if language in SHELLS else ():
            for part in re.split(r"&&|\|", line):
                words = re.match(r"(?:\$ )?(?:\S*/)?clie (.+)", part.strip())
                if words and not re.search(r"\.\.\.|\[|\]", words[1]):
                    yield words[1].partition("  #")[0].partition(" > ")[0]


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_every_command_of_a_page_is_understood(path, parse):
    for command in commands(path):
        words = shlex.split(command, comments=True)
        if words[0] in cli.VERBS and "--help" not in words:
            parse(words)


def test_the_pages_have_commands_to_test():
    assert sum(1 for path in PAGES for _ in commands(path)) > 10
