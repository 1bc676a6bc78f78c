"""The lesson: notebook in step with its source, runs within its time, exercises can be solved."""

import re
import time
from pathlib import Path

import numpy as np
import pytest

jupytext = pytest.importorskip("jupytext", reason="needs the extra clie-blocks[notebook]")

SOURCE = Path(__file__).resolve().parents[1] / "notebooks" / "clie_and_the_gap.py"
REAL = Path(__file__).resolve().parents[2] / "shared" / "data" / "emps"
OPEN = re.compile(r"^(\w+) = \.\.\.", re.MULTILINE)
WRONG = {"smallest_kd": "smallest_kd = 3.0",
         "my_update": "my_update = lambda phi, e_u, gamma, kp, kd: gamma * phi @ (kd / kp * e_u)",
         "my_excitation": "my_excitation = lambda t: 0.0",
         "filtered_loop": "filtered_loop = joint_loop(decoupled_joints(A, B, D), KP, KD)",
         "my_gamma": "my_gamma = 200.0"}


@pytest.fixture(scope="module")
def cells():
    return jupytext.read(SOURCE).cells


@pytest.fixture
def setup(cells):
    """Names of the set-up cell and of the exercises' decorator."""
    names = {}
    for cell in code(cells):
        if cell.source.startswith("%matplotlib") or cell.source.startswith("def exercise("):
            run(re.sub(r"^%.*$", "", cell.source, flags=re.MULTILINE), names)
    return names


def code(cells):
    return [cell for cell in cells if cell.cell_type == "code"]


def run(text, names):
    exec(compile(text, str(SOURCE), "exec"), names)


def exercises(cells):
    """Name of the answer -> (check, solution)."""
    found = {}
    for k, cell in enumerate(cells):
        if cell.cell_type == "code" and OPEN.search(cell.source):
            solution = re.search(r"```python\n(.*?)```", cells[k + 2].source, re.DOTALL)
            found[OPEN.search(cell.source)[1]] = cells[k + 1].source, solution[1]
    return found


def test_the_notebook_is_built_from_its_source_without_outputs():
    built = jupytext.read(SOURCE.with_suffix(".ipynb"))
    source = jupytext.read(SOURCE)
    assert [(c.cell_type, c.source) for c in built.cells] == [
        (c.cell_type, c.source) for c in source.cells], (
        f"rebuild it: jupytext --to ipynb {SOURCE.name}")
    assert not any(cell.outputs or cell.execution_count for cell in code(built.cells))


def test_every_figure_has_its_question_above_and_its_answer_below(cells):
    drawn = [k for k, cell in enumerate(cells) if cell.cell_type == "code"
             and re.search(r"^(fig|picture\()", cell.source, re.MULTILINE)
             and not OPEN.search(cell.source) and "def picture" not in cell.source]
    assert len(drawn) > 20
    texts = [cell.source if cell.cell_type == "markdown" else "" for cell in cells]
    for k in drawn:
        above = "\n".join(texts[:k])
        below = "\n".join(texts[k:])
        assert "**Question.**" in above or "**Block" in above
        assert re.search(r"\*\*Answer\.\*\*|\*\*Block", below)


def test_every_plot_has_units_on_its_axes(cells):
    labels = [label for cell in code(cells)
              for label in re.findall(r"[xy]label=r?f?\"([^\"]*)\"", cell.source)]
    assert len(labels) > 40
    without_unit = {r"$\alpha$", r"adaptation gain $\Gamma$", "window", "quarter of the speeds"}
    assert {label for label in labels if not re.search(r"\[.+\]", label)} <= without_unit


@pytest.mark.parametrize("answer", sorted(WRONG))
def test_the_solution_of_an_exercise_passes_and_a_wrong_answer_does_not(
        answer, cells, setup, capsys):
    check, solution = exercises(cells)[answer]
    run(f"{answer} = ...\n{check}", setup)
    assert capsys.readouterr().out.endswith("still open\n")
    run(f"{solution}\n{check}", setup)
    assert capsys.readouterr().out.endswith("correct\n")
    with pytest.raises(AssertionError):
        run(f"{WRONG[answer]}\n{check}", setup)


def test_every_exercise_is_tested(cells):
    assert set(exercises(cells)) == set(WRONG)


@pytest.mark.slow
def test_the_bars_of_part_10_do_not_tell_a_drag_from_dry_friction(cells, setup):
    first = next(k for k, cell in enumerate(cells) if cell.source.startswith("SEED = "))
    maps = {}
    for seed, hidden in ((14, "coulomb"), (12, "quadratic_drag")):
        names = dict(setup)
        for cell in code(cells[first:first + 4]):
            run(re.sub(r"^SEED = \d+", f"SEED = {seed}", cell.source), names)
        assert names["hidden_name"] == hidden
        maps[hidden] = names["found"]["where"]
    for where in maps.values():
        assert np.argmin(where["region"][0]["speed"]["share"]) == 3
        assert sum(band["share"] for band in where["frequency"][:2]) > 0.8


@pytest.mark.slow
def test_the_notebook_runs_within_its_time(tmp_path, monkeypatch):
    nbclient = pytest.importorskip("nbclient", reason="needs the extra clie-blocks[notebook]")
    if REAL.is_dir():
        monkeypatch.setenv("EMPS", str(REAL))
    notebook = jupytext.read(SOURCE.with_suffix(".ipynb"))
    began = time.perf_counter()
    nbclient.NotebookClient(notebook, timeout=120, kernel_name="python3",
                            resources={"metadata": {"path": str(tmp_path)}}).execute()
    assert time.perf_counter() - began < 240
    outputs = [output for cell in code(notebook.cells) for output in cell.outputs]
    assert sum("image/png" in output.get("data", {}) for output in outputs) > 20
    assert not [output.text for output in outputs if output.get("name") == "stderr"]
