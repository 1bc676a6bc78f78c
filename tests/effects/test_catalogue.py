"""The verb `clie effects`, the drawing in characters, and the gallery's pictures."""

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest

from clie_blocks.analysis.catalogue.answer import ANSWERS, answer
from clie_blocks.analysis.catalogue.figure import effect_figure, responses
from clie_blocks.analysis.catalogue.pages import catalogue, main, page
from clie_blocks.analysis.catalogue.text_curve import text_curve
from clie_blocks.effects import LIBRARY
from clie_blocks.output import guarded
from clie_blocks.signals import DiagramError


def test_the_catalogue_lists_every_effect_once():
    names = [row[0] for row in catalogue()]
    assert sorted(names) == sorted(LIBRARY) and len(names) >= 45


@pytest.mark.parametrize("name", LIBRARY)
def test_a_page_has_every_fact_within_the_width(name):
    text = page(name)
    assert all(len(line) <= 98 for line in text.splitlines())
    for parameter in LIBRARY[name].parameters:
        assert f"\n{parameter.name} " in text
    for other in LIBRARY[name].confused_with:
        assert f"  {other}" in text
    for simulator in LIBRARY[name].simulators:
        assert f"\n  {simulator} " in text


def test_json_has_the_fields_that_were_promised(capsys):
    assert main(["--json"]) == 0
    listed = json.loads(capsys.readouterr().out)["effects"]
    assert [entry["name"] for entry in listed] == list(LIBRARY)
    for entry in listed:
        assert {"name", "family", "port", "parameters", "confused_with", "reference"} <= set(entry)
        for parameter in entry["parameters"]:
            assert {"name", "unit", "lower", "upper", "neutral"} <= set(parameter)


def test_one_effect_as_json_is_a_list_of_one(capsys):
    assert main(["backlash", "--json"]) == 0
    assert [entry["name"] for entry in json.loads(capsys.readouterr().out)["effects"]] == [
        "backlash"]


def test_an_unknown_effect_is_told_with_the_nearest_name(capsys):
    assert guarded(main, ["bcklash"]) == 2
    assert "did you mean 'backlash'" in capsys.readouterr().err


def test_the_picture_goes_where_it_is_asked_for(tmp_path, capsys):
    assert main(["dead_zone", "-o", str(tmp_path)]) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["dead_zone.png", "dead_zone.svg"]
    assert "dead_zone.svg" in capsys.readouterr().err


def test_a_drawn_line_has_its_ends_in_the_corners_and_the_axes_through_zero():
    rows = text_curve([-1.0, 2.0], [-3.0, 3.0], width=31, height=7).splitlines()[1:-1]
    cells = [row.ljust(42)[11:] for row in rows]
    assert cells[0][-1] == "*" and cells[-1][0] == "*"
    assert cells[3].startswith("-----") and cells[-1][10] == "|"
    assert rows[0].startswith("         3") and rows[-1].startswith("        -3")


def test_a_constant_can_be_drawn():
    assert text_curve([0.0, 1.0], [2.0, 2.0]).count("*") == 57


@pytest.mark.parametrize("name", ANSWERS)
def test_an_answer_is_drawn_where_there_is_no_curve(name):
    assert LIBRARY[name].curve is None
    t, y, given = answer(name)
    assert np.all(np.isfinite(y)) and np.ptp(y) > 0
    assert all(values.shape == t.shape for values in given.values())
    assert "*" in page(name)


def test_the_gallery_is_that_of_the_catalogue():
    root = Path(__file__).parents[2]
    script = importlib.util.spec_from_file_location("gallery", root / "docs/effects_gallery.py")
    module = importlib.util.module_from_spec(script)
    script.loader.exec_module(module)
    assert module.gallery() == (root / "docs/effects.md").read_text(), \
        "an effect has changed: run python docs/effects_gallery.py"
    assert {path.stem for path in (root / "docs/effects").glob("*.svg")} == set(LIBRARY)


@pytest.mark.parametrize("name", ["time_delay", "inertia", "backlash", "channel_skew"])
def test_a_figure_shows_characteristic_response_and_change(name):
    figure = effect_figure(name)
    assert len(figure.axes) == 3
    t, without, with_it = responses(name)
    assert without.shape == with_it.shape == (2, t.size)
    line = figure.axes[2].lines[0].get_ydata()
    assert np.max(np.abs(line)) == pytest.approx(1e3 * np.max(np.abs(with_it - without)))
    assert np.max(np.abs(line)) > 0


def test_every_effect_changes_the_gallery():
    """One excitation shows them all, so none of the pictures is empty."""
    for name in ("soft_stop", "step_fault", "torque_speed_limit", "supply_sag", "packet_hold"):
        _, without, with_it = responses(name)
        assert np.max(np.abs(with_it - without)) > 1e-4, name


@pytest.mark.parametrize("name", [n for n in LIBRARY if LIBRARY[n].symbol])
@pytest.mark.parametrize("period", [0, 1e-3])
def test_a_block_without_a_curve_shows_its_symbol(name, period):
    assert LIBRARY[name].curve is None
    assert LIBRARY[name].typical().block(1, period).icon == ("text", LIBRARY[name].symbol)


def test_an_effect_without_a_curve_says_where_to_look():
    with pytest.raises(DiagramError, match="look at its response in time"):
        LIBRARY["inertia"].typical().characteristic()
