"""The report: self-contained, escaped, small, readable on a phone, and true to the diagnosis."""

import dataclasses
import json
import re
import shutil
import subprocess
from html import escape
from xml.etree import ElementTree

import numpy as np
import pytest

from clie_blocks.analysis.gap.assessment.localisation import BLOCKS, block_shares
from clie_blocks.analysis.gap.assessment.torque_map import JointTorqueMap, TorqueMap
from clie_blocks.analysis.gap.diagnosis import diagnose
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.report import write_report
from clie_blocks.analysis.gap.report.answer import answer
from clie_blocks.analysis.gap.report.exports import simulator_names
from clie_blocks.analysis.gap.report.localisation import block_section
from clie_blocks.analysis.gap.report.plots import figure
from clie_blocks.analysis.gap.report.torque_map import torque_map_section
from clie_blocks.analysis.gap.report.wording import (
    join_words,
    local_unit,
    percent,
    with_prefix,
)
from clie_blocks.analysis.gap.verdict.signal_finding import SignalFinding
from clie_blocks.errors import ClieError
from clie_blocks.output import to_json

NASTY = "<script>alert('x')</script> & $y_1 \"q\""
LIMIT = 2_000_000  # bytes
PHONE = 390  # px


@pytest.fixture(scope="module")
def diagnosed(case):
    made = case("coulomb", seed=1)
    names = tuple(f"{NASTY} {k}" for k in range(made.robot.n))
    robot = dataclasses.replace(made.robot, joints=names)
    records = [record.replace(joints=names, robot=robot).noted(f"Decided {NASTY}")
               for record in made.records]
    return diagnose(Problem.from_logs(robot, records))


@pytest.fixture(scope="module")
def paths(diagnosed, tmp_path_factory):
    return write_report(diagnosed, answer(diagnosed), tmp_path_factory.mktemp("report"), "arm")


@pytest.fixture(scope="module")
def page(paths):
    with open(paths[0], encoding="utf-8") as file:
        return file.read()


def test_hostile_names_are_text(page):
    assert "<script" not in page and "alert('x')" not in page.replace("&#39;", "'").replace(
        "&lt;script&gt;alert('x')", "")
    assert "&lt;script&gt;" in page and "Decided &lt;script&gt;" in page


def test_page_is_one_small_file_without_network(page):
    assert len(page.encode()) < LIMIT
    assert "default-src 'none'" in page
    assert re.findall(r'(?:src|href)="(?!#|data:)([^"]*)"', page) == []


def test_page_holds_every_part(page):
    for heading in ("Where in the loop", "How far the gap shrinks", "Which effect causes it",
                    "Where by joint, time, frequency and operating range", "Alternative causes",
                    "Identified parameters", "Parameters for your simulator", "Checks",
                    "Assumptions", "Thresholds of the method"):
        assert f"<h2>{heading}</h2>" in page
    assert page.count("<svg") == len(re.findall("<figure>", page)) >= 4
    for name in ("frictionloss", "&lt;dynamics&gt;&lt;friction&gt;", "dynamicFrictionEffort"):
        assert name in page


def test_json_is_the_answer_with_the_share_of_each_block(paths):
    with open(paths[1]) as file:
        told = json.load(file, parse_constant=pytest.fail)
    assert told["schema_version"] == 3
    shares = {row["block"]: row["share"] for row in told["where"]["block"]}
    assert set(shares) == {*BLOCKS, "unassigned"}
    assert sum(shares.values()) == pytest.approx(1.0)


def test_the_block_of_the_cause_has_the_largest_share(diagnosed):
    rows = block_shares(diagnosed)
    assert diagnosed.ranking[0].names == ("coulomb",)
    assert rows[0]["block"] == "joint" and rows[0]["share"] > 0.5


@pytest.fixture(scope="module")
def model(diagnosed, tmp_path_factory):
    """The diagnosis as a MuJoCo model."""
    pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
    folder = tmp_path_factory.mktemp("model")
    diagnosed.export("mujoco", folder)
    return folder / "robot.corrected.xml"


def test_the_model_carries_joint_side_numbers(diagnosed, model):
    found, root = diagnosed, ElementTree.parse(model).getroot()
    joints, values = root.findall(".//joint"), found.model.hypothesis.values
    assert [joint.get("name") for joint in joints] == list(found.problem.joints)
    expected = found.problem.gear_ratio * values["coulomb.level"]
    np.testing.assert_allclose([float(joint.get("frictionloss")) for joint in joints], expected,
                               rtol=1e-5)
    for motor, ratio in zip(root.iter("general"), found.problem.gear_ratio, strict=True):
        assert float(motor.get("gear")) == ratio
    offsets = [float(motor.get("biasprm").split()[0]) for motor in root.iter("general")]
    np.testing.assert_allclose(offsets, -values["load"], rtol=1e-5)


