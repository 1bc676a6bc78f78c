"""The structure of the package in figures: lines, modules, levels, circles, annotations.

    python benchmarks/structure.py               this checkout
    python benchmarks/structure.py OTHER ...     and others beside it

An import counts wherever it stands: at the top, inside a function, under TYPE_CHECKING, or as the
name of a module in a string.  A name that a package exports lazily counts as the module it is in.
"""

import argparse
import ast
import re
from collections.abc import Iterator
from pathlib import Path

FOLDERS = {"clie_blocks": "clie_blocks", "diagrams": "clie_blocks.diagrams",
           "analysis": "clie_blocks.analysis"}
DOTTED = re.compile(r"clie_blocks(\.\w+)+")
CODE = ("clie_blocks", "diagrams", "analysis", "benchmarks", "docs", "notebooks")


def modules(root: Path) -> dict[str, Path]:
    """Modules of the package below a checkout, by dotted name."""
    found = {}
    for folder, prefix in FOLDERS.items():
        for path in sorted((root / folder).rglob("*.py")):
            parts = path.relative_to(root / folder).with_suffix("").parts
            parts = parts[:-1] if parts[-1] == "__init__" else parts
            found[".".join((prefix, *parts))] = path
    return found


def exports(root: Path) -> dict[str, str]:
    """Modules of the names that packages export lazily, by dotted name."""
    found = {}
    for name, path in modules(root).items():
        stub = path.with_suffix(".pyi")
        if path.name != "__init__.py" or not stub.exists():
            continue
        for node in ast.walk(ast.parse(stub.read_text())):
            if isinstance(node, ast.ImportFrom) and node.level == 1:
                home = f"{name}.{node.module}" if node.module else name
                for alias in node.names:
                    found[f"{name}.{alias.name}"] = home
    return found


def imported_names(path: Path) -> Iterator[str]:
    """Dotted names that a file imports, from wherever in the file."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            if DOTTED.fullmatch(node.value):
                yield node.value


def graph(root: Path) -> dict[str, set[str]]:
    """Modules that each module imports."""
    known, lazy = modules(root), exports(root)
    edges: dict[str, set[str]] = {name: set() for name in known}
    for name, path in known.items():
        for target in imported_names(path):
            target = lazy.get(target, target)
            while target and target not in known:
                target = target.rpartition(".")[0]
            if target and target != name and not (
                    name.startswith(f"{target}.") and path.name != "__init__.py"
                    and known[target].name == "__init__.py"):
                edges[name].add(target)
    return edges


def circles(edges: dict[str, set[str]]) -> list[list[str]]:
    """Groups of modules that import each other (Tarjan's strongly connected components)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(name: str) -> None:
        index[name] = low[name] = len(index)
        stack.append(name)
        for other in sorted(edges[name]):
            if other not in index:
                visit(other)
                low[name] = min(low[name], low[other])
            elif other in stack:
                low[name] = min(low[name], index[other])
        if low[name] == index[name]:
            group = []
            while not group or group[-1] != name:
                group.append(stack.pop())
            if len(group) > 1:
                found.append(sorted(group))

    for name in edges:
        if name not in index:
            visit(name)
    return found


def levels(edges: dict[str, set[str]]) -> int:
    """Longest chain of modules that import each other downwards; circles count as one."""
    depth: dict[str, int] = {}

    def of(name: str, above: tuple[str, ...] = ()) -> int:
        if name in above:
            return 0
        if name not in depth:
            depth[name] = 1 + max((of(other, (*above, name)) for other in edges[name]), default=0)
        return depth[name]

    return max(map(of, edges), default=0)


def of_folders(edges: dict[str, set[str]], prefix: str) -> dict[str, set[str]]:
    """The same graph with the folders below a package as nodes."""
    def folder(name: str) -> str:
        return name.removeprefix(f"{prefix}.").split(".")[0]

    inside = {name for name in edges if name.startswith(f"{prefix}.")}
    found: dict[str, set[str]] = {folder(name): set() for name in inside}
    for name in inside:
        found[folder(name)] |= {folder(other) for other in edges[name] & inside} - {folder(name)}
    return found


def constants(paths: list[Path]) -> list[str]:
    """Names of module constants that hold numbers."""
    found = []
    for path in paths:
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.Assign) and all(
                    isinstance(name, ast.Name) and name.id.isupper()
                    for target in node.targets for name in
                    (target.elts if isinstance(target, ast.Tuple) else [target])):
                names = [name.id for target in node.targets for name in
                         (target.elts if isinstance(target, ast.Tuple) else [target])]
                if any(isinstance(part, ast.Constant) and type(part.value) in (int, float)
                       for part in ast.walk(node.value)):
                    found += names
    return found


