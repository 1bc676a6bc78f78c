"""The spectrum over the pose: an order that no list of harmonics holds is found."""

import numpy as np
import pytest

from clie_blocks.analysis.gap.calibration import robots
from clie_blocks.analysis.gap.causes.drive import TORQUE_RIPPLE
from clie_blocks.analysis.gap.diagnosis import diagnose
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.search.events import torque_columns, whitened_errors
from clie_blocks.analysis.gap.search.ripple_spectrum import (
    _response_power,
    needed_torque,
    ripple_candidates,
    strongest_lines,
)
from clie_blocks.analysis.gap.verdict.confounders import POSE


@pytest.mark.parametrize("order", [23.7, pytest.param(61.3, marks=pytest.mark.slow)])
def test_an_order_between_the_harmonics_of_the_motor_is_found(order, monkeypatch):
    monkeypatch.setitem(robots.EFFECTS, "torque_ripple", lambda rng, joint: joint.update(
        ripple=2e-3 * joint["kp"], order=order))
    made, = robots.draw_cases(1, 2, ["torque_ripple"], ["single"], duration=8.0)
    residuals, nominal = fit_nominal(Problem.from_logs(made.robot, made.records), METHOD)
    errors = whitened_errors(residuals, nominal)
    (member, drop), = ripple_candidates(residuals, nominal, errors, (TORQUE_RIPPLE,), (0, 1))
    k = made.causes["torque_ripple"] - 1
    travel = np.ptp(np.concatenate([log.q[:, k] for log in residuals.problem.fit]))
    assert drop[k] > 0.5 * (nominal.chi2[:2, k].sum() - nominal.samples[:2, k].sum())
    assert member.values["order"][k] == pytest.approx(order, abs=3.0 / travel)  # half a line
    assert ripple_candidates(residuals, nominal, errors, (), (0, 1)) == []


def test_the_torque_that_an_error_needs_is_the_one_that_made_it(case):
    made = case("none", 3)
    residuals, nominal = fit_nominal(Problem.from_logs(made.robot, made.records), METHOD)
    period, count = residuals.problem.period, len(residuals.problem.fit[0])
    t = period * np.arange(count)
    for frequency in (2.0, 8.0):  # Hz; a slower one the loop holds down to what noise is
        torque = np.sin(2 * np.pi * frequency * t) * np.sin(np.pi * t / t[-1])
        error = -torque_columns(residuals, nominal, 0, 0, torque[:, None])[:, 0]
        scale = 30.0 / error.std()  # thirty times the noise
        needed = needed_torque(residuals, nominal, scale * error, 0, 0) / scale
        assert np.corrcoef(needed, torque)[0, 1] > 0.95
        assert needed.std() == pytest.approx(torque.std(), rel=0.1)


def test_the_power_between_the_orders_that_are_computed_is_that_of_each(case):
    made = case("none", 3)
    residuals, nominal = fit_nominal(Problem.from_logs(made.robot, made.records), METHOD)
    torque = np.ones(len(residuals.problem.fit[0]))

    def power(orders):
        return _response_power(residuals, nominal, 0, 0, orders, torque)

    orders = np.arange(0.0, 8000.0, 0.5)
    all_at_once = power(orders)
    for place in (4, 7, 33, 211, 1500, 7777):
        alone = power(np.array([0.0, orders[place]]))[1]
        assert all_at_once[place] == pytest.approx(alone, rel=0.02, abs=1e-4 * all_at_once.max())


@pytest.mark.parametrize("waves, said", [
    (0.5, "torque_ripple"), pytest.param(0.1, "spring", marks=pytest.mark.slow)])
def test_less_than_a_wave_is_a_ripple_only_where_no_spring_says_the_same(waves, said, monkeypatch):
    travel = 0.43  # rad, of the joint
    monkeypatch.setitem(robots.EFFECTS, "torque_ripple", lambda rng, joint: joint.update(
        ripple=2e-3 * joint["kp"], order=2 * np.pi * waves / travel))
    made, = robots.draw_cases(1, 2, ["torque_ripple"], ["single"], duration=8.0)
    k = made.causes["torque_ripple"] - 1
    places = np.concatenate([record.q[:, k] for record in made.records[:2]])
    assert np.ptp(places) == pytest.approx(travel, rel=0.05)
    found = diagnose(Problem.from_logs(made.robot, made.records),
                     effects=("torque_ripple", "spring", "coulomb"))
    ripple = next(row for row in found.evidence.rows if row.names == ("torque_ripple",))
    assert ripple.confounder == POSE
    to_the_end = fit(ripple.fit.hypothesis, found.residuals, METHOD.search.leader_steps)
    assert to_the_end.excess < 0.5 < 50.0 < found.evidence.nominal_excess
    assert found.ranking[0].names == (said,)


def test_a_line_is_found_though_the_top_of_the_spectrum_is_full_of_what_passes_for_lines():
    orders = np.linspace(1.0, 1500.0, 3000)
    score = np.where(orders > 1000.0, 5.0 + np.sin(orders / 7.0), 1e-3)
    score[898] = 1.0
    assert orders[898] in strongest_lines(orders, score, 4, 3)
    assert max(strongest_lines(orders, score, 4, 3)) > 1000.0
    assert score[898] == 1.0
