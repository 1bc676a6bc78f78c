"""What acts between the joints of an arm: its links, and effects that read all joints."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.export.c_target import export_c
from clie_blocks.analysis.export.correction import Correction
from clie_blocks.analysis.export.mujoco_target import export_mujoco
from clie_blocks.analysis.gap.causes.friction import OF_LINKS
from clie_blocks.robot_loop.links import planar_links
from tests.export import robots

pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
ALLOWED = 1.2e-4  # rad, 1.2 times the noise of an encoder of 12 bits at such a joint
LENGTH, MASS, COM = np.array([0.3, 0.3]), np.array([0.1, 0.15]), np.array([0.1, 0.15])  # m, kg, m
OWN, ROTOR = np.array([0.002, 0.002]), 0.008  # kg m^2
ARM = """<mujoco>
  <compiler angle="radian"/>
  <option timestep="{step}" integrator="RK4" gravity="0 0 0"/>
  <worldbody>
    <body>
      <inertial pos="0.1 0 0" mass="0.1" diaginertia="0.002 0.002 0.002"/>
      <joint name="j1" axis="0 -1 0"/>
      <body pos="0.3 0 0">
        <inertial pos="0.15 0 0" mass="0.15" diaginertia="0.002 0.002 0.002"/>
        <joint name="j2" axis="0 -1 0"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor joint="j1"/>
    <motor joint="j2"/>
  </actuator>
</mujoco>
"""


def both(period, seconds=0.8):
    """Set-points of two joints that move against each other (N, 2) [rad]."""
    one = robots.set_points(seconds, period)
    return np.stack([one, -0.8 * one], axis=1)


@pytest.mark.parametrize("step, period", [(1.25e-4, 1e-3), (2e-3, 2e-3)])
def test_the_bodies_of_a_model_couple_its_joints_as_stated_links_do(tmp_path, step, period):
    """At the step of a stub, and at that of MuJoCo where a file states none."""
    own = tmp_path / "arm.xml"
    own.write_text(ARM.format(step=step))
    turning = OWN[1] + MASS[1] * COM[1] ** 2
    outer = MASS[1] * (LENGTH[0] ** 2 + 2 * LENGTH[0] * COM[1])
    whole = np.array([OWN[0] + MASS[0] * COM[0] ** 2 + outer + turning, turning])
    found = export_mujoco(Correction(tuple(
        robots.joint(name=f"j{k + 1}", links_known=True, beside_links=ROTOR,
                     inertia=whole[k] + ROTOR) for k in range(2)), period, ()), own)
    links = planar_links(LENGTH, MASS, COM, OWN, g=9.81, bearing_damping=np.zeros(2),
                         has_gravity=False, has_coupling=True)
    q_d = both(period)
    expected = robots.reference((), q_d, inertia=whole + ROTOR, period=period,
                                links=dataclasses.replace(links, diagonal=whole))
    alone = robots.reference((), q_d, inertia=whole + ROTOR, period=period)
    left = robots.rms(robots.in_mujoco(found, q_d, period) - expected)
    assert left < ALLOWED and left < robots.rms(expected - alone) / 100


def test_friction_that_the_weight_of_the_links_makes_is_that_of_the_bodies(tmp_path):
    """The diagnosis may take the links' weight as the load, and not the torque of the motor."""
    own = tmp_path / "arm.xml"
    own.write_text(ARM.format(step=1.25e-4).replace('gravity="0 0 0"', 'gravity="0 0 -9.81"'))
    turning = OWN[1] + MASS[1] * COM[1] ** 2
    outer = MASS[1] * (LENGTH[0] ** 2 + 2 * LENGTH[0] * COM[1])
    whole = np.array([OWN[0] + MASS[0] * COM[0] ** 2 + outer + turning, turning])
    joints = tuple(robots.joint(name=f"j{k + 1}", links_known=True, beside_links=ROTOR,
                                inertia=whole[k] + ROTOR) for k in range(2))
    links = dataclasses.replace(planar_links(
        LENGTH, MASS, COM, OWN, g=9.81, bearing_damping=np.zeros(2), has_gravity=True,
        has_coupling=True), diagonal=whole)
    friction = robots.setting("load_dependent_friction", share=[0.2, 0.2], level=[0.0, 0.0])
    of_links = dataclasses.replace(friction, effect=OF_LINKS)
    q_d = both(1e-3)
    expected, by_motor = (robots.reference((one,), q_d, inertia=whole + ROTOR, links=links)
                          for one in (of_links, friction))
    left = [robots.rms(robots.in_mujoco(export_mujoco(
        Correction(joints, 1e-3, (friction,), of_links=names), own), q_d) - motion)
        for names, motion in ((("load_dependent_friction",), expected), ((), by_motor))]
    assert max(left) < ALLOWED and max(left) < robots.rms(expected - by_motor) / 10


WHOLE_ROBOT = {
    "gravity": {"weight": [0.3, 0.2]}, "base_tilt": {"tilt": 0.3, "weight": [0.6, 0.4]},
    "fluid_drag": {"drag": [0.02, 0.01]}, "coupled_joints": {"ratio": [0.0, 0.1]},
    "supply_sag": {"sag": 0.1},
    "step_fault": {"weight": [0.3, 0.2], "offset": [0.1, 0.0], "time": 0.3}}


def two_joints(name, period):
    """A correction of two joints by one effect that reads both, and the effect."""
    effect = robots.setting(name, **WHOLE_ROBOT[name])
    return Correction((robots.joint(), robots.joint(name="j2")), period, (effect,)), effect


@pytest.mark.slow
@pytest.mark.parametrize("name", WHOLE_ROBOT)
def test_an_effect_that_reads_all_joints_moves_them_as_here(name):
    corrected, effect = two_joints(name, robots.PERIOD)
    q_d = both(robots.PERIOD, 0.5)
    found = robots.in_mujoco(export_mujoco(corrected), q_d)
    expected = robots.reference((effect,), q_d)
    moved = robots.rms(expected - robots.reference((), q_d))
    assert robots.rms(found - expected) < ALLOWED and robots.rms(found - expected) < moved / 10


@pytest.mark.parametrize("name", WHOLE_ROBOT)
def test_a_block_of_one_joint_leaves_it_out_and_says_where_it_goes(name):
    notes = export_c(two_joints(name, robots.PERIOD)[0], 1e-3).notes
    told = [note for note in notes if name in note]
    assert told and all("mujoco" in note and "does not see the others" in note for note in told)


def test_a_weight_is_not_put_beside_bodies_that_weigh(tmp_path):
    """A robot file may leave out the gravity that the model of its user has."""
    own = tmp_path / "arm.xml"
    corrected, _ = two_joints("gravity", robots.PERIOD)
    own.write_text(ARM.format(step=1e-3))
    light = export_mujoco(corrected, own)
    own.write_text(ARM.format(step=1e-3).replace("0 0 0\"/>\n  <world", "0 0 -9.81\"/>\n  <world"))
    heavy = export_mujoco(corrected, own)
    assert "corrected_joints.py" in light.files and "corrected_joints.py" not in heavy.files
    assert not any("gravity" in note for note in light.notes)
    assert any("which weigh already" in note for note in heavy.notes)
