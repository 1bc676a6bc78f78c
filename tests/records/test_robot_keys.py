"""One table of keys: the page, the schema and the check of a robot file say the same."""

import importlib.util
import json
import tomllib
from pathlib import Path

import pytest

from clie_blocks.analysis.cli import main
from clie_blocks.analysis.examples import FOLDER
from clie_blocks.analysis.records import read_robot
from clie_blocks.analysis.records.robot_file import SECTIONS, TOP
from clie_blocks.analysis.records.robot_keys import keys_of, robot_schema
from clie_blocks.errors import RecordError

DOCS = Path(__file__).resolve().parents[2] / "docs"
ALL = (*SECTIONS, "experiment")


def refused(table):
    jsonschema = pytest.importorskip("jsonschema")
    return [error.message for error in
            jsonschema.Draft7Validator(robot_schema()).iter_errors(table)]


def test_page_and_schema_are_those_of_today():
    spec = importlib.util.spec_from_file_location("robot_file_page", DOCS / "robot_file.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    assert (DOCS / "robot_file.md").read_text() == script.page(), "run python docs/robot_file.py"
    assert json.loads((DOCS / "robot.schema.json").read_text()) == robot_schema()


@pytest.mark.parametrize("section", ALL)
def test_every_key_has_a_meaning_of_its_own(section):
    keys = keys_of(section)
    assert keys and all(key.meaning and key.value for key in keys)
    by_field = {key.meaning for key in keys}
    spellings = {"resolution_m", "start_m", "set_point_m", "amplitude_m", "saturation",
                 "command_resolution", "zero", "dead_band_m", "punch", "command_rate",
                 "lower_m", "upper_m", "speed_m_s", "command",
                 "u"}  # of the same field in another unit, or its former name
    assert len(by_field) == len([key for key in keys if key.name not in spellings])


def test_the_schema_holds_the_sections_of_the_reader():
    assert set(robot_schema()["properties"]) == set(TOP)


def test_files_that_are_read_are_valid(shared):
    files = [FOLDER / "friction-arm" / "robot.toml", *sorted(shared.glob("*/*/robot.toml"))]
    for path in files:
        assert read_robot(path) and refused(tomllib.loads(path.read_text())) == []


@pytest.mark.parametrize("text", [
    "joints = 1\n[motor]\ngear_ration = 1", "joints = 1\n[motor]\ninertia_kgm2 = -1",
    "joints = 1\n[motor]\ngear_ratio = 'high'", "joints = 0", "name = 'arm'",
    "joints = 1\n[nominal]\ngravity = 1", "joints = 1\n[units]\nuu = 'V'",
    "joints = 1\n[controller]\nlaw = 'pdd'", "joints = 1\n[links]\ngravity_m_s2 = [0, 1]",
    "joints = 1\n[experiment.log-1]\nexcitation = 3"])
def test_what_the_reader_refuses_the_schema_refuses(tmp_path, text):
    path = tmp_path / "robot.toml"
    path.write_text(text)
    with pytest.raises(RecordError):
        read_robot(path)
    assert refused(tomllib.loads(text))


def test_every_wrong_line_is_named_at_once_in_their_order(tmp_path, capsys):
    path = tmp_path / "robot.toml"
    path.write_text("joints = 2\nengine = 1\n[motor]\ngear_ration = 100\ninertia_kgm2 = -1.0\n"
                    "[controller]\nKp = [1, 2, 3]\nKd = 1\n[units]\nu = 3\n")
    assert main(["robot", "--check", str(path)]) == 3
    lines = [line for line in capsys.readouterr().err.splitlines() if line]
    assert [line.partition("robot.toml:")[2].partition(":")[0] for line in lines] == [
        "2", "4", "5", "7", "10"]
    assert "did you mean 'gear_ratio'" in lines[1] and "Kp has 3 entries" in lines[3]


def test_a_check_says_what_missing_lines_would_buy(tmp_path, capsys):
    path = tmp_path / "robot.toml"
    path.write_text("joints = 2\n")
    assert main(["robot", "--check", str(path)]) == 0
    shown = capsys.readouterr().out
    for key in ("gear_ratio", "inertia_kgm2", "[links]", "Kp, Kd", "resolution_rad"):
        assert key in shown
    assert main(["robot", "--check", str(FOLDER / "friction-arm" / "robot.toml"), "--json"]) == 0
    (open_line,) = json.loads(capsys.readouterr().out)["open"]
    assert open_line.startswith("[controller] saturation_nm")


def test_the_schema_is_printed_and_written_beside_a_new_file(tmp_path, capsys):
    assert main(["robot", "--schema"]) == 0
    assert json.loads(capsys.readouterr().out) == robot_schema()
    assert main(["robot", "--joints", "1", "-o", str(tmp_path)]) == 0
    first = (tmp_path / "robot.toml").read_text().splitlines()[0]
    assert first == "#:schema ./robot.schema.json"
    assert json.loads((tmp_path / "robot.schema.json").read_text()) == robot_schema()
