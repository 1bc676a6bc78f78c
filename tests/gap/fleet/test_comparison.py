"""Units of one robot: what they share, which one is odd, as a text, a page and JSON."""

import copy
import json

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

import law_robots  # noqa: E402

from clie_blocks.analysis.gap.command import main  # noqa: E402
from clie_blocks.analysis.gap.fleet.comparison import compare_units  # noqa: E402
from clie_blocks.analysis.gap.fleet.page import page  # noqa: E402
from clie_blocks.analysis.report.render import markdown  # noqa: E402
from clie_blocks.errors import ClieError  # noqa: E402


def answer(level, seed=0, effect="coulomb", joints=("hip", "knee")):
    """JSON answer of a unit with an effect at the second joint, from three logs."""
    rng = np.random.default_rng(seed)
    rows = [{"effect": effect, "joint": 2, "parameter": "level", "unit": "N m",
             "value": level + 0.002 * rng.normal(size=3), "deviation": np.full(3, 0.002)},
            {"effect": "joint model", "joint": 1, "parameter": "inertia", "unit": "kg m^2",
             "value": 0.05 + 1e-4 * rng.normal(size=3), "deviation": np.full(3, 1e-4)}]
    return {"verdict": "effect", "by_log": rows,
            "effects": [{"effect": effect, "joint": [2], "probability": 0.97}],
            "where": {"joint": [{"name": name} for name in joints]}}


def units(*levels):
    return {f"unit-{k + 1}": answer(level, k) for k, level in enumerate(levels)}


def test_units_of_one_kind_share_their_cause_and_none_is_odd():
    fleet = compare_units(units(0.2, 0.2, 0.2, 0.2))
    assert fleet.common == (("coulomb", 2),) and not fleet.odd()
    level = fleet.parameters[0]
    assert abs(level.common.mean - 0.2) < level.common.half < 0.01
    assert "common: coulomb at knee" in str(fleet) and "None of the 4 units" in page(fleet).verdict


def test_a_worn_unit_is_named_and_left_out_of_the_common_value():
    fleet = compare_units(units(0.2, 0.2, 0.2, 0.5, 0.2))
    assert list(fleet.odd()) == ["unit-4"]
    assert "coulomb level at knee 0.5 N m, the others 0.2 to 0.2" in fleet.odd()["unit-4"][0]
    level = fleet.parameters[0]
    assert abs(level.common.mean - 0.2) < 0.01 and not level.common.units_differ
    text = markdown(page(fleet))
    assert "unit-4 is odd" in text and json.dumps(fleet.to_dict()["odd"])


def test_a_unit_with_another_cause_is_odd_by_that():
    several = {**units(0.2, 0.2, 0.2), "unit-4": answer(0.01, effect="backlash")}
    assert compare_units(several).odd()["unit-4"] == [
        "backlash at knee in this unit", "no coulomb at knee"]


def test_what_cannot_be_compared_is_refused_with_the_remedy():
    with pytest.raises(ClieError, match="from 2 units on, and 1 of 2 robots were diagnosed"):
        compare_units({**units(0.2), "broken": {"error": "no logs", "exit_code": 3}})
    other = {"arm": answer(0.2, joints=("a", "b")), **units(0.2)}
    with pytest.raises(ClieError, match="arm has the joints a, b and unit-1 hip, knee"):
        compare_units(other)


def test_one_unit_is_no_fleet_and_is_said_so_before_the_work(tmp_path):
    law_robots.Robot(law_robots.pd, law_robots.STATED_PD).write(tmp_path, seconds=1.0)
    with pytest.raises(ClieError, match="and there is one: name a folder with a folder of logs"):
        main([str(tmp_path), "--fleet"])


def test_a_parameter_that_the_logs_do_not_show_is_not_compared():
    several = copy.deepcopy(units(0.2, 0.2, 0.2))
    several["unit-2"]["by_log"][0]["deviation"][1] = 0.0
    assert [one.name for one in compare_units(several).parameters] == ["inertia"]


@pytest.mark.slow
def test_five_robots_of_another_engine_of_which_one_is_worn(tmp_path, monkeypatch, capsys):
    friction = {"north": 0.25, "south": 0.245, "east": 0.36, "west": 0.255, "centre": 0.25}
    for name, level in friction.items():
        monkeypatch.setattr(law_robots, "FRICTION", level)
        law_robots.Robot(law_robots.pd, law_robots.STATED_PD).write(
            tmp_path / "robots" / name, "coulomb", logs=3, seconds=6.0)
    assert main([str(tmp_path / "robots"), "--fleet", "--effects", "coulomb", "--quiet",
                 "-o", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert "5 units; common: coulomb at joint1." in said and "Odd: east: coulomb level" in said
    found = json.loads((tmp_path / "out" / "fleet.json").read_text())
    level = next(one for one in found["parameters"] if one["parameter"] == "level")
    assert level["odd"] == ["east"]
    for unit in level["units"]:
        assert unit["value"] == pytest.approx(friction[unit["name"]], rel=0.02)
    assert "<svg" in (tmp_path / "out" / "fleet.html").read_text()
