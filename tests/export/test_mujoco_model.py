"""The user's MJCF is patched, not replaced, and refused with a reason where it cannot be."""

import math
from xml.etree import ElementTree

import numpy as np
import pytest

from clie_blocks.analysis.export.correction import Correction
from clie_blocks.analysis.export.mujoco_model import corrected_model
from clie_blocks.analysis.export.mujoco_target import export_mujoco
from clie_blocks.errors import ClieError, RecordError
from tests.export import robots

mujoco = pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
OWN = """<?xml version="1.0"?>
<!-- The bench, by hand. -->
<mujoco model="bench">
  <option timestep="0.0005"   gravity="0 0 0"/>
  <default><joint   damping="9"/></default>
  <worldbody>
    <body name="wheel" pos="0 0 0.2">
      <joint  name="j1" axis="0 1 0"
              armature="0.5"/>  <!-- guessed -->
      <geom type="cylinder" size="0.1 0.01" euler="90 0 0" density="1000"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="m1" joint="j1"/>   <!-- N m -->
  </actuator>
</mujoco>
"""


def patched(text=OWN, *effects, **changes):
    """The model with the correction of one joint."""
    return corrected_model(robots.correction(*effects, **changes), text, "own.xml")


def element(text, path):
    """One element of a text."""
    return ElementTree.fromstring(text).find(path)


def test_all_else_stays_as_it_stands():
    found = patched(OWN, robots.setting("coulomb"))
    before, after = OWN.splitlines(), found.text.splitlines()
    assert len(before) == len(after)
    changed = [k for k, pair in enumerate(zip(before, after)) if pair[0] != pair[1]]
    assert [before[k].strip()[:12] for k in changed] == ['armature="0.', "<motor name="]
    assert "<!-- guessed -->" in after[changed[0]] and "<!-- N m -->" in after[changed[1]]


