"""What a user types first in Python: names are there, a path works, objects speak in a line."""

from pathlib import Path

import pytest

import clie_blocks
from clie_blocks.analysis.examples import FOLDER
from clie_blocks.errors import ClieError, RecordError

EXAMPLE = FOLDER / "friction-arm"


def test_first_names_are_there_and_listed():
    from clie_blocks import diagnose, gap, read_records  # noqa: F401

    assert {"diagnose", "read_records", "gap", "paper", "effects", "draw", "with_effects",
            "Record", "Robot", "Problem"} <= set(dir(clie_blocks))
    assert all(getattr(clie_blocks, name) is not None for name in dir(clie_blocks))


def test_every_object_speaks_in_one_line():
    records = clie_blocks.read_records(EXAMPLE)
    problem = clie_blocks.gap.read(EXAMPLE)
    program = clie_blocks.compile_diagram(clie_blocks.lowpass(1))
    said = {repr(thing) for thing in (records[0], records[0].robot, problem, program,
                                      clie_blocks.effects.LIBRARY["coulomb"])}
    assert all(len(text) < 140 and "\n" not in text and "0x" not in text for text in said)
    assert "shoulder, elbow" in repr(problem) and "3 logs, 12000 samples" in repr(problem)
    assert "law pd" in repr(records[0].robot)
    assert f"{len(program.states)} states" in repr(program)


def test_a_path_is_diagnosed_as_its_problem(tmp_path):
    few = {"effects": ("coulomb",), "seconds": 20.0}
    found = clie_blocks.diagnose(str(EXAMPLE) + "/", **few)
    row = found.to_dict()["effects"][0]
    assert row["effect"] == "coulomb" and row["joint"] == [2]
    assert row["parameters"]["level"]["value"] == pytest.approx([0.004], rel=0.01)
    assert "coulomb" in repr(found) and len(repr(found).splitlines()) <= 9


def test_what_only_paths_take_is_refused_beside_a_problem(tmp_path):
    problem = clie_blocks.gap.read(EXAMPLE)
    with pytest.raises(ClieError, match="stated already"):
        clie_blocks.diagnose(problem, trust_logs=True)
    with pytest.raises(RecordError, match="does not exist"):
        clie_blocks.diagnose(Path(tmp_path / "nothing"))
