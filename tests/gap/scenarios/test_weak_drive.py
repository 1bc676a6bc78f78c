"""A drive that gives a small part of what its loop asks for."""

import pytest
from one_joint import Physics, logs, robot

from clie_blocks import gap

LIMIT = 1.5  # N m, of commands of up to 22 N m


@pytest.mark.slow
def test_a_limit_of_torque_far_below_the_commands_has_its_name():
    found = gap.diagnose(gap.Problem.from_logs(robot(), logs(Physics(limit=LIMIT))))
    assert found.ranking[0].names == ("actuator_saturation",)
    row = found.to_dict()["effects"][0]
    assert row["parameters"]["limit"]["value"] == pytest.approx([LIMIT], rel=0.02)
