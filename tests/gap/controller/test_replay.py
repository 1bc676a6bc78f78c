"""Whether the stated law ran: replayed to its rounding, and mended where it did not."""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.controller.check import check_controller

EVERY = slice(None)


def foreign(problem, law):
    """The same motions, with commands of another law."""
    logs = [dataclasses.replace(log, u=law.replay(log.q, log.q_d, log.pe))
            for log in problem.logs]
    return dataclasses.replace(problem, fit=tuple(logs[:2]), held_out=tuple(logs[2:]))


def test_the_stated_law_is_replayed_to_its_rounding(healthy):
    check = check_controller(healthy)
    assert not check.other_filter and not check.coarse
    assert np.all(check.replay_error < 0.35 * healthy.law.resolution)


def test_a_filter_with_other_corners_is_found(healthy):
    ran = healthy.law.with_filter(EVERY, "tustin", (120.0, 180.0))
    found = check_controller(foreign(healthy, ran))
    assert found.other_filter == tuple(range(healthy.n))
    assert np.allclose(found.corners, [[120.0]] * 1 + [[180.0]], rtol=0.02)


def test_a_filter_of_another_discretisation_is_no_fault(healthy):
    ran = healthy.law.with_filter(EVERY, "matched", healthy.law.corners)
    found = check_controller(foreign(healthy, ran))
    assert not found.other_filter and found.law.variant == "matched"
    assert "'matched', not 'tustin'" in found.decisions[0]


def test_a_command_at_its_limit_is_still_the_stated_law(healthy):
    limit = 0.3 * np.max([np.abs(log.u).max(axis=0) for log in healthy.logs], axis=0)
    limited = dataclasses.replace(healthy.law, saturation=limit)
    problem = dataclasses.replace(foreign(healthy, limited), law=limited)
    found = check_controller(problem)
    assert not found.other_filter and not found.replay_error.any()


def cut(problem, first=3000):
    """Logs that begin in the middle of a motion."""
    def later(logs):
        return tuple(dataclasses.replace(log, at_rest=False, start=log.q[first], **{
            name: getattr(log, name)[first:] for name in ("q", "u", "q_d", "pe", "dither")})
            for log in logs)
    return dataclasses.replace(problem, fit=later(problem.fit), held_out=later(problem.held_out))


def test_a_log_that_was_cut_is_replayed_from_where_its_filter_is_known(healthy):
    check = check_controller(cut(healthy))
    assert np.all(check.replay_error < 0.35 * healthy.law.resolution)
    at_rest = tuple(dataclasses.replace(log, at_rest=True) for log in cut(healthy).fit)
    believed = dataclasses.replace(cut(healthy), fit=at_rest)
    assert np.any(check_controller(believed).replay_error > 3 * check.replay_error)


def test_gains_and_corners_that_ran_are_found_in_logs_that_were_cut(healthy):
    gains = dataclasses.replace(healthy.law, kd=0.8 * healthy.law.kd)
    found = check_controller(cut(foreign(healthy, gains)))
    assert found.other_gains == tuple(range(healthy.n))
    np.testing.assert_allclose(found.law.kd, gains.kd, rtol=1e-3)
    corners = healthy.law.with_filter(EVERY, "tustin", (120.0, 180.0))
    found = check_controller(cut(foreign(healthy, corners)))
    assert found.other_filter == tuple(range(healthy.n))
    assert np.allclose(found.corners, [[120.0]] * 1 + [[180.0]], rtol=0.02)
