"""The checklists for contributors are true: their files exist, and what is there keeps to them."""

import importlib
import inspect
import re
import tomllib
from pathlib import Path

import pytest

import clie_blocks
from clie_blocks.analysis.gap.causes.vocabulary import effect_names
from clie_blocks.analysis.records.controller_section import LAWS
from clie_blocks.analysis.records.readers.formats import READERS
from clie_blocks.analysis.records.robot_keys import keys_of
from clie_blocks.effects import LIBRARY

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted((ROOT / "docs" / "contributing").glob("*.md"))


@pytest.mark.parametrize("page", [ROOT / "CONTRIBUTING.md", *PAGES], ids=lambda page: page.name)
def test_every_file_that_a_page_names_exists(page):
    text = page.read_text()
    places = re.findall(r"`(?:python )?([\w./]+/[\w.]+(?:\.py|\.md|/)?)`", text)
    assert places and not [place for place in places if not (ROOT / place).exists()]
    links = re.findall(r"\]\(([^)#]+)\)", text)
    assert not [link for link in links if not (page.parent / link).exists()]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_is_a_checklist_with_a_test_in_it(page):
    items = re.findall(r"^- \[ \] (.*(?:\n  .*)*)", page.read_text(), re.M)
    assert len(items) >= 5 and any("tests/" in item for item in items)
    assert f"docs/contributing/{page.name}" in (ROOT / "CONTRIBUTING.md").read_text()


def test_every_effect_keeps_to_its_checklist():
    page = (ROOT / "docs" / "effects.md").read_text()
    for name, effect in LIBRARY.items():
        assert f"## {name}\n" in page or f"`{name}`" in page, name
        assert effect.confused_with or effect.wrong, name
    assert set(LIBRARY) <= effect_names()


def test_every_law_keeps_to_its_checklist():
    page = (ROOT / "docs" / "laws.md").read_text() + (ROOT / "docs/robot_file.md").read_text()
    assert not [law for law in LAWS if f'`"{law}"`' not in page]
    assert {"Kp", "Ki", "Kd", "Kv"} <= {key.name for key in keys_of("controller")}


def test_every_reader_keeps_to_its_checklist():
    for module in READERS.values():
        reader = importlib.import_module(f"clie_blocks.analysis.records.readers.{module}")
        assert list(inspect.signature(reader.read).parameters)[1:] == ["options"], module


def test_the_citation_is_of_this_version_and_licence():
    citation = dict(re.findall(r"^(version|license|title): (.*)$",
                               (ROOT / "CITATION.cff").read_text(), re.M))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert citation == {"version": clie_blocks.__version__, "license": project["license"],
                        "title": "clie_blocks"}
    assert project["version"] == clie_blocks.__version__
