"""Whether the stated law ran: replayed to its rounding, and corrected where it did not."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.controller.check import check_controller

ALL_JOINTS = slice(None)
SIGNALS = ("q", "u", "q_d", "pe", "dither")


def commanded_by(problem, law):
    """The same motions, with commands of another law."""
    return problem.with_logs(lambda log: dataclasses.replace(
        log, u=law.replay(log.q, log.q_d, log.pe)))


def test_the_stated_law_is_replayed_to_its_rounding(healthy):
    check = check_controller(healthy)
    assert not check.other_filter and not check.coarse
    assert np.all(check.replay_error < 0.35 * healthy.law.resolution)


def test_a_filter_with_other_corners_is_identified(healthy):
    law = healthy.law.with_filter(ALL_JOINTS, "tustin", (120.0, 180.0))
    check = check_controller(commanded_by(healthy, law))
    assert check.other_filter == tuple(range(healthy.n))
    assert np.allclose(check.corners, [[120.0], [180.0]], rtol=0.02)


def test_a_filter_of_another_discretisation_is_no_fault(healthy):
    law = healthy.law.with_filter(ALL_JOINTS, "matched", healthy.law.corners)
    check = check_controller(commanded_by(healthy, law))
    assert not check.other_filter and check.law.variant == "matched"
    assert "'matched', not 'tustin'" in check.decisions[0]


def test_a_command_at_its_limit_is_still_the_stated_law(healthy):
    limit = 0.3 * np.max([np.abs(log.u).max(axis=0) for log in healthy.logs], axis=0)
    law = dataclasses.replace(healthy.law, saturation=limit)
    check = check_controller(dataclasses.replace(commanded_by(healthy, law), law=law))
    assert not check.other_filter and not check.replay_error.any()


def bridged(problem, first=4000, lost=50):
    """The problem with 50 ms of each log lost, and the last position held in their place."""
    def without(log):
        measured = ~np.isin(np.arange(len(log)), np.arange(first, first + lost))
        held = np.where(measured[:, None], log.q, log.q[first - 1])
        return dataclasses.replace(log, measured=measured, q=held)

    return problem.with_logs(without)


def test_a_slower_filter_than_stated_is_identified_in_logs_with_a_gap(healthy):
    law = healthy.law.with_filter(ALL_JOINTS, "tustin", (80.0, 120.0))
    check = check_controller(bridged(commanded_by(healthy, law)))
    assert check.other_filter == tuple(range(healthy.n))
    assert np.allclose(check.corners, [[80.0], [120.0]], rtol=0.02)


def cut(problem, first=3000):
    """The problem with logs that begin in the middle of a motion."""
    return problem.with_logs(lambda log: dataclasses.replace(
        log, at_rest=False, start=log.q[first],
        **{name: getattr(log, name)[first:] for name in SIGNALS}))


@pytest.mark.slow
def test_a_log_that_was_cut_is_replayed_from_where_its_filter_is_known(healthy):
    check = check_controller(cut(healthy))
    assert np.all(check.replay_error < 0.35 * healthy.law.resolution)
    at_rest = cut(healthy).with_logs(lambda log: dataclasses.replace(log, at_rest=True))
    assert check.as_stated and not check_controller(at_rest).as_stated


@pytest.mark.slow
def test_gains_and_corners_that_ran_are_identified_in_logs_that_were_cut(healthy):
    law = dataclasses.replace(healthy.law, kd=0.8 * healthy.law.kd)
    check = check_controller(cut(commanded_by(healthy, law)))
    assert check.other_gains == tuple(range(healthy.n))
    np.testing.assert_allclose(check.law.kd, law.kd, rtol=1e-3)
    law = healthy.law.with_filter(ALL_JOINTS, "tustin", (120.0, 180.0))
    check = check_controller(cut(commanded_by(healthy, law)))
    assert check.other_filter == tuple(range(healthy.n))
    assert np.allclose(check.corners, [[120.0], [180.0]], rtol=0.02)
