"""Evidence: it can be kept and read, and a cause that shrank to a simpler one is not counted."""

import dataclasses
import json
from types import SimpleNamespace

import numpy as np
import pytest

from clie_blocks.analysis.gap.causes import drive, friction, timed
from clie_blocks.analysis.gap.fitting.hypothesis import FreeParameter, Member
from clie_blocks.analysis.gap.fitting.nesting import repeats_simulator, simpler_names
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method.calibration import Calibration
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.verdict.confounders import SOFT_STOP
from clie_blocks.analysis.gap.verdict.evidence import (
    Row,
    Table,
    evidence,
    from_json,
    is_contradicted,
    parameter_count,
    to_json,
)
from clie_blocks.analysis.gap.verdict.posterior import posterior


def fitted(slope, doubt=1.0):
    cause = friction.LOAD_DEPENDENT_FRICTION[0]
    sizes = {"level": np.array([1.0, 1.0]), "slope": np.array([0.03, 0.03])}
    member = Member(cause, (1,), sizes, sizes)
    values = {"load_dependent_friction.level": np.array([0.0, 1.0]),
              "load_dependent_friction.slope": np.array([0.0, slope])}
    open_ = tuple(FreeParameter(f"load_dependent_friction.{name}", 1, None, 0.03, 0.0, 1.0)
                  for name in sizes)
    return SimpleNamespace(spread=np.array([doubt, doubt]), hypothesis=SimpleNamespace(
        members=(member,), values=values, open=open_))


def asymmetric(backward, *inside):
    sizes = {"forward": np.array([1.0]), "backward": np.array([1.0])}
    member = Member(friction.ASYMMETRIC_COULOMB, (0,), sizes, sizes)
    values = {"asymmetric_coulomb.forward": np.array([1.0]),
              "asymmetric_coulomb.backward": np.array([backward])}
    held = tuple(SimpleNamespace(cause=cause) for cause in inside)
    return SimpleNamespace(hypothesis=SimpleNamespace(
        members=(member,), values=values, problem=SimpleNamespace(inside=held)))


def test_beside_a_simulator_with_friction_more_of_it_is_another_number_and_not_a_cause():
    assert repeats_simulator(asymmetric(1.02, friction.COULOMB))
    assert not repeats_simulator(asymmetric(1.2, friction.COULOMB))
    assert not repeats_simulator(asymmetric(1.0)) and not repeats_simulator(asymmetric(1.0, friction.QUADRATIC_DRAG))


@pytest.mark.parametrize("slope, names", [(0.0, ("coulomb",)), (0.01, None)])
def test_load_dependent_friction_without_a_slope_is_coulomb_friction(slope, names):
    assert simpler_names(fitted(slope)) == names


def test_a_small_number_counts_where_the_logs_tell_it_beyond_doubt():
    assert simpler_names(fitted(5e-4, doubt=1e-4)) == ("coulomb",)
    assert simpler_names(fitted(5e-4, doubt=1e-5)) is None


def test_a_table_survives_a_file():
    table = Table(3.0, 0.5, 1, (2.0, 1.0), [Row(("coulomb",), 0.1, 1.5, 2, SOFT_STOP)])
    again = from_json(json.loads(json.dumps(to_json(table))))
    assert to_json(again) == to_json(table)
    assert again.rows[0].names == ("coulomb",)
    assert from_json({**to_json(table), "rows": [[["coulomb"], 0.1, 1]]}).rows[0].strayed == 0


def known_within(cause, *spreads):
    """Fit of a cause at one joint, with standard deviations of its open numbers in their size."""
    member = Member(cause, (0,), {}, {})
    logs = (None, None)
    found = [FreeParameter(f"{member.name}.{number.name}", 0, log, 2.0, -9.0, 9.0)
             for number in cause.numbers if not number.fixed
             for log in ((0, 1) if number.scope == "log" else (None,))]
    at = SimpleNamespace(members=(member,), open=tuple(found), get=lambda entry: 0.5,
                         problem=SimpleNamespace(fit=logs))
    spreads = spreads or (0.0,) * len(found)
    return SimpleNamespace(hypothesis=at, covariance=np.diag((2.0 * np.array(spreads)) ** 2))


@pytest.mark.parametrize("cause, count", [
    (friction.COULOMB, 1), (timed.STEP_FAULT[0], 3), (timed.PERIODIC_DISTURBANCE, 5),
    (drive.TORQUE_RIPPLE, 3)])
def test_what_was_chosen_in_each_log_counts_there(cause, count):
    assert parameter_count(known_within(cause)) == count


def test_a_number_that_the_logs_do_not_determine_costs_nothing():
    found = known_within(friction.STRIBECK, 0.0, 0.0, 30.0)
    assert parameter_count(found) == pytest.approx(2, abs=0.01)


def test_a_fall_at_the_start_is_no_health_where_the_start_is_stated(healthy):
    bench, base = fit_nominal(healthy, METHOD)
    assert not is_contradicted(base, bench)
    fallen = [falling(log, bench, base) for log in healthy.logs]
    bench, base = fit_nominal(dataclasses.replace(healthy, fit=tuple(fallen[:2]),
                                               held_out=tuple(fallen[2:])), METHOD)
    assert base.excess < 1.0
    assert is_contradicted(base, bench)
    said = posterior(evidence(base, [], bench), Calibration())
    assert said[0].names == ("unknown",)
    assert posterior(evidence(base, []), Calibration())[0].names == ("none",)
    unstated = [dataclasses.replace(log, at_rest=False) for log in fallen]
    assert not is_contradicted(base, dataclasses.replace(bench, problem=dataclasses.replace(
        bench.problem, fit=tuple(unstated), held_out=())))


def falling(log, bench, base):
    """Log whose joints all start 10 mrad from where they are said to."""
    from scipy.signal import lfilter

    problem, at = bench.problem, base.hypothesis.values
    fall = [lfilter(*problem.law.sensor_sensitivity(k, at["inertia"][k], at["damping"][k]),
                    np.full(len(log), 0.01)) for k in range(problem.n)]
    return dataclasses.replace(log, q=log.q + np.stack(fall, axis=1))
