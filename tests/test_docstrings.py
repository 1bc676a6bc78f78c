"""Every public function documents every argument, and refuses what it does not know."""

import importlib
import inspect
import pkgutil

import pytest

import clie_blocks


def public_callables():
    """Yield (name, callable) of the public functions and classes, module by module."""
    folders = {"clie_blocks": clie_blocks.__path__}
    for part in ("diagrams", "analysis"):
        package = importlib.import_module(f"clie_blocks.{part}")
        folders[f"clie_blocks.{part}"] = package.__path__
    for prefix, paths in folders.items():
        for info in pkgutil.iter_modules(paths, f"{prefix}."):
            if not info.ispkg:
                module = importlib.import_module(info.name)
                for name, value in vars(module).items():
                    if (not name.startswith("_") and getattr(value, "__module__", "") == info.name
                            and inspect.isfunction(value)):
                        yield f"{info.name}.{name}", value


CALLABLES = dict(public_callables())


@pytest.mark.parametrize("name", CALLABLES)
def test_public_function_documents_its_arguments(name):
    function = CALLABLES[name]
    doc = inspect.getdoc(function) or ""
    assert doc, "no docstring"
    if len(doc.splitlines()) == 1:
        return  # a kernel: one sentence that is a formula in the names of the glossary
    if not inspect.signature(function).parameters:
        return
    assert "Parameters\n----" in doc, "a docstring of several lines lists its parameters"
    section = doc.split("Parameters\n----")[1]
    for argument in inspect.signature(function).parameters:
        assert argument in section, f"argument {argument!r} is not documented"


@pytest.mark.parametrize("name", CALLABLES)
def test_unknown_keyword_is_refused(name):
    parameters = inspect.signature(CALLABLES[name]).parameters.values()
    assert not any(p.kind is p.VAR_KEYWORD for p in parameters) or "nearest" in inspect.getsource(
        CALLABLES[name]), "swallows unknown keywords"
