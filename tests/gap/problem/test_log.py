"""One experiment as the diagnosis reads it."""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.problem.log import as_log
from clie_blocks.analysis.gap.problem.problem import Problem


def test_a_stated_start_counts_unless_the_log_begins_elsewhere(case):
    made = case("none")
    record = made.records[0]
    log = as_log(record, made.robot, 0)
    assert log.at_rest and np.array_equal(log.start, made.robot.experiments["log-1"].start)
    elsewhere = as_log(record.replace(q=record.q + np.ptp(record.q)), made.robot, 0)
    assert not elsewhere.at_rest and np.array_equal(elsewhere.start, elsewhere.q[0])
    unstated = dataclasses.replace(made.robot, experiments={})
    assert not as_log(record, unstated, 0).at_rest


def test_a_command_that_was_not_logged_is_not_known(case):
    made = case("none")
    assert np.isnan(as_log(made.records[0].replace(u=None), made.robot, 0).u).all()


def test_the_voltage_of_a_servo_counts_over_its_nominal_one(case):
    made = case("none")
    record = made.records[0]
    volts = np.linspace(8.4, 6.0, len(record))
    volts[3:6] = np.nan  # not every row has one
    logged = record.replace(extra={"supply": volts})
    assert as_log(logged, made.robot, 0).supply is None  # its drives control their current
    controller = dataclasses.replace(made.robot.controller, supply=8.0)
    log = as_log(logged, dataclasses.replace(made.robot, controller=controller), 0)
    np.testing.assert_allclose(log.supply[:, -1], np.linspace(8.4, 6.0, len(record)) / 8.0,
                               rtol=1e-4)
    np.testing.assert_array_equal(log.supplied_u, log.u * log.supply)


def test_a_voltage_that_one_log_lacks_counts_in_none(case):
    made = case("none")
    robot = dataclasses.replace(made.robot, controller=dataclasses.replace(
        made.robot.controller, supply=8.0))
    volts = [record.replace(extra={"supply": np.full(len(record), 7.0)})
             for record in made.records]
    assert all(log.supply is not None for log in Problem.from_logs(robot, volts).logs)
    some = Problem.from_logs(robot, [*volts[:-1], made.records[-1]])
    assert all(log.supply is None for log in some.logs)
