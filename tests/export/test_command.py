"""``clie export`` and ``clie replay`` as their users type them."""

import json
from pathlib import Path

import numpy as np
import pytest

from clie_blocks.analysis import cli
from clie_blocks.analysis.export.export import TARGETS as EXPORTED
from clie_blocks.analysis.export.replay import replay
from clie_blocks.analysis.export.truth_table import TARGETS, markdown, support
from clie_blocks.analysis.gap.calibration.robots import draw_cases
from clie_blocks.analysis.gap.diagnosis import diagnose
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.effects import LIBRARY

JOINT = {"name": "axis", "kind": "hinge", "units": {"q": "rad", "u": "N m"}, "zero": 0.0,
         "gear_ratio": 10.0, "encoder": "link", "gear": 10.0, "gain": 1.0, "torque": 10.0,
         "command": 1.0, "inertia": 0.5, "beside_links": 0.5, "links_known": False,
         "damping": 0.2, "offset": 0.0, "before": {"gear": 10.0, "gain": 1.0}}
CORRECTION = {"basis": "datasheet", "not_exported": None, "period": 0.001, "joints": [JOINT],
              "effects": [{"effect": "stribeck", "joints": [1], "parameters": {
                  "level": [0.02], "excess": [0.01]}}], "of_law": [], "without_block": [],
              "uncertainty": {"numbers": ["joint.axis.damping", "effect.0.level.0"],
                              "covariance": [[4e-4, -1e-5], [-1e-5, 1e-6]]}}
ANSWER = {"verdict": "effect", "correction": CORRECTION}


def written(folder, **changes):
    """Path of an answer with some keys of its correction changed."""
    path = folder / "answer.json"
    path.write_text(json.dumps({**ANSWER, "correction": {**CORRECTION, **changes}}))
    return str(path)


def failure(capsys, *words):
    """Exit code and message of a command."""
    code = cli.main(list(words))
    return code, capsys.readouterr().err


