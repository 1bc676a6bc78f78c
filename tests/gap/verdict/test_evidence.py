"""Evidence: it can be stored and read, and a cause that shrank to a simpler one is not counted."""

import dataclasses
import json

import numpy as np
import pytest
from factories import make_fit, make_member, make_problem, make_row, make_table

from clie_blocks.analysis.gap.causes import drive, friction, timed
from clie_blocks.analysis.gap.fitting.nesting import repeats_simulator, simpler_names
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method.calibration import Calibration
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.verdict.confounders import POSE
from clie_blocks.analysis.gap.verdict.evidence import (
    evidence,
    from_json,
    is_contradicted,
    parameter_count,
    to_json,
)
from clie_blocks.analysis.gap.verdict.posterior import posterior


def fitted(slope, spread=1.0):
    """Fit of load-dependent friction at the second of two joints."""
    problem = make_problem(n=2)
    cause = make_member(friction.LOAD_DEPENDENT_FRICTION[0], problem, [1], share=slope,
                        sizes={"share": 0.03})
    fit = make_fit(problem, cause)
    return dataclasses.replace(fit, spread=np.full(len(fit.spread), spread))


def asymmetric(backward, *inside):
    """Fit of asymmetric friction to a robot whose nominal model holds some causes."""
    held = tuple(make_member(cause, make_problem()) for cause in inside)
    problem = make_problem(inside=held)
    return make_fit(problem, make_member(friction.ASYMMETRIC_COULOMB, problem,
                                         backward=backward))


def test_with_a_simulator_with_friction_more_of_it_is_another_value_and_not_a_cause():
    assert repeats_simulator(asymmetric(1.02, friction.COULOMB), METHOD)
    assert not repeats_simulator(asymmetric(1.2, friction.COULOMB), METHOD)
    assert not repeats_simulator(asymmetric(1.0), METHOD)
    assert not repeats_simulator(asymmetric(1.0, friction.QUADRATIC_DRAG), METHOD)


@pytest.mark.parametrize("slope, names", [(0.0, ("coulomb",)), (0.01, None)])
def test_load_dependent_friction_without_a_slope_is_coulomb_friction(slope, names):
    assert simpler_names(fitted(slope), METHOD) == names


def test_a_small_parameter_counts_where_the_logs_determine_it():
    assert simpler_names(fitted(5e-4, spread=1e-4), METHOD) == ("coulomb",)
    assert simpler_names(fitted(5e-4, spread=1e-5), METHOD) is None


def test_a_table_survives_a_file():
    table = make_table(3.0, make_row("coulomb", 0.1, 1.5, 2, POSE), prior_violation=0.5,
                       prior_violations=1, free=(2.0, 1.0))
    again = from_json(json.loads(json.dumps(to_json(table))))
    assert to_json(again) == to_json(table)
    assert again.rows[0].names == ("coulomb",)
    short = from_json({**to_json(table), "rows": [[["coulomb"], 0.1, 1]]})
    assert short.rows[0].prior_violations == 0


def known_within(cause, *spreads):
    """Fit of a cause at one joint, with standard deviations of its parameters in their sizes."""
    problem = make_problem()
    return make_fit(problem, make_member(cause, problem), spread=spreads or 0.0)


@pytest.mark.parametrize("cause, count", [
    (friction.COULOMB, 1), (timed.STEP_FAULT[0], 3), (timed.PERIODIC_DISTURBANCE, 5),
    (drive.TORQUE_RIPPLE, 3)])
def test_what_was_chosen_in_each_log_counts_there(cause, count):
    assert parameter_count(known_within(cause)) == count


def test_a_parameter_that_the_logs_do_not_determine_costs_nothing():
    fit = known_within(friction.STRIBECK, 0.0, 0.0, 30.0)
    assert parameter_count(fit) == pytest.approx(2, abs=0.01)


def test_a_fall_at_the_start_is_no_health_where_the_start_is_stated(healthy):
    residuals, nominal = fit_nominal(healthy, METHOD)
    assert not is_contradicted(nominal, residuals)
    fallen = healthy.with_logs(lambda log: falling(log, residuals, nominal))
    residuals, nominal = fit_nominal(fallen, METHOD)
    assert nominal.excess < 1.0
    assert is_contradicted(nominal, residuals)
    ranking = posterior(evidence(nominal, [], residuals), Calibration())
    assert ranking[0].names == ("unknown",)
    unstated = dataclasses.replace(residuals, problem=fallen.with_logs(
        lambda log: dataclasses.replace(log, at_rest=False)))
    assert not is_contradicted(nominal, unstated)
    ranking = posterior(evidence(nominal, [], unstated), Calibration())
    assert ranking[0].names == ("none",)


def falling(log, residuals, nominal):
    """Log whose joints all start 10 mrad from where they are stated to."""
    from scipy.signal import lfilter

    problem, values = residuals.problem, nominal.hypothesis.values
    fall = [lfilter(*problem.law.sensor_sensitivity(k, values["inertia"][k],
                                                    values["damping"][k]),
                    np.full(len(log), 0.01)) for k in range(problem.n)]
    return dataclasses.replace(log, q=log.q + np.stack(fall, axis=1))