def annotations(paths: list[Path]) -> dict[str, tuple[int, int]]:
    """How many arguments, returns and dataclass fields are annotated, of how many."""
    arguments, returns, objects = [], [], []
    for path in paths:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.FunctionDef):
                own = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
                arguments += [arg.annotation is not None for arg in own
                              if arg.arg not in ("self", "cls")]
                returns.append(node.returns is not None)
            elif isinstance(node, ast.AnnAssign):
                objects.append(ast.unparse(node.annotation) == "object")
    return {"arguments annotated": (sum(arguments), len(arguments)),
            "returns annotated": (sum(returns), len(returns)),
            "fields typed object": (sum(objects), len(objects))}


def figures(root: Path) -> dict[str, str]:
    """Everything that the table shows of one checkout."""
    files = {folder: sorted((root / folder).rglob("*.py")) for folder in (*CODE, "tests")}
    package = [path for folder in FOLDERS for path in files[folder]]
    gap = [path for path in package if "gap" in path.parts]
    edges = graph(root)

    def lines(paths: list[Path]) -> int:
        return sum(len(path.read_text().splitlines()) for path in paths)

    inside = {name: {other for other in targets if ".gap." in other}
              for name, targets in edges.items() if ".gap." in name}
    rows = {"lines without tests": lines([path for folder in CODE for path in files[folder]]),
            "lines of the package": lines(package), "lines of analysis/gap": lines(gap),
            "lines of tests": lines(files["tests"]), "modules": len(edges),
            "modules of analysis/gap": len(gap), "levels of imports": levels(edges),
            "levels inside analysis/gap": levels(inside),
            "levels of its folders": levels(of_folders(edges, "clie_blocks.analysis.gap")),
            "module circles": len(circles(edges)),
            "imports inside functions": _late_imports(package),
            "constants with numbers": len(constants(package)),
            "constants of analysis/gap": len(constants(gap)),
            "files over 300 lines": sum(lines([path]) > 300 for path in package)}
    shares = {name: f"{some} of {all_}" for name, (some, all_) in annotations(package).items()}
    return {name: f"{value:,}" for name, value in rows.items()} | shares


def _late_imports(paths: list[Path]) -> int:
    """Imports of own modules that stand inside functions."""
    return sum(isinstance(node, ast.ImportFrom) and str(node.module).startswith("clie_blocks")
               for path in paths for function in ast.walk(ast.parse(path.read_text()))
               if isinstance(function, ast.FunctionDef) for node in function.body)


def main(argv: list[str] | None = None) -> None:
    """Print the table, one column per checkout."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("checkouts", nargs="*", type=Path, help="other checkouts, beside this one")
    here = Path(__file__).resolve().parents[1]
    columns = {str(root): figures(root) for root in [*parser.parse_args(argv).checkouts, here]}
    print(f"{'':28}" + "".join(f"{name[-20:]:>22}" for name in columns))
    for row in figures(here):
        print(f"{row:28}" + "".join(f"{column[row]:>22}" for column in columns.values()))


if __name__ == "__main__":
    main()
