"""Scripts of the documentation, which stand beside the package and not in it."""

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

DOCS = Path(__file__).parents[1] / "docs"


def script(name: str) -> ModuleType:
    """A script of ``docs`` as a module; without a checkout the tests that need it skip."""
    path = DOCS / f"{name}.py"
    if not path.is_file():
        pytest.skip(f"{path.name} is beside the tests only in a checkout", allow_module_level=True)
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
