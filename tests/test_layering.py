"""Imports go one way: blocks -> diagrams -> analysis, and no file shadows a module it needs."""

import ast
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
LAYERS = {"clie_blocks": 0, "diagrams": 1, "analysis": 2}
FILES = [path for folder in LAYERS for path in sorted((ROOT / folder).rglob("*.py"))]


def layer_of_module(module):
    """Layer of an imported module, or None outside the package."""
    parts = module.split(".")
    if parts[0] != "clie_blocks":
        return None
    return LAYERS.get(parts[1], 0) if len(parts) > 1 else 0


def imports(path):
    """Yield the absolute modules that a file imports, wherever in the file."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            yield node.module
            yield from (f"{node.module}.{name.name}" for name in node.names)


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_go_down_only(path):
    own = LAYERS[path.relative_to(ROOT).parts[0]]
    above = [module for module in imports(path) if (layer_of_module(module) or 0) > own]
    assert not above


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_pyplot_in_the_library(path):
    assert "matplotlib.pyplot" not in set(imports(path))


def test_no_script_shadows_a_module():
    needed = {*sys.stdlib_module_names, "control", "numpy", "scipy", "matplotlib", "rich",
              "jinja2", "llvmlite"}
    scripts = {path.stem for folder in ("diagrams", "analysis")
               for path in (ROOT / folder).glob("*.py")}
    assert not scripts & needed


def test_every_package_folder_is_listed_for_the_wheel():
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    found = set()
    for folder in LAYERS:
        prefix = "clie_blocks" if folder == "clie_blocks" else f"clie_blocks.{folder}"
        for init in (ROOT / folder).rglob("__init__.py"):
            inner = init.parent.relative_to(ROOT / folder).parts
            found.add(".".join((prefix, *inner)))
    assert set(listed) == found


def test_every_public_name_is_documented_and_exists():
    import clie_blocks

    for name in clie_blocks.__all__:
        assert getattr(clie_blocks, name).__doc__, name
    with pytest.raises(AttributeError, match="No clie_blocks attribute nothing"):
        clie_blocks.nothing  # noqa: B018
