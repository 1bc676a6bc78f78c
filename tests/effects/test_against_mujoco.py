"""The catalogue against an independent engine, each as close as its methods allow."""

import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.catalogue.against_mujoco import ROBOTS, compare  # noqa: E402
from clie_blocks.signals import DiagramError  # noqa: E402

# Largest difference of q [rad] over 3 s; measured figures are in docs/effects_mujoco.md.
AGREEMENT = {
    "viscous": 1e-11, "inertia": 1e-11, "joint_elasticity": 1e-11, "actuator_saturation": 1e-11,
    "torque_gain_error": 1e-11, "actuator_lag": 1e-11, "coupling": 1e-9, "gravity": 1e-7,
    "payload": 1e-7, "time_delay": 2e-6, "backlash": 5e-6, "coulomb": 2e-4}


@pytest.mark.parametrize("name", ROBOTS)
def test_both_engines_agree(name):
    found = compare(name)
    assert found.difference < AGREEMENT[name]
    assert found.size > 1e3 * min(found.difference, 2e-6) and found.size > 2e-3


def test_an_effect_without_a_robot_is_told():
    with pytest.raises(DiagramError, match="no robot to compare 'back_lash'.*'backlash'"):
        compare("back_lash")
