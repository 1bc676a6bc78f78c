"""Which of two readings of a command is taken, and how much the choice may mislead."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap.command_reading import _has_unknown_part, _probability
from clie_blocks.analysis.gap.controller.check import check_controller
from clie_blocks.analysis.gap.method import METHOD


@pytest.mark.parametrize("best, other, apart, least, most", [
    (1.0, 500.0, 500.0, 0.999, 1.0),  # one leaves next to nothing: no doubt
    (480.0, 500.0, 500.0, 0.5, 0.75),  # both leave the same, and are far apart: a toss
    (480.0, 500.0, 5.0, 0.999, 1.0),  # a toss, but it does not matter
    (480.0, 500.0, float("inf"), 0.5, 0.75)])  # one of them diverges
def test_a_choice_is_doubted_where_it_is_open_and_matters(best, other, apart, least, most):
    assert least <= _probability(best, other, apart, METHOD.calibration) <= most


@pytest.mark.slow
def test_a_law_is_open_where_its_excitation_was_logged_and_something_is_left(healthy):
    def with_extra(log, pe):
        extra = 0.2 * np.abs(np.sin(np.arange(len(log)) / 300.0))[:, None]
        return dataclasses.replace(
            log, pe=pe, u=healthy.law.replay(log.q, log.q_d, pe) + extra)
    logged = healthy.with_logs(lambda log: with_extra(log, 0.1 * np.sin(log.q)))
    lost = healthy.with_logs(lambda log: with_extra(log, np.zeros_like(log.q)))
    open_law, lost_part = check_controller(logged), check_controller(lost)
    assert open_law.unexplained == lost_part.unexplained == tuple(range(healthy.n))
    assert _has_unknown_part(open_law, logged)
    assert not _has_unknown_part(lost_part, lost)
    assert not _has_unknown_part(dataclasses.replace(open_law, coarse=open_law.unexplained),
                                 logged)
