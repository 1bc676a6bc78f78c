"""The robots on which the diagnosis is judged come from nothing that is on trial."""

import ast
from pathlib import Path

import pytest

import clie_blocks.analysis.blind as blind

FOLDER = Path(blind.__file__).parent
FILES = sorted(FOLDER.rglob("*.py"))
MAKERS = "engine", "population"  # the folders that make robots, experiments and labels


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(FOLDER)))
def test_nothing_comes_from_the_package_that_is_on_trial(path):
    imported = {node.module if isinstance(node, ast.ImportFrom) else node.names[0].name
                for node in ast.walk(ast.parse(path.read_text()))
                if isinstance(node, (ast.Import, ast.ImportFrom))}
    ours = {name for name in imported if name.startswith("clie_blocks")}
    assert not any(name.startswith("clie_blocks.effects") for name in ours)
    if path.parent.name in MAKERS:
        assert all(name.startswith("clie_blocks.analysis.blind")
                   or name in ("clie_blocks.errors", "clie_blocks.output") for name in ours)


def test_all_makers_are_looked_at():
    assert {path.parent.name for path in FILES} > set(MAKERS)
