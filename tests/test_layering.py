"""Imports go one way: blocks -> diagrams -> analysis, stage after stage, and never in a circle."""

import functools
import importlib.util
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
LAYERS = {"clie_blocks": 0, "diagrams": 1, "analysis": 2}
FILES = [path for folder in LAYERS for path in sorted((ROOT / folder).rglob("*.py"))]
GAP = "clie_blocks.analysis.gap"
# What stands on the stages, in the order in which it may be imported.
ABOVE = ("explain", "set_point_reading", "command_reading", "torque_timing", "backlash",
         "simulator_comparison", "stages", "diagnosis", "tasks", "batch", "interface",
         "load_comparison", "simulator_faults", "fleet", "calibration", "command")


def load_structure():
    """The script that reads every import, wherever it stands."""
    path = ROOT / "benchmarks" / "structure.py"
    spec = importlib.util.spec_from_file_location("structure", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


structure = load_structure()


@functools.cache
def graph():
    """Modules that each module of the package imports."""
    return structure.graph(ROOT)


def forbidden(is_forbidden, below=""):
    """Modules that each module below a package imports and must not."""
    found = {module: {other for other in others if is_forbidden(module, other)}
             for module, others in graph().items() if module.startswith(below)}
    return {module: others for module, others in found.items() if others}


def layer_of_module(module):
    """Layer of a module of the package."""
    parts = module.split(".")
    return LAYERS.get(parts[1], 0) if len(parts) > 1 else 0


def imports(path):
    """Absolute names that a file imports."""
    return list(structure.imported_names(path))


def test_imports_go_down_only():
    assert len(graph()) > 600
    assert forbidden(lambda module, other:
                     layer_of_module(other) > layer_of_module(module)) == {}


def test_no_module_imports_itself_through_others():
    assert structure.circles(graph()) == []


def test_a_module_named_in_a_string_counts_as_an_import(tmp_path):
    file = tmp_path / "hidden.py"
    file.write_text("import importlib\ndef late():\n"
                    "    from clie_blocks.output import write\n"
                    "    return importlib.import_module('clie_blocks.analysis.cli')\n")
    assert {"clie_blocks.output.write", "clie_blocks.analysis.cli"} <= set(imports(file))


def stage_of(module):
    """Rank of a module of the gap: its stage, or what stands on the stages."""
    from clie_blocks.analysis import gap

    part = module.removeprefix(f"{GAP}.").split(".")[0]
    order = (*gap.STAGES, *ABOVE)
    return order.index(part) if part in order else None


def test_a_stage_imports_only_stages_before_it():
    modules = [module for module in graph() if module.startswith(f"{GAP}.")]
    assert [module for module in modules if stage_of(module) is None] == []  # part of no stage
    assert forbidden(lambda module, other: other.startswith(f"{GAP}.")
                     and stage_of(other) > stage_of(module), f"{GAP}.") == {}


def test_every_stage_has_a_folder():
    from clie_blocks.analysis import gap

    for stage in gap.STAGES:
        assert (ROOT / "analysis" / "gap" / stage / "__init__.py").is_file(), stage


def test_records_stand_on_the_blocks_alone():
    below = ("clie_blocks.analysis.records", "clie_blocks.analysis.report",
             "clie_blocks.analysis.statistical_measures")
    assert forbidden(lambda _, other: layer_of_module(other) and not other.startswith(below),
                     below[0]) == {}


def test_no_pyplot_in_the_library():
    named = [path for path in FILES if "pyplot" in path.read_text()]
    assert [path for path in named if "matplotlib.pyplot" in imports(path)] == []


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
