"""Every effect that MuJoCo holds moves the joint there as the corrected model does here."""

import pytest

from clie_blocks.analysis.export import truth_table
from clie_blocks.analysis.export.mujoco_split import split
from clie_blocks.effects import LIBRARY
from tests.export import robots

pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
NOISE = 1e-4  # rad, of an encoder of 12 bits at such a joint
ALLOWED = 1.2 * NOISE
IN_ELEMENTS = [name for name in LIBRARY if truth_table.support(name, "mujoco").kind in (
    truth_table.NATIVE, truth_table.EXTRA_BODY)
    and name not in (*truth_table.IN_THE_MODEL, "payload")]
BESIDE = ("stribeck", "presliding", "maxwell_slip", "backlash", "dead_zone", "tick_jitter",
          "torque_ripple", "encoder_eccentricity")


def test_the_joint_model_alone_moves_as_here():
    left, _ = robots.difference()
    assert left < ALLOWED / 2


@pytest.mark.parametrize("name", IN_ELEMENTS)
def test_an_effect_in_elements_of_mujoco_moves_as_here(name):
    left, moved = robots.difference(robots.setting(name))
    assert left < ALLOWED and left < moved / (1.5 if name == "joint_elasticity" else 10)


def test_the_list_of_native_effects_is_not_empty():
    assert {"coulomb", "spring", "actuator_lag", "time_delay", "joint_elasticity"} <= set(
        IN_ELEMENTS)


@pytest.mark.slow
@pytest.mark.parametrize("name", BESIDE)
def test_an_effect_in_the_module_beside_the_model_moves_as_here(name):
    left, moved = robots.difference(robots.setting(name), seconds=0.7)
    assert left < ALLOWED and left < moved / 2


def test_effects_of_both_kinds_act_together():
    left, moved = robots.difference(robots.setting("coulomb"), robots.setting("torque_ripple"),
                                    robots.setting("actuator_lag"), seconds=0.5)
    assert left < ALLOWED and left < moved / 10


def test_a_limit_behind_a_lag_runs_in_the_module_since_mujoco_limits_before_it():
    lag, limit = robots.setting("actuator_lag"), robots.setting("actuator_saturation")
    before, behind = (split(robots.correction(*order), 0) for order in (
        (limit, lag), (lag, limit)))
    assert before.native == (limit, lag) and not before.block
    assert behind.block == (lag, limit) and not behind.native


def test_friction_that_is_not_native_takes_all_dry_friction_of_the_joint_along():
    found = split(robots.correction(robots.setting("coulomb"), robots.setting("stribeck")), 0)
    assert not found.native and len(found.block) == 2
