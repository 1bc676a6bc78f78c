"""A problem and its logs: the law of a robot file, and changes of every log."""

import dataclasses

import numpy as np
import pytest
from factories import make_problem

from clie_blocks.analysis.gap.problem.law import StatedLaw
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.joints import decoupled_joints


def test_every_log_is_changed_and_stays_in_its_part():
    problem = make_problem(held_out=1)
    shifted = problem.with_logs(lambda log: dataclasses.replace(log, q=log.q + 1.0))
    assert [log.name for log in shifted.logs] == [log.name for log in problem.logs]
    assert len(shifted.fit) == len(problem.fit) and len(shifted.held_out) == 1
    for before, after in zip(problem.logs, shifted.logs):
        np.testing.assert_array_equal(after.q, before.q + 1.0)


def test_a_robot_file_states_a_law_and_a_loop_does_not(case):
    made = case("none")
    assert isinstance(Problem.from_logs(made.robot, made.records).stated_law, StatedLaw)
    record = made.records[0]
    plant = decoupled_joints([1.0], [20.0], [0.0], name="plant")
    loop = joint_loop(plant, [8.0], [0.6])
    one_joint = record.replace(q=record.q[:, :1], u=record.u[:, :1], qd=record.qd[:, :1],
                               pe=record.pe[:, :1], dq=None, tau=None, joints=(), units={},
                               robot=None)
    with pytest.raises(TypeError, match="states no law"):
        Problem.from_loop(loop, one_joint).stated_law  # noqa: B018