def test_the_model_is_read_by_mujoco(diagnosed, model):
    import mujoco

    compiled, values = mujoco.MjModel.from_xml_path(str(model)), diagnosed.model.hypothesis.values
    ratio = diagnosed.problem.gear_ratio
    np.testing.assert_allclose(compiled.dof_damping, ratio * values["damping"], rtol=1e-5)
    np.testing.assert_allclose(compiled.actuator_gear[:, 0], ratio, rtol=1e-5)


def test_words():
    assert join_words(["a", "b", "c"]) == "a, b and c" and join_words([]) == ""
    assert [percent(x) for x in (0.0, 0.004, 0.5, 0.995, 1.0)] == [
        "0 %", "< 1 %", "50 %", "> 99 %", "100 %"]
    assert [with_prefix(x, "rad") for x in (2.0, 2e-3, 2e-6)] == ["2 rad", "2 mrad", "2 urad"]


@pytest.mark.parametrize("q, u, inertia, damping, wave", [
    ("rad", "N m", "kg m^2", "N m s/rad", "1/turn"), ("m", "N", "kg", "N s/m", "rad/m"),
    ("m", "V", "V s^2/m", "V s/m", "rad/m"), ("rad", "%", "% s^2/rad", "% s/rad", "1/turn"),
    ("rad", "u", "u s^2/rad", "u s/rad", "1/turn"), ("rad", "rad", "s^2", "s", "1/turn")])
def test_units_follow_position_and_command(q, u, inertia, damping, wave):
    units = {"q": q, "u": u}
    assert [local_unit(unit, units) for unit in ("kg m^2", "N m s/rad", "1/turn")] == [
        inertia, damping, wave]


def test_units_follow_the_machine():
    axis = {"q": "m", "u": "V"}
    assert local_unit("kg m^2", axis) == "V s^2/m" and local_unit("N m s/rad", axis) == "V s/m"
    assert local_unit("kg m^2", {"q": "rad", "u": "N m"}) == "kg m^2"


def test_every_known_effect_has_its_names():
    from clie_blocks.analysis.gap.causes import CAUSES

    assert all(len(simulator_names(cause.name)) == 3 for cause in CAUSES)


@pytest.mark.skipif(shutil.which("chromium") is None, reason="chromium is not installed")
def test_page_fits_a_phone(page, tmp_path):
    host = tmp_path / "host.html"
    host.write_text(
        f'<!doctype html><body><iframe id="f" width="{PHONE}" height="800" style="border:0" '
        f'srcdoc="{escape(page)}"></iframe><script>onload = () => {{'
        'const root = document.getElementById("f").contentDocument.documentElement;'
        'document.body.dataset.width = root.scrollWidth;'
        'document.body.dataset.figures = root.querySelectorAll("figure svg").length;}</script>')
    run = subprocess.run(
        ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom",
         f"--user-data-dir={tmp_path / 'profile'}", host.as_uri()],
        capture_output=True, text=True, timeout=60, check=True)
    width = int(re.search(r'data-width="(\d+)"', run.stdout)[1])
    assert int(re.search(r'data-figures="(\d+)"', run.stdout)[1]) >= 4
    assert 0 < width <= PHONE


def test_a_torque_map_is_drawn_with_its_interval(diagnosed):
    places, speeds = np.linspace(-1.0, 1.0, 16), np.linspace(0.1, 2.0, 8)
    table = JointTorqueMap(0, places, speeds, np.stack([places, -places]), np.ones((2, 8)),
                       np.full((2, 16), 0.1), np.full((2, 8), 0.2), 0.04)
    rest = TorqueMap((table,), 2e-4, 31.5, (20.8, 42.4), ("coulomb",))
    units = {"q": "rad", "u": "N m"}
    section = torque_map_section(dataclasses.replace(diagnosed, torque_map=rest), units)
    assert "added to coulomb, removes 31.5 % (20.8 .. 42.4) of the remaining reducible gap" in (
        section.sentences[0])
    assert "changes no verdict" in section.sentences[0]
    place, speed = section.pictures[0].figure.axes
    assert np.allclose(place.lines[0].get_ydata(), places)
    assert "<script>" in place.get_xlabel() and speed.get_xlabel().endswith("[rad/s]")
    section.pictures[0].figure.canvas.draw()
    assert torque_map_section(dataclasses.replace(diagnosed, torque_map=None), units) is None


