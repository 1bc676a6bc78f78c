"""The course: notebooks in step with their sources, with outputs, and exercises that are right."""

import ast
import json
import re
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

jupytext = pytest.importorskip("jupytext", reason="needs the extra clie-blocks[test]")

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"
SOURCES = sorted(FOLDER.glob("[1-9]_*.py"))
OPEN = re.compile(r"^(\w+) = \.\.\.", re.MULTILINE)
WRONG = {"my_update": "my_update = lambda phi, e_u, gamma, kp, kd: gamma * phi @ (kd / kp * e_u)",
         "filtered_loop": "filtered_loop = joint_loop(decoupled_joints(A, B, D), KP, KD)",
         "my_excitation": "my_excitation = lambda t: 0.0",
         "my_gamma": "my_gamma = 200.0",
         "smallest_kd": "smallest_kd = 3.0"}
GUESS = "my_guess"  # of the blind game, which has no wrong answer before the envelope is open
# What no page may show: a path of the machine that ran it, an error, a warning.
LEAKS = re.compile(r"(?:^|[\s'\"(=])/\w[\w.-]*/\w|Traceback|Warning|WARNING|\bnan\b|np\.float64")


def cells(source):
    return jupytext.read(source).cells


def code(some):
    return [cell for cell in some if cell.cell_type == "code"]


def run(text, names, source):
    exec(compile(text, str(source), "exec"), names)


def setup(source):
    """Names of the first cell of a notebook, which imports all that it needs."""
    names = {}
    run(re.sub(r"^%.*$", "", code(cells(source))[0].source, flags=re.MULTILINE), names, source)
    return names


def stored(source):
    return json.loads(source.with_suffix(".ipynb").read_text())


def outputs(source):
    return [output for cell in stored(source)["cells"] for output in cell.get("outputs", ())]


def draws(cell):
    """Whether a cell ends in a figure, a diagram or a slider."""
    return bool(re.search(r"^(fig[, ]|picture\(|explore\()", cell.source, re.MULTILINE))


def exercises():
    """Name of the answer -> (source, check, solution)."""
    found = {}
    for source in SOURCES:
        some = cells(source)
        for k, cell in enumerate(some):
            answer = OPEN.search(cell.source) if cell.cell_type == "code" else None
            if answer and answer[1] != GUESS:
                solution = re.search(r"```python\n(.*?)```", some[k + 2].source, re.DOTALL)
                found[answer[1]] = source, some[k + 1].source, solution[1]
    return found


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.stem)
def test_a_notebook_is_its_source_with_outputs(source):
    written = stored(source)["cells"]
    assert [(cell["cell_type"], "".join(cell["source"])) for cell in written] == [
        (cell.cell_type, cell.source) for cell in cells(source)], (
        f"run it again: python notebooks/run.py {source.name[0]}")
    runs = [cell["execution_count"] for cell in written if cell["cell_type"] == "code"]
    assert runs == list(range(1, len(runs) + 1)), "every cell ran once, in order"
    assert source.with_suffix(".ipynb").stat().st_size < 1.5e6


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.stem)
def test_a_page_shows_pictures_and_nothing_that_went_wrong(source):
    shown = outputs(source)
    assert {output["output_type"] for output in shown} <= {"display_data", "execute_result",
                                                           "stream"}
    assert not [output for output in shown if output.get("name") == "stderr"]
    texts = [text for output in shown for part in (
        output.get("text", ""), output.get("data", {}).get("text/plain", ""))
        for text in ["".join(part)]]
    assert not [text for text in texts if LEAKS.search(text)]
    pictures = [output for output in shown if "image/png" in output.get("data", {})]
    assert len(pictures) >= sum(map(draws, code(cells(source)))) >= 2


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.stem)
def test_a_notebook_leads_to_the_others_and_runs_alone(source):
    first = cells(source)[0].source
    others = {path.with_suffix(".ipynb").name for path in SOURCES if path != source}
    assert set(re.findall(r"\]\((\w+\.ipynb)\)", first)) == others
    imported = {name.asname or name.name for cell in code(cells(source))
                for node in ast.walk(ast.parse(re.sub(r"^[%!].*$", "", cell.source, flags=re.M)))
                if isinstance(node, ast.Import | ast.ImportFrom) for name in node.names}
    whole = "\n".join(cell.source for cell in code(cells(source)))
    assert not [name for name in imported if len(re.findall(rf"\b{name}\b", whole)) < 2]


