"""The robots on which the diagnosis is judged come from nothing that is on trial."""

import ast
from pathlib import Path

import clie_blocks.analysis.blind as blind

FOLDER = Path(blind.__file__).parent
FILES = sorted(FOLDER.rglob("*.py"))
MAKERS = "engine", "population"  # the folders that make robots, experiments and labels


def imported(path):
    """Modules of the package that a file imports."""
    names = {node.module if isinstance(node, ast.ImportFrom) else node.names[0].name
             for node in ast.walk(ast.parse(path.read_text()))
             if isinstance(node, (ast.Import, ast.ImportFrom))}
    return {name for name in names if name and name.startswith("clie_blocks")}


def is_independent(name):
    """Whether makers of robots may import a module."""
    return (name.startswith("clie_blocks.analysis.blind")
            or name in ("clie_blocks.errors", "clie_blocks.output"))


def test_nothing_comes_from_the_package_that_is_on_trial():
    on_trial = {str(path.relative_to(FOLDER)): {
        name for name in imported(path) if name.startswith("clie_blocks.effects")
        or path.parent.name in MAKERS and not is_independent(name)} for path in FILES}
    assert {path: names for path, names in on_trial.items() if names} == {}


def test_all_makers_are_looked_at():
    assert {path.parent.name for path in FILES} > set(MAKERS)
