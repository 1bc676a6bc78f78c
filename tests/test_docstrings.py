"""Every public function and class says what it is; a parameter section names exactly its own."""

import ast
import functools
import importlib
import inspect
import pkgutil
import re
from collections.abc import Callable, Iterator
from textwrap import dedent

import pytest

import clie_blocks

PACKAGES = ("clie_blocks", "clie_blocks.diagrams", "clie_blocks.analysis")


def modules() -> Iterator[str]:
    """Yield the name of every module of the package, folder by folder."""
    for name in PACKAGES:
        package = importlib.import_module(name)
        yield name
        yield from (info.name for info in pkgutil.walk_packages(package.__path__, f"{name}."))


def public(module: str) -> Iterator[tuple[str, object]]:
    """Yield name and value of the public functions and classes of a module, methods included."""
    for name, value in list(vars(importlib.import_module(module)).items()):
        if name.startswith("_") or getattr(value, "__module__", "") != module:
            continue
        if inspect.isfunction(value):
            yield f"{module}.{name}", value
        elif inspect.isclass(value):
            yield f"{module}.{name}", value
            yield from ((f"{module}.{name}.{key}", method)
                        for key, method in vars(value).items()
                        if not key.startswith("_") and inspect.isfunction(method)
                        and not method.__name__.startswith("_"))  # a name for a private one


@functools.cache
def callables() -> dict[str, object]:
    """Public functions and classes of the package by their full names."""
    return {name: value for module in dict.fromkeys(modules()) for name, value in public(module)}


def documented(doc: str) -> list[str]:
    """Names in the section of parameters of a docstring, empty without such a section."""
    section = re.search(r"^Parameters\n-+\n(.*?)(?=^\S[^\n]*\n-{3,}$|\Z)", doc, re.S | re.M)
    heads = re.findall(r"^(\S[^\n]*)$", section[1], re.M) if section else []
    return [name.strip().lstrip("*") for head in heads
            for name in re.split(r"\s:\s", head)[0].split(",")]


def accepted(value: object) -> set[str]:
    """Names that a function, or the construction of a class, takes."""
    return set(inspect.signature(value).parameters) - {"self", "cls"}


def test_docstrings_name_exactly_the_parameters():
    docs = {name: inspect.cleandoc(value.__doc__ or "") for name, value in callables().items()}
    assert [name for name, doc in docs.items() if not doc] == []  # without docstring
    assert {name: (named, accepted(callables()[name])) for name, doc in docs.items()
            if (named := set(documented(doc))) and named != accepted(callables()[name])} == {}


def swallowed(function: Callable) -> list[str]:
    """Collections of unknown keywords that a function neither checks nor passes on."""
    collected = [p.name for p in inspect.signature(function).parameters.values()
                 if p.kind is p.VAR_KEYWORD]
    tree = ast.parse(dedent(inspect.getsource(function))) if collected else ast.Module([], [])
    used = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    return [name for name in collected if name not in used]


def test_unknown_keywords_are_refused():
    assert {name: found for name, value in callables().items()
            if inspect.isfunction(value) and "." not in value.__qualname__
            and (found := swallowed(value))} == {}


@pytest.mark.parametrize("name", [
    name for name in clie_blocks.__all__ if callable(getattr(clie_blocks, name))
    and name != "Diagnosis"])  # `diagnose` returns it; nobody calls it
def test_what_users_call_documents_every_argument(name):
    value = getattr(clie_blocks, name)
    assert set(documented(inspect.getdoc(value))) == accepted(value)
    kinds = {p.kind for p in inspect.signature(value).parameters.values()}
    assert inspect.Parameter.VAR_KEYWORD not in kinds, "collects unknown keywords"


def test_every_folder_is_walked():
    walked = set(modules())
    assert {"clie_blocks.effects.coulomb", "clie_blocks.diagrams.drawing.order",
            "clie_blocks.analysis.gap.diagnosis"} <= walked


@pytest.mark.parametrize("doc, expected", [
    ("One line.", []),
    ("A.\n\nParameters\n----------\na, b : float\n    Text.\nc : int, optional\n    Text.\n"
     "\nReturns\n-------\nd : int\n    Text.", ["a", "b", "c"]),
    ("A.\n\nParameters\n----------\n*terms : str\n    Text : more.\n**values : float\n    T.",
     ["terms", "values"])])
def test_the_section_is_read(doc, expected):
    assert documented(doc) == expected


def keeps_nothing(a, **options):
    return a


def passes_on(a, **options):
    return dict(a, **options)


def test_what_is_swallowed_is_found():
    assert swallowed(keeps_nothing) == ["options"]
    assert not swallowed(passes_on)