def test_every_figure_has_its_question_above_and_its_answer_below():
    for source in SOURCES:
        some = cells(source)
        texts = [cell.source if cell.cell_type == "markdown" else "" for cell in some]
        for k, cell in enumerate(some):
            if cell.cell_type == "code" and draws(cell):
                above, below = "\n".join(texts[:k]), "\n".join(texts[k:])
                assert re.search(r"\*\*(Question|Try it|Your move)\.\*\*|\*\*Block|once more",
                                 above), cell.source
                assert re.search(r"\*\*Answer\.\*\*|\*\*Block", below), cell.source


def test_every_plot_has_units_on_its_axes():
    labels = [label for source in SOURCES for cell in code(cells(source))
              for label in re.findall(r"[xy]label=r?f?\"([^\"]*)\"", cell.source)]
    assert len(labels) > 50
    without_unit = {r"$\alpha$", r"adaptation gain $\Gamma$", "window", "quarter of the speeds"}
    assert {label for label in labels if not re.search(r"\[.+\]", label)} <= without_unit


@pytest.mark.parametrize("answer", sorted(WRONG))
def test_the_solution_of_an_exercise_passes_and_a_wrong_answer_does_not(answer, capsys):
    source, check, solution = exercises()[answer]
    names = setup(source)
    run(f"{answer} = ...\n{check}", names, source)
    assert capsys.readouterr().out.endswith("still open\n")
    run(f"{solution}\n{check}", names, source)
    assert capsys.readouterr().out.endswith("correct\n")
    with pytest.raises(AssertionError):
        run(f"{WRONG[answer]}\n{check}", names, source)


def test_every_exercise_is_tested():
    assert set(exercises()) == set(WRONG)


def test_a_slider_begins_where_the_stored_picture_is(monkeypatch):
    widgets = pytest.importorskip("ipywidgets", reason="needs the extra clie-blocks[notebook]")
    from clie_blocks.analysis import lesson

    shown, sliders = [], {}
    monkeypatch.setattr(widgets, "interact", lambda show, **given: sliders.update(given))

    def show(gamma=20.0, scale=1.0):
        shown.append((gamma, scale))

    monkeypatch.delenv(lesson.STATIC, raising=False)
    lesson.explore(show, gamma=(5.0, 400.0), scale=(0.5, 2.0))
    assert not shown and {name: slider.value for name, slider in sliders.items()} == {
        "gamma": 20.0, "scale": 1.0}
    assert sliders["gamma"].max == pytest.approx(np.log10(400.0))
    assert isinstance(sliders["gamma"], widgets.FloatLogSlider)
    monkeypatch.setenv(lesson.STATIC, "1")
    lesson.explore(show, gamma=(5.0, 400.0), scale=(0.5, 2.0))
    assert shown == [(20.0, 1.0)]


@pytest.mark.slow
def test_the_bars_of_the_game_do_not_tell_a_drag_from_dry_friction():
    source = FOLDER / "4_the_gap.py"
    some = [cell.source for cell in code(cells(source))]
    first = next(k for k, text in enumerate(some) if text.startswith("SEED = "))
    last = next(k for k, text in enumerate(some) if "to_dict()" in text)
    maps = {}
    for seed, hidden in ((14, "coulomb"), (12, "quadratic_drag")):
        names = setup(source)
        for text in some[first:last + 1]:
            run(re.sub(r"^SEED = \d+", f"SEED = {seed}", text), names, source)
        assert names["hidden_name"] == hidden
        maps[hidden] = names["found"]["where"]
    plt.close("all")
    for where in maps.values():
        assert np.argmin(where["region"][0]["speed"]["share"]) == 3
        assert sum(band["share"] for band in where["frequency"][:2]) > 0.8