def of_servo():
    """What the goals of a servo show."""
    times = {name: {"value": np.array([value]), "unit": "s",
                    "interval": [np.array([value - 0.01]), np.array([value + 0.01])]}
             for name, value in (("time", 0.02), ("dead_time", 0.06))}
    left = {name: np.array([rms]) for name, rms in (
        ("lag", 7e-3), ("setpoint_delay", 6e-3), ("coulomb", 5e-3), ("both", 2e-3))}
    return SignalFinding("time_delay", (0,), 0.95, times, 0.4, left)


def test_delayed_set_points_come_first_and_only_the_delay_goes_to_a_simulator(
        diagnosed, tmp_path):
    found = diagnosed
    late = dataclasses.replace(found, findings=(of_servo(),))
    content = answer(late)
    told = json.loads(to_json(content))
    assert told["effects"][0]["effect"] == "time_delay" == told["set_90"][0]
    assert told["families"]["timing"] == 0.95 and told["families"]["friction"] > 0.9
    before = {row["block"]: row["share"] for row in block_shares(found)}
    after = {row["block"]: row["share"] for row in block_shares(late)}
    assert after["controller"] == pytest.approx(0.4 + 0.6 * before["controller"])
    assert sum(after.values()) == pytest.approx(1.0)
    with open(write_report(late, content, tmp_path, "arm")[0], encoding="utf-8") as file:
        page = file.read()
    section = page.split("<h2>On the command path</h2>")[1].split("<h2>")[0]
    assert "0.06" in section and "7 mrad" in section and "hide each other" in section
    numbers = page.split("<h2>Identified parameters</h2>")[1].split("<h2>")[0]
    assert "time delay: time" in numbers and "dead" not in numbers
    assert "<script" not in page


def test_the_thresholds_of_the_method_stand_last_and_collapsed(page, diagnosed):
    last = page.split("<h2>")[-1]
    assert last.startswith("Thresholds of the method</h2>") and "<details>" in last
    opened = [part.partition("</h2>")[0] for part in page.split("<h2>")[1:]
              if "<details>" not in part]
    assert opened == ["Where in the loop", "How far the gap shrinks", "Which effect causes it",
                      "Alternative causes", "Parameters for your simulator"]
    assert page.index("What to do next") < page.index("<h2>")
    shown = re.findall(r"<tr><td>([a-z_.0-9]+)</td>", last)
    assert shown == [one.name for one in diagnosed.method.thresholds()] and len(shown) > 20


def test_units_are_those_of_the_logs(diagnosed):
    sliding = [record.replace(units={**record.units, "q": "m", "u": "V"})
               for record in diagnosed.problem.records]
    problem = dataclasses.replace(diagnosed.problem, records=tuple(sliding))
    content = answer(dataclasses.replace(diagnosed, problem=problem))
    assert content["noise"][0]["unit"] == content["where"]["joint"][0]["unit"] == "m"
    assert content["joint_model"]["inertia"]["unit"] == "V s^2/m"
    assert content["effects"][0]["parameters"]["level"]["unit"] == "V"
    assert content["theorem_2"]["modelling_error"]["unit"] == "m/s^2"
    assert answer(diagnosed)["joint_model"]["damping"]["unit"] == "N m s/rad"


@pytest.mark.parametrize("name", ["motions", "probabilities", "where", "residuals"])
def test_figures_are_drawn_by_name(diagnosed, name):
    drawn = figure(diagnosed, name)
    drawn.canvas.draw()
    assert all(ax.has_data() for ax in drawn.axes if ax.axison)


def test_an_unknown_figure_names_the_nearest(diagnosed):
    with pytest.raises(ClieError, match="motions"):
        figure(diagnosed, "motion")


def test_a_robot_without_such_causes_has_no_such_section(page, diagnosed):
    assert "On the command path" not in page and diagnosed.findings == ()


def test_parameter_errors_are_the_joints_and_no_gap_has_no_block(diagnosed):
    found = diagnosed
    for name, expected in (("parametric", "joint"), ("none", None)):
        alone = dataclasses.replace(
            found, ranking=[dataclasses.replace(found.ranking[0], names=(name,), fit=found.nominal,
                                                probability=1.0)])
        shares = {row["block"]: row["share"] for row in block_shares(alone)}
        assert sum(shares.values()) == pytest.approx(1.0 if expected else 0.0)
        assert expected is None or shares[expected] == 1.0
        section = block_section(block_shares(alone))
        assert ("no gap to assign" in section.sentences[0]) == (expected is None)
