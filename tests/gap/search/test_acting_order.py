"""The order in which several causes of one drive act is that of the machine, not of the search."""

import dataclasses
import types

import pytest

from clie_blocks.analysis.blind.population import catalogue
from clie_blocks.analysis.blind.population.files import write_trial
from clie_blocks.analysis.blind.population.maker import Population, make_trial
from clie_blocks.analysis.blind.population.standard import draw_trial
from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.search.acting_order import _exchanged
from clie_blocks.analysis.records import read_trial

RIPPLE, LAG, ECCENTRICITY, RUBBING, DELAY, JITTER = (
    next(one for one in CAUSES if one.key == name) for name in (
        "commutation_ripple", "actuator_lag", "encoder_eccentricity", "coulomb", "time_delay",
        "tick_jitter"))
NUMBER = dataclasses.replace(LAG, name="parametric", variant="motor.torque_gain")


def members(*causes_at):
    return [types.SimpleNamespace(cause=cause, joints=joints) for cause, joints in causes_at]


@pytest.mark.parametrize("some, orders", [
    ([(LAG, (0,)), (RUBBING, (0,)), (RIPPLE, (0,))], [[RIPPLE, RUBBING, LAG]]),
    ([(LAG, (0,)), (RIPPLE, (1,))], []),  # each at a joint of its own
    ([(LAG, (0,)), (ECCENTRICITY, (0,))], []),  # a drive and a sensor are apart anyway
    ([(DELAY, (0,)), (JITTER, (0,))], []),  # both only shift the command
    ([(NUMBER, (0,)), (DELAY, (0,))], [[DELAY, NUMBER]]),  # a number of the file is no effect
    ([(LAG, (0, 1)), (RIPPLE, (0,)), (LAG, (1,))], [[RIPPLE, LAG, LAG]])])
def test_what_follows_another_cause_of_the_same_signal_is_exchanged_with_it(some, orders):
    assert [[one.cause for one in order] for order in _exchanged(members(*some))] == orders


@pytest.mark.slow
@pytest.mark.parametrize("index", [0, 4])
def test_a_ripple_in_front_of_a_lag_is_found_there(tmp_path, index):
    """In that engine the lag is behind everything else, and the larger one is found first."""
    pytest.importorskip("mujoco")

    def draw(rng, seed, number):
        return draw_trial(rng, number, "pair", ("commutation_ripple", "actuator_lag"),
                          ("mild", "strong"), robot_kind="pendulum",
                          vocabulary=catalogue.CATALOGUE)

    write_trial(make_trial(Population(draw, (8,)), 5252, index), tmp_path)
    found = diagnose(Problem.from_logs(*read_trial(tmp_path)), seconds=3600.0,
                     effects=("commutation_ripple", "actuator_lag"))
    best = min(found.evidence.rows, key=lambda row: row.excess).fit
    assert [one.cause for one in best.hypothesis.members] == [RIPPLE, LAG]
    assert best.excess < 1e-4 * found.evidence.nominal_excess + 0.5