def test_the_armature_is_what_the_bodies_of_the_model_do_not_bring():
    model = mujoco.MjModel.from_xml_string(patched().text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    whole = np.zeros((1, 1))
    mujoco.mj_mulM(model, data, whole[0], np.ones(1))
    assert whole[0, 0] == pytest.approx(robots.INERTIA, rel=1e-6)
    assert 0.0 < model.dof_armature[0] < robots.INERTIA


def test_bodies_that_bring_more_than_the_joint_has_are_said():
    found = patched(OWN, inertia=1e-4, beside_links=1e-4)
    assert element(found.text, ".//worldbody//joint").get("armature") == "0"
    assert any("more about j1 than the logs show" in note for note in found.notes)


def test_bodies_that_bring_a_little_more_are_mended_by_a_negative_armature():
    """As behind a loose gear, whose motor is found to be a little heavier than the datasheet's."""
    whole = 0.9 * wheel_inertia()
    found = patched(OWN, inertia=whole, beside_links=whole)
    model = mujoco.MjModel.from_xml_string(found.text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert model.dof_armature[0] == pytest.approx(-wheel_inertia() / 10)
    data.ctrl[0] = 1.0
    mujoco.mj_step(model, data)
    assert data.qacc[0] == pytest.approx((1.0 - robots.LOAD) / whole, rel=1e-6)
    assert any("armature is negative" in note for note in found.notes)


def wheel_inertia():
    """Inertia of the wheel of the bench about its axis [kg m^2]."""
    mass = 1000.0 * math.pi * 0.1**2 * 0.02
    return mass * 0.1**2 / 2


def test_stated_links_leave_the_armature_to_the_diagnosis():
    found = patched(OWN, links_known=True, beside_links=0.015)
    assert element(found.text, ".//worldbody//joint").get("armature") == "0.015"


def test_a_spring_is_written_in_the_angle_of_the_model():
    spring = robots.setting("spring", rest=0.1)
    in_degrees = element(patched(OWN, spring).text, ".//worldbody//joint")
    assert float(in_degrees.get("springref")) == pytest.approx(math.degrees(0.1))
    radian = OWN.replace("  <option", '  <compiler angle="radian"/>\n  <option').replace(
        "90 0 0", "1.57 0 0")
    assert float(element(patched(radian, spring).text, ".//worldbody//joint").get(
        "springref")) == pytest.approx(0.1)


def test_a_control_in_another_unit_is_told_and_kept():
    found = patched(OWN.replace('joint="j1"/>', 'joint="j1" gear="0.25"/>'),
                    robots.setting("actuator_saturation", limit=2.0))
    assert found.driven[0].control == pytest.approx(4.0)
    assert any("4 times the logged command" in note for note in found.notes)
    assert element(found.text, ".//general").get("ctrlrange") == "-8 8"


def test_an_elastic_gear_puts_the_motor_on_a_joint_of_its_own():
    found = patched(OWN, robots.setting("joint_elasticity"))
    model = mujoco.MjModel.from_xml_string(found.text)
    assert (found.driven[0].joint, found.driven[0].link) == ("j1_motor", "j1")
    assert model.actuator_trnid[0, 0] == model.joint("j1_motor").id
    assert model.joint("j1_motor").damping[0] == pytest.approx(robots.MOTOR["motor_damping"])
    assert model.dof_armature[model.joint("j1_motor").dofadr[0]] == pytest.approx(0.008)
    assert model.tendon_stiffness[model.tendon("j1_gear").id] == pytest.approx(1000.0)
    with pytest.raises(ClieError, match="already"):
        patched(found.text, robots.setting("joint_elasticity"))


def test_a_payload_is_a_body_at_the_end():
    found = patched(OWN, robots.setting("payload", mass=0.3, length=0.2))
    assert element(found.text, ".//body[@name='payload']/inertial").get("mass") == "0.3"
    assert any("payload of 0.3 kg" in note for note in found.notes)


def test_a_joint_without_an_actuator_gets_one():
    found = patched(OWN.replace('<motor name="m1" joint="j1"/>', ""), robots.setting("coulomb"))
    assert found.driven[0].actuator == "j1_drive"
    assert mujoco.MjModel.from_xml_string(found.text).nu == 1


@pytest.mark.parametrize("actuator, reason", [
    ('<position joint="j1" kp="5"/>', "its control is a set-point"),
    ('<dcmotor joint="j1" motorconst="0.1" resistance="1"/>', "before and after MuJoCo 3.12")])
def test_an_actuator_that_takes_no_torque_is_refused_where_the_drive_is_corrected(
        actuator, reason):
    text = OWN.replace('<motor name="m1" joint="j1"/>', actuator)
    with pytest.raises(ClieError, match=reason):
        patched(text, robots.setting("actuator_lag"))
    kept = patched(text, robots.setting("coulomb"))
    assert actuator in kept.text and kept.needs_module and "corrected_joints.py" in kept.notes[-1]


def test_a_control_law_within_the_model_is_refused():
    text = OWN.replace("<motor ", '<general biastype="affine" biasprm="0 -5 -1" ')
    with pytest.raises(ClieError, match="control law within the model"):
        patched(text)


def test_a_constant_bias_gives_way_to_the_identified_offset():
    text = OWN.replace("<motor ", '<general biastype="affine" biasprm="0.3 0 0" ')
    bias = element(patched(text).text, ".//general").get("biasprm")
    assert [float(one) for one in bias.split()] == pytest.approx([-robots.LOAD, 0.0, 0.0])
    in_block = patched(text, robots.setting("backlash"))
    assert element(in_block.text, ".//general").get("biasprm") == "0 0 0"
    assert element(in_block.text, ".//worldbody//joint").get("damping") == "0"


def test_another_robot_is_refused_with_the_nearest_name():
    with pytest.raises(ClieError, match=r"no joint 'j9'.*did you mean 'j1'.*--joint"):
        patched(OWN, name="j9")
    found = corrected_model(robots.correction(name="axis"), OWN, "own.xml", renamed={"axis": "j1"})
    assert found.driven[0].link == "j1"


def test_a_joint_that_moves_otherwise_is_refused():
    for kind in ("slide", "ball"):
        with pytest.raises(ClieError, match=f"'j1' is of type '{kind}', and j1 .* a hinge in rad"):
            patched(OWN.replace('axis="0 1 0"', f'axis="0 1 0" type="{kind}"'))
    by_class = OWN.replace('<joint   damping="9"/>', '<joint damping="9" type="slide"/>')
    with pytest.raises(ClieError, match="is of type 'slide'"):
        patched(by_class)


def test_an_included_file_is_named(tmp_path):
    (tmp_path / "arm.xml").write_text("<mujoco><worldbody/></mujoco>")
    text = '<mujoco><include file="arm.xml"/><worldbody/></mujoco>'
    with pytest.raises(ClieError, match="without arm.xml, which it includes"):
        corrected_model(robots.correction(), text, "own.xml", tmp_path)


def test_an_older_mujoco_is_refused_for_words_that_it_lacks(monkeypatch):
    monkeypatch.setattr(mujoco, "__version__", "3.4.0")
    assert patched(OWN, robots.setting("coulomb")).text
    with pytest.raises(ClieError, match=r"MuJoCo 3.4.0 has no word for time_delay.*3.5"):
        patched(OWN, robots.setting("time_delay"))


def test_what_is_no_model_is_refused():
    with pytest.raises(RecordError, match="no well-formed XML"):
        patched("<mujoco>")
    with pytest.raises(ClieError, match="begins with <robot>"):
        patched("<robot/>")
    with pytest.raises(ClieError, match="an SDF, which --to gazebo patches"):
        patched("<sdf/>")


def test_a_step_that_is_no_fraction_of_the_period_is_said():
    found = patched(OWN.replace("0.0005", "0.0003"))
    assert any("no whole number" in note for note in found.notes)


def test_an_effect_of_the_law_is_left_out_with_the_reason():
    notes = export_mujoco(Correction((robots.joint(),), robots.PERIOD, (),
                                     (robots.setting("setpoint_delay"),))).notes
    assert any("Your controller or your log needs it" in note for note in notes)


@pytest.mark.parametrize("integrator, kind", [("RK4", "filter"), ("Euler", "filterexact")])
def test_a_lag_is_written_for_the_integrator_into_a_motor_too(integrator, kind):
    text = OWN.replace('gravity="0 0 0"', f'gravity="0 0 0" integrator="{integrator}"')
    found = patched(text, robots.setting("actuator_lag"), offset=0.0)
    assert element(found.text, ".//general").get("dyntype") == kind


def test_a_delay_shorter_than_the_step_is_said():
    notes = patched(OWN, robots.setting("time_delay", delay=2e-4)).notes
    assert any("delay of 0.0002 s at j1 is shorter" in note for note in notes)
    assert not patched(OWN, robots.setting("time_delay", delay=1e-3)).notes


def test_what_differs_from_a_simulator_of_the_users_is_not_patched():
    compared = Correction((robots.joint(),), robots.PERIOD, (), basis="simulator")
    with pytest.raises(ClieError, match="compared with the logs of your own simulator"):
        export_mujoco(compared)


def test_what_an_uneven_gear_costs_its_motor_is_said_to_be_left_out():
    (note,) = export_mujoco(robots.correction(robots.setting("kinematic_error"))).notes
    assert "kinematic_error" in note and "does not feel" in note
