"""The reference against the position: what shows a unit or a side, and what a soft loop does."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.records.checks.reference import check_reference
from clie_blocks.analysis.records.controller_section import Controller


@pytest.fixture
def soft(clean):
    """Log of a loop that moves some share of its reference, as its law and a gear ratio say."""
    def make(share, ratio):
        motor = dataclasses.replace(clean.robot.motor, gear_ratio=np.full(3, ratio))
        wanted = clean.qd / share
        return clean.replace(
            qd=wanted, u=clean.u + clean.robot.controller.kp * (wanted - clean.qd),
            robot=dataclasses.replace(clean.robot, motor=motor))
    return make


@pytest.mark.parametrize("share, ratio", [(0.62, 1.6), (0.49, 1.8), (0.28, 4.0)])
def test_a_loop_that_follows_its_law_is_on_one_side_however_soft(soft, share, ratio):
    record = soft(share, ratio)
    assert check_reference(record, record.robot) == []


@pytest.mark.parametrize("share, ratio, found", [(0.62, 1.6, 0), (0.49, 1.8, 0), (0.28, 4.0, 3)])
def test_without_a_law_only_a_large_ratio_shows_a_side(soft, share, ratio, found):
    record = soft(share, ratio)
    robot = dataclasses.replace(record.robot, controller=Controller())
    checks = [finding.check for finding in check_reference(record, robot)]
    assert checks == ["reference.side"] * found
