"""The logs as the diagnosis reads them."""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.problem.problem import as_log


def test_a_stated_start_is_believed_unless_the_log_begins_elsewhere(case):
    made = case("none")
    record = made.records[0]
    stated = made.robot.experiments["log-1"].start
    log = as_log(record, made.robot, 0)
    assert log.at_rest and np.array_equal(log.start, stated)
    other = as_log(record.replace(q=record.q + np.ptp(record.q)), made.robot, 0)
    assert not other.at_rest and np.array_equal(other.start, other.q[0])
    silent = dataclasses.replace(made.robot, experiments={})
    assert not as_log(record, silent, 0).at_rest
