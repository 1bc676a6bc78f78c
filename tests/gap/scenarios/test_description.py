"""A number of the robot file that is stated wrong is named as such: the robot is sound."""

import dataclasses

import numpy as np
import pytest

pytest.importorskip("mujoco")

from clie_blocks.analysis.blind.engine.robot import draw_robot
from clie_blocks.analysis.blind.population.files import write_trial
from clie_blocks.analysis.blind.population.maker import RejectedError
from clie_blocks.analysis.blind.population.standard import draw_trial
from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.report.summary import summary_lines
from clie_blocks.analysis.records import read_trial

pytestmark = pytest.mark.slow

NO_LIMIT = 3600.0  # s: a busy machine does not change an answer


def drawn(kind, names, severity, seed):
    """Trial of an arm of two links under gravity, by the engine of the blind trials."""
    for index in range(200):
        robot = draw_robot(np.random.default_rng([seed, index]), "arm")
        if not robot.gravity or robot.n != 2:
            continue
        try:
            return draw_trial(np.random.default_rng([seed, index]), index, kind, names, severity,
                              "arm")
        except RejectedError:
            continue
    raise AssertionError("no arm was drawn")


@pytest.fixture(scope="module")
def records_of(tmp_path_factory):
    """Function from a trial to its logs."""
    def records(name, *trial):
        folder = tmp_path_factory.mktemp(name)
        write_trial(drawn(*trial), folder)
        return read_trial(folder)[1]
    return records


@pytest.fixture(scope="module")
def sound(records_of):
    return records_of("sound", "none", (), None, 1)


@pytest.fixture(scope="module")
def rubbing(records_of):
    return records_of("rubbing", "single", ("coulomb",), "medium", 6)


def answer_of(records, section="motor", **changed):
    """Answer on logs whose robot file states other numbers in a section."""
    robot = records[0].robot
    stated = dataclasses.replace(robot, **{section: dataclasses.replace(
        getattr(robot, section), **changed)})
    logs = [record.replace(robot=stated) for record in records]
    return diagnose(Problem.from_logs(stated, logs), seconds=NO_LIMIT).to_dict()


ALIKE = {"asymmetric_coulomb": "coulomb"}  # no log tells it from an offset of the drive


def names(answer, least=0.5):
    """Effects with half the probability; those that no log tells apart count together."""
    sums = {}
    for row in answer["effects"]:
        name = ALIKE.get(row["effect"], row["effect"])
        sums[name] = sums.get(name, 0.0) + row["probability"]
    return {name for name, probability in sums.items() if probability >= least}


def check_numbers(answer, key, right):
    """The answer lists a number of the file as it is in truth."""
    rows = [row for row in answer["description"] if row["key"] == key]
    assert [row["identified"] for row in rows] == pytest.approx(list(right), rel=0.02)
    assert all(f"{key} of " in " ".join(summary_lines(answer)) for row in rows)


def test_a_gear_ratio_stated_a_quarter_too_high(sound):
    right = sound[0].robot.motor.gear_ratio
    answer = answer_of(sound, gear_ratio=1.25 * right)
    assert answer["verdict"] == "parametric" and answer["set_90"] == ["parametric"]
    check_numbers(answer, "motor.gear_ratio", right)


def test_masses_stated_a_quarter_too_low(sound):
    right = sound[0].robot.links.mass
    answer = answer_of(sound, "links", mass=0.75 * right)
    assert answer["verdict"] == "parametric" and answer["set_90"] == ["parametric"]
    check_numbers(answer, "links.mass_kg", right)


def test_centres_of_mass_measured_from_the_far_end(sound):
    links = sound[0].robot.links
    answer = answer_of(sound, "links", com=links.length - links.com)
    assert answer["verdict"] == "parametric" and answer["set_90"] == ["parametric"]
    check_numbers(answer, "links.com_m", links.com)
    assert "measured from the far end" in " ".join(summary_lines(answer))


@pytest.mark.parametrize("section, field, factor, key", [
    ("motor", "gear_ratio", 1.25, "motor.gear_ratio"), ("links", "mass", 0.75, "links.mass_kg")])
def test_friction_and_a_wrong_number_are_told_apart(rubbing, section, field, factor, key):
    right = getattr(getattr(rubbing[0].robot, section), field)
    answer = answer_of(rubbing, section, **{field: factor * right})
    assert answer["verdict"] == "effect"
    assert names(answer) == {"coulomb", "parametric"}
    check_numbers(answer, key, right)


@pytest.mark.parametrize("field, factor, key, tolerance", [
    ("inertia", 1.25, "motor.inertia_kgm2", 0.02),
    ("viscous_friction", 0.625, "motor.viscous_friction_nms", 0.2)])
def test_a_number_of_a_drive_is_named_beside_friction(rubbing, field, factor, key, tolerance):
    right = getattr(rubbing[0].robot.motor, field)
    answer = answer_of(rubbing, **{field: right * [factor, 1.0]})
    row, = answer["description"]
    assert (row["key"], row["joint"]) == (key, 1) and row["probability"] > 0.9
    assert row["identified"] == pytest.approx(right[0], rel=tolerance)
    assert names(answer) - {"parametric"} == {"coulomb"} and answer["verdict"] == "effect"
    assert f"The numbers of robot.toml are off as well: {key}" in " ".join(summary_lines(answer))


def test_a_right_file_is_not_blamed(rubbing):
    answer = answer_of(rubbing)
    assert answer["description"] == [] and "parametric" not in answer["set_90"]
    assert answer["effects"][0]["effect"] == "coulomb"