def test_c_files_are_written_and_named(tmp_path, capsys):
    out = tmp_path / "out"
    assert cli.main(["export", written(tmp_path), "--to", "c", "-o", str(out), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert sorted(path.name for path in out.iterdir()) == ["axis.c", "axis.h"]
    assert told["target"] == "c" and "inertia of 0.5 kg m^2" in told["notes"][0]
    assert "#define AXIS_STEP 0.000125" in (out / "axis.h").read_text()


def test_a_diff_of_the_users_model_is_shown_and_the_model_is_kept(tmp_path, capsys):
    pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
    own = tmp_path / "own.xml"
    own.write_text('<mujoco>\n  <option timestep="0.001"/>\n  <worldbody>\n    <body>\n'
                   '      <joint name="axis"/>\n      <geom size="0.01"/>\n    </body>\n'
                   '  </worldbody>\n  <actuator>\n    <motor joint="axis" gear="10"/>\n'
                   '  </actuator>\n</mujoco>\n')
    text, out = own.read_text(), tmp_path / "out"
    assert cli.main(["export", written(tmp_path), "--to", "mujoco", "--model", str(own), "-o",
                     str(out)]) == 0
    shown = capsys.readouterr().out
    assert '-      <joint name="axis"/>' in shown
    assert '+      <joint name="axis" armature=' in shown
    assert own.read_text() == text == (out / "own.original.xml").read_text()
    assert (out / "own.diff").read_text() == shown
    told = json.loads((out / "corrected_joints.json").read_text())
    assert told["joints"][0]["module"] == ["stribeck"] and (out / "corrected_joints.py").is_file()


def test_samples_keep_the_ranges_and_what_goes_together(tmp_path):
    out = tmp_path / "out"
    assert cli.main(["export", written(tmp_path), "--to", "c", "-o", str(out), "--samples",
                     "4000"]) == 0
    told = json.loads((out / "samples.json").read_text())
    damping, level = told["numbers"]
    assert (damping["identified"], level["identified"]) == (0.2, 0.02)
    assert level["meaning"] == "level of stribeck at axis, in the model [N m]"
    assert damping["standard_deviation"] == pytest.approx(0.02, rel=0.05)
    assert level["high"] - level["low"] == pytest.approx(2 * 1.645 * 1e-3, rel=0.1)
    drawn = np.array(told["samples"])
    assert np.corrcoef(drawn.T)[0, 1] == pytest.approx(-0.5, abs=0.05)
    assert told["correlation"][0][1] == pytest.approx(-0.5)


def test_each_sample_is_a_model_of_its_own(tmp_path):
    mujoco = pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
    out = tmp_path / "out"
    assert cli.main(["export", written(tmp_path, effects=[{
        "effect": "coulomb", "joints": [1], "parameters": {"level": [0.02]}}]), "--to", "mujoco",
        "-o", str(out), "--samples", "3", "--seed", "7"]) == 0
    told = np.array(json.loads((out / "samples.json").read_text())["samples"])
    models = [mujoco.MjModel.from_xml_path(str(out / "samples" / f"{k:03d}" /
                                               "robot.corrected.xml")) for k in range(3)]
    assert [float(one.joint("axis").damping[0]) for one in models] == pytest.approx(told[:, 0])
    assert [float(one.dof_frictionloss[0]) for one in models] == pytest.approx(10.0 * told[:, 1])


@pytest.mark.parametrize("changes, words, message", [
    ({}, ["--to", "c", "-o", "out", "--samples", "1"], "two or more"),
    ({"uncertainty": {"numbers": [], "covariance": []}},
     ["--to", "c", "-o", "out", "--samples", "8"], "nothing to draw"),
    ({}, ["--to", "mujocco", "-o", "out"], "did you mean 'mujoco'"),
    ({}, ["--to", "c"], "-o DIR"),
    ({}, ["--to", "c", "-o", "out", "--joint", "axes=j1"], "no joint 'axes'"),
    ({}, ["--to", "c", "-o", "out", "--joint", "axis"], "NAME_IN_LOG=NAME_IN_MODEL"),
    ({}, ["--to", "c", "-o", "out", "--step", "0.01"], "a fraction of it"),
    ({}, ["--to", "mujoco", "-o", "out", "--step", "0.001"], "set its option"),
    ({}, ["--to", "c", "-o", "out", "--model", "own.xml"], "patches no model"),
    ({"not_exported": "state Kt"}, ["--to", "c", "-o", "out"], "needs N m: state Kt"),
    ({"effects": [{"effect": "coulom", "joints": [1], "parameters": {}}]},
     ["--to", "c", "-o", "out"], "did you mean 'coulomb'"),
])
def test_what_cannot_be_exported_is_refused_in_words(tmp_path, capsys, monkeypatch, changes,
                                                     words, message):
    monkeypatch.chdir(tmp_path)
    code, told = failure(capsys, "export", written(tmp_path, **changes), *words)
    assert code in (2, 3) and message in told


@pytest.mark.parametrize("content, message", [
    ("{", "cannot be read as JSON"), ("[]", "no answer of one robot"),
    (json.dumps({"one": {"verdict": "effect"}}), "it holds several: one"),
    (json.dumps({"verdict": "effect"}), "diagnose the logs again"),
    (json.dumps({**ANSWER, "verdict": "none"}), "no correction to export")])
def test_a_file_that_is_no_answer_is_refused(tmp_path, capsys, content, message):
    path = tmp_path / "other.json"
    path.write_text(content)
    code, told = failure(capsys, "export", str(path), "--to", "c", "-o", str(tmp_path / "out"))
    assert code == 3 and message in told


def test_the_table_of_the_page_is_the_one_of_the_program():
    page = (Path(__file__).parents[2] / "docs" / "export.md").read_text()
    assert markdown() in page


def test_the_page_of_an_effect_says_how_it_is_exported(capsys):
    cli.main(["effects", "joint_elasticity"])
    page = " ".join(capsys.readouterr().out.split())
    assert ("exported ('clie export') mujoco extra bodies gazebo plugin simscape impossible "
            "code native") in page
    assert {str(support(name, target)) for name in LIBRARY for target in TARGETS} >= {
        "native", "native, partial", "plugin", "controller", "extra bodies", "your bodies",
        "impossible"}


def test_the_help_names_every_target(capsys):
    with pytest.raises(SystemExit):
        cli.main(["export", "--help"])
    told = "".join(capsys.readouterr().out.split())  # lines break at hyphens too
    assert [name for name in EXPORTED if name not in told] == []


@pytest.mark.slow
def test_a_diagnosis_exported_and_replayed_closes_the_gap_that_it_predicts(tmp_path):
    pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
    (made,) = draw_cases(1, 5, ["coulomb"], ["single"], duration=3.0)
    problem = Problem.from_logs(made.robot, made.records)
    found = diagnose(problem, effects=("coulomb",))
    found.export("mujoco", tmp_path)
    gaps = replay(problem, tmp_path / "robot.corrected.xml").gaps
    predicted = found.reduction
    corrected = float(np.sqrt(sum(one.corrected**2 for one in gaps)))
    nominal = float(np.sqrt(sum(one.nominal**2 for one in gaps)))
    assert corrected < 1.15 * max(predicted.after, predicted.floor) and corrected < nominal / 3
