"""One style for the help of every verb."""

import re

import pytest

from clie_blocks.analysis import cli


@pytest.fixture(params=cli.VERBS)
def shown(request, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    with pytest.raises(SystemExit):
        cli.main([request.param, "--help"])
    return request.param, capsys.readouterr().out


def test_the_help_has_one_style(shown):
    verb, text = shown
    usage, description = text.split("\n\n")[:2]
    assert usage.startswith(f"usage: clie {verb} [-h] [--json] [-o DIR]")
    assert re.fullmatch(r"[A-Z][^.].*\.", description, re.S), description
    assert all(len(line) <= 100 for line in text.splitlines())
    assert not re.search(r"np\.|<function|Exit:|\bTrue\b|\bFalse\b|\bNone\b|[\[(]default: [\[(]",
                         text)
    values = re.findall(r"^  (?:-\w \w+, )?--[\w-]+ ([A-Z_]+)", text, re.M)
    assert all(len(value) <= 8 for value in values), values  # a kind of value, not the option


def test_what_an_option_does_begins_small_and_ends_open(shown):
    _, text = shown
    listed = text[text.index("options:"):].split("\n\n")[0]
    said = re.split(r"\n  (?=-)", " " + listed)[1:]
    words = [re.sub(r"\s+", " ", re.split(r"\s{2,}|\n\s+", one, maxsplit=1)[1]) for one in said]
    assert [text for text in words if text.rstrip().endswith(".")] == []
    assert [text for text in words if re.match(r"[A-Z][a-z]", text)
            and not text.startswith(("Python", "JSON"))] == []


def test_the_list_of_verbs_has_one_style():
    said = [text for _, text in cli.VERBS.values()]
    assert all(text[0].islower() and text[-1] not in ".?" and "'" not in text for text in said)
    assert all(len(text) + 14 <= 100 for text in said)
