"""What a user types first in Python: names are there, a path works, objects speak in a line."""

from pathlib import Path

import numpy as np
import pytest

import clie_blocks
from clie_blocks.analysis.examples import FOLDER
from clie_blocks.errors import ClieError, RecordError

EXAMPLE = FOLDER / "friction-arm"


def test_first_names_are_there_and_listed():
    from clie_blocks import diagnose, gap, read_records  # noqa: F401

    assert {"diagnose", "read_records", "gap", "paper", "effects", "draw", "with_effects",
            "Record", "Robot", "Problem",
            "Diagnosis", "Program", "Effect", "Setting", "LIBRARY"} <= set(dir(clie_blocks))
    assert all(getattr(clie_blocks, name) is not None for name in dir(clie_blocks))


def test_every_object_speaks_in_one_line():
    records = clie_blocks.read_records(EXAMPLE)
    problem = clie_blocks.gap.read(EXAMPLE)
    program = clie_blocks.compile_diagram(clie_blocks.lowpass(1))
    robot, coulomb = records[0].robot, clie_blocks.LIBRARY["coulomb"]
    said = {repr(thing) for thing in (
        records[0], robot, robot.motor, robot.links, robot.controller, robot.encoder, problem,
        program, clie_blocks.LIBRARY, coulomb, *coulomb.parameters, coulomb(level=[0.1, 0.2]),
        clie_blocks.Method(), clie_blocks.Method().with_values(**{"search.leaders": 12}))}
    assert "Motor(gear_ratio=[100, 50], inertia=[5e-05, 3e-05]" in repr(robot.motor)
    assert all(len(text) < 140 and "\n" not in text and "0x" not in text for text in said)
    assert "shoulder, elbow" in repr(problem) and "3 logs, 12000 samples" in repr(problem)
    assert "law pd" in repr(records[0].robot)
    assert f"{len(program.states)} states" in repr(program)


def test_a_parameter_has_its_bare_name_in_one_block_and_a_dot_in_a_diagram():
    arm = clie_blocks.paper.paper_arm()
    alone, loop = clie_blocks.compile_diagram(arm), clie_blocks.compile_diagram(
        clie_blocks.joint_loop(arm, [10, 10], [5, 5]))
    at_rest = {"u": [0.1, 0.0]}
    bare, dotted = (alone.run(0.1, inputs=at_rest, params={key: [3.0, 2.0]}).outputs
                    for key in ("mass", "plant.mass"))
    np.testing.assert_array_equal(bare, dotted)
    assert np.max(np.abs(bare - alone.run(0.1, inputs=at_rest).outputs)) > 1e-6
    with pytest.raises(ClieError, match=r"'mass'; did you mean 'plant.mass'"):
        loop.run(0.1, inputs={"q_d": 0.0, "pe": 0.0}, params={"mass": [3.0, 2.0]})
    with pytest.raises(ClieError, match=r"'mas'; did you mean 'mass'"):
        alone.run(0.1, inputs=at_rest, params={"mas": [3.0, 2.0]})


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
