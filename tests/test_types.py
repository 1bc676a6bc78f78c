"""Every function of the package states its types: arguments, returns and dataclass fields."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
FILES = [path for folder in ("clie_blocks", "diagrams", "analysis")
         for path in sorted((ROOT / folder).rglob("*.py"))]
VAGUE = {"object", "tuple", "list", "dict"}  # too little to say of a dataclass field


def public_functions(body: list[ast.stmt], prefix: str = "",
                     method: bool = False) -> Iterator[tuple[str, ast.FunctionDef, bool]]:
    """Yield name and node of the public functions, and whether each is bound to a class."""
    for node in body:
        if isinstance(node, ast.FunctionDef):
            if not node.name.startswith("_") or node.name in ("__init__", "__call__"):
                static = any(getattr(d, "id", "") == "staticmethod" for d in node.decorator_list)
                yield prefix + node.name, node, method and not static
        elif isinstance(node, ast.ClassDef):
            yield from public_functions(node.body, f"{prefix}{node.name}.", method=True)


def untyped(node: ast.FunctionDef, bound: bool) -> list[str]:
    """Names of the arguments without annotation, and ``'return'``."""
    a = node.args
    listed = [*a.posonlyargs, *a.args][bound:]
    every = [*listed, *a.kwonlyargs, *(x for x in (a.vararg, a.kwarg) if x)]
    return [x.arg for x in every if x.annotation is None] + ["return"] * (node.returns is None)


def dataclasses(tree: ast.Module) -> Iterator[ast.ClassDef]:
    """Yield the classes that are decorated as dataclasses."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef) and any(
                "dataclass" in ast.unparse(d) for d in node.decorator_list):
            yield node


def test_public_functions_are_typed():
    assert {(str(path.relative_to(ROOT)), name): missing for path in FILES
            for name, node, bound in public_functions(ast.parse(path.read_text()).body)
            if (missing := untyped(node, bound))} == {}


def vague(code: str) -> dict[str, str]:
    """Fields of the dataclasses in some code whose type says too little."""
    return {f"{node.name}.{ast.unparse(field.target)}": ast.unparse(field.annotation)
            for node in dataclasses(ast.parse(code)) for field in node.body
            if isinstance(field, ast.AnnAssign)
            and VAGUE & {ast.unparse(part) for part in parts(field.annotation)}}


def test_dataclass_fields_say_what_they_hold():
    """A field typed ``object`` or a bare ``dict`` says nothing to a reader or a checker."""
    texts = {path: path.read_text() for path in FILES}
    assert {str(path.relative_to(ROOT)): found for path, code in texts.items()
            if "dataclass" in code and (found := vague(code))} == {}


def test_what_is_vague_is_found():
    assert vague("@dataclass\nclass A:\n    a: dict | None\n    b: dict[str, int]\n"
                 "    c: object") == {"A.a": "dict | None", "A.c": "object"}


def parts(annotation: ast.expr) -> list[ast.expr]:
    """Alternatives of a union: ``dict | None`` is ``dict`` and ``None``."""
    if isinstance(annotation, ast.BinOp) and isinstance(annotation.op, ast.BitOr):
        return [*parts(annotation.left), *parts(annotation.right)]
    return [annotation]


@pytest.mark.parametrize("code, expected", [
    ("def f(a, b: int): ...", {"f": ["a", "return"]}),
    ("def f(*a, b=1, **c) -> None: ...", {"f": ["b", "a", "c"]}),
    ("class A:\n    def f(self, x) -> int: ...\n    def __init__(self): ...",
     {"A.f": ["x"], "A.__init__": ["return"]}),
    ("class A:\n    @staticmethod\n    def f(x) -> int: ...", {"A.f": ["x"]}),
    ("def _private(a): ...\ndef f(a: int) -> int: ...", {"f": []})])
def test_what_is_missing_is_found(code, expected):
    found = {name: untyped(node, bound)
             for name, node, bound in public_functions(ast.parse(code).body)}
    assert found == expected
