"""The recommended run: inside the limits, written as set-points, and it separates the causes."""

import dataclasses
import io

import numpy as np
import pytest
from factories import make_ranked

from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.assessment.next_experiment import next_experiment
from clie_blocks.analysis.gap.assessment.test_motions import (
    elementary_motions,
    motion_limits,
    scale_inside,
    sum_of_sines,
    trusted_limits,
)
from clie_blocks.analysis.gap.calibration.robots import draw_cases
from clie_blocks.analysis.gap.causes.friction import COULOMB, PRESLIDING
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.search.strategy import search_causes
from clie_blocks.analysis.gap.verdict.posterior import credible_set, marginals
from clie_blocks.analysis.records import Record
from clie_blocks.analysis.records.robot_sections import Limits
from clie_blocks.errors import RecordError

REACH = 1.5e-4  # rad
ALTERNATIVES = ("coulomb", "presliding")  # alike where a joint moves far between two reversals


@pytest.fixture(scope="module")
def undecided():
    """Dry friction, and two causes of even odds: itself, and one that bends before it slides.

    It bends by so little that the log at hand hardly shows it.
    """
    made = draw_cases(1, 3, ["coulomb"], ["single"], duration=12.0)[0]
    residuals, nominal = fit_nominal(Problem.from_logs(made.robot, made.records[:1]), METHOD)
    fits = {name: one for name, cause in zip(ALTERNATIVES, (COULOMB, PRESLIDING))
            for one in search_causes(residuals, nominal, (cause,)).fits
            if [member.cause for member in one.hypothesis.members] == [cause]}
    bent = fits["presliding"].hypothesis
    reach = {"presliding.reach": np.full(made.robot.n, REACH)}
    fits["presliding"] = fit(bent.with_values({**bent.values, **reach}), residuals, 0)
    return made, residuals, fits, next_experiment(residuals, nominal, ranking_of(fits))


def ranking_of(fits):
    return [make_ranked(name, 0.5, 0.1, one) for name, one in fits.items()]


@pytest.mark.parametrize("samples", [1, 400, 15_000, 20_011])
def test_sums_of_sines_are_those_of_their_lines(samples):
    rng = np.random.default_rng(samples)
    frequencies, phases = rng.uniform(0.0, 0.4, 20), rng.uniform(0.0, 2 * np.pi, 20)
    lines = np.sin(2 * np.pi * frequencies[:, None] * np.arange(samples) + phases[:, None])
    np.testing.assert_allclose(sum_of_sines(frequencies, phases, samples), lines.sum(axis=0),
                               rtol=0.0, atol=1e-10)


def test_runs_stay_inside_what_the_robot_may_do(undecided):
    _, residuals, fits, _ = undecided
    method, limits = METHOD.assessment, motion_limits(residuals.problem)
    models = [one.hypothesis for one in fits.values()]
    for log in elementary_motions(residuals.problem, limits, method):
        log, motions = scale_inside(models, log, limits, method.experiment_limit)
        for model, motion in zip(models, motions, strict=True):
            assert_inside(model, log, limits, motion)


def test_the_recommended_run_keeps_to_the_limits_whichever_cause_is_true(undecided):
    _, residuals, fits, advice = undecided
    for one in fits.values():
        assert_inside(one.hypothesis, advice.run, motion_limits(residuals.problem))


def test_the_model_that_comes_closest_to_a_limit_sets_the_scale(undecided):
    """A joint that rubs much moves little: a run made for it alone is too large without it."""
    _, residuals, fits, _ = undecided
    method, limits = METHOD.assessment, motion_limits(residuals.problem)
    model = fits["coulomb"].hypothesis
    rubbing, free = (model.with_values({**model.values, "coulomb.level": share * limits.torque})
                     for share in (0.3, 0.0))
    chirp = elementary_motions(residuals.problem, limits, method)[-1]
    alone, _ = scale_inside([rubbing], chirp, limits, method.experiment_limit)
    with pytest.raises(AssertionError):
        assert_inside(free, alone, limits)
    both, _ = scale_inside([rubbing, free], chirp, limits, method.experiment_limit)
    for one in (rubbing, free):
        assert_inside(one, both, limits)


def assert_inside(model, log, limits, motion=None):
    """A model keeps to position, speed and torque in a run."""
    q, u = model.simulator.run(log, model.of_log(0))
    if motion is not None:
        np.testing.assert_array_equal(q, motion)
    speed = np.abs(np.gradient(q, model.problem.period, axis=0))
    assert np.all(q >= limits.lowest - 1e-6) and np.all(q <= limits.highest + 1e-6)
    assert np.all(speed <= 1.05 * limits.speed)  # limits are those of a smoothed speed
    assert np.all(np.abs(u) <= limits.torque)


def test_the_best_run_is_the_best_of_its_menu_and_separates_the_set(undecided):
    *_, advice = undecided
    assert advice.separates == [["coulomb"], ["presliding"]]
    sizes = [row["expected_set_size"] for row in advice.menu]
    assert advice.best["expected_set_size"] == min(sizes) < 1.5
    assert any("multisine" in row["experiment"] for row in advice.menu)


def test_a_run_that_leaves_the_set_as_it_is_is_not_recommended(undecided):
    _, residuals, fits, _ = undecided
    twins = [make_ranked(name, 0.5, 0.1, fits["coulomb"]) for name in ALTERNATIVES]
    assert next_experiment(residuals, fits["coulomb"], twins) is None


def test_one_name_is_told_from_nothing(undecided):
    _, residuals, fits, _ = undecided
    plain = fit_nominal(residuals.problem, METHOD)[1]
    ranking = [make_ranked("coulomb", 0.55, 0.1, fits["coulomb"]), make_ranked("none", 0.45, 0.2)]
    advice = next_experiment(residuals, plain, ranking)
    assert advice.separates == [["coulomb"], ["none"]]
    assert advice.best["expected_set_size"] < 1.5
    for one in (fits["coulomb"], plain):
        assert_inside(one.hypothesis, advice.run, motion_limits(residuals.problem))


@pytest.mark.parametrize("unknown", ["unknown", "coulomb+unknown"])
def test_no_run_where_something_unknown_may_move_the_robot(undecided, unknown):
    """No model says how far it moves, so that no limit is sure to hold."""
    _, residuals, fits, _ = undecided
    ranking = [make_ranked("coulomb", 0.5, 0.1, fits["coulomb"]),
               make_ranked("presliding", 0.3, 0.1, fits["presliding"]),
               make_ranked(unknown, 0.2, 0.2)]
    assert next_experiment(residuals, fits["coulomb"], ranking) is None


@pytest.mark.slow
def test_set_points_are_a_table_of_what_was_simulated(undecided, case, tmp_path):
    *_, advice = undecided
    made = case("none")
    diagnosis = diagnose(Problem.from_logs(made.robot, made.records))
    dataclasses.replace(diagnosis, next_experiment=advice).report(tmp_path, "arm")
    table = np.genfromtxt(io.StringIO((tmp_path / "arm.next.csv").read_text()), delimiter=",",
                          names=True)
    assert np.diff(table["time"]) == pytest.approx(advice.period)
    assert table["qd1"] == pytest.approx(advice.run.q_d[:, 0], rel=1e-5, abs=1e-6)
    assert table["pe1"] == pytest.approx(advice.run.pe[:, 0], rel=1e-5, abs=1e-6)
    assert '"arm.next.csv"' in (tmp_path / "arm.json").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("true", ALTERNATIVES)
def test_the_run_tells_the_cause_whichever_is_true(undecided, true):
    made, residuals, fits, advice = undecided
    model, rng = fits[true].hypothesis, np.random.default_rng(1)
    records = [recorded(model, log, [n.sigma for n in residuals.noises], rng)
               for log in (residuals.problem.fit[0], advice.run)]
    problems = [Problem.from_logs(made.robot, logs, held_out=[])
                for logs in (records[:1], records)]
    before, after = (diagnose(problem, effects=ALTERNATIVES) for problem in problems)
    assert credible_set(after.ranking) == [true]
    assert marginals(after.ranking)[true] > min(marginals(before.ranking)[true], 0.999)
    if true == "presliding":  # the old log alone leaves both
        assert set(credible_set(before.ranking)) == set(ALTERNATIVES)


def recorded(model, log, sigma, rng):
    """The log that a robot like the model writes: its encoder adds noise."""
    log = dataclasses.replace(log, dither=rng.normal(0, sigma, log.q_d.shape))
    q, u = model.simulator.run(log, model.of_log(0))
    return Record(time=model.problem.period * np.arange(len(q)), q=q + log.dither, u=u,
                  qd=log.q_d, pe=log.pe, source=log.name)


def test_stated_limits_take_the_place_of_what_the_logs_reached(undecided):
    made, residuals, fits, _ = undecided
    nominal = fits["coulomb"]  # never asked: there is no room for a run
    reached = motion_limits(residuals.problem)
    stated = Limits(lower=reached.lowest - 0.5, upper=reached.highest + 0.7, speed=9.0,
                    command=2.0)
    robot = dataclasses.replace(made.robot, limits=stated)
    limits = motion_limits(Problem.from_logs(robot, made.records[:1]))
    np.testing.assert_allclose(limits.lowest, reached.lowest - 0.5)
    np.testing.assert_allclose(limits.highest, reached.highest + 0.7)
    assert (limits.speed == 9.0).all() and (limits.torque == 2.0).all()
    beyond = dataclasses.replace(made.robot, limits=Limits(lower=reached.highest + 0.1))
    problem = Problem.from_logs(beyond, made.records[:1])
    assert next_experiment(dataclasses.replace(residuals, problem=problem), nominal,
                           ranking_of(fits)) is None
    with pytest.raises(RecordError, match="is not below the highest"):
        Limits(lower=[1.0], upper=[0.5])


def test_a_run_asks_for_no_torque_far_beyond_those_of_the_logs(undecided):
    """What a drive loses there, no log shows."""
    made, method = undecided[0], METHOD.assessment
    reached = motion_limits(Problem.from_logs(made.robot, made.records)).torque
    growth, least = method.experiment_torque_growth, method.experiment_least_torque
    for most in (2.0 * growth, 2.0 * growth / least):
        strong = dataclasses.replace(made.robot, limits=Limits(command=(most * reached).tolist()))
        known = trusted_limits(Problem.from_logs(strong, made.records), method).torque
        np.testing.assert_allclose(known, max(growth, least * most) * reached)


def test_a_run_begins_where_the_robot_rests(undecided):
    """No set-point steps at its first sample, wherever the phases of its lines are."""
    _, residuals, _, advice = undecided
    limits = motion_limits(residuals.problem)
    np.testing.assert_allclose(advice.run.q_d[0], limits.centre)
    np.testing.assert_array_equal(advice.run.pe[0], 0.0)
    begun = round(1.0 / residuals.problem.period)
    steps = np.abs(np.diff(advice.run.q_d, axis=0))
    assert steps[:begun // 10].max() < 0.3 * steps[begun:].max() + 1e-9


@pytest.mark.parametrize("spread, is_told", [(1e-9, True), (1e6, False)])
def test_what_a_refit_would_follow_tells_no_models_apart(undecided, spread, is_told):
    """Two levels of one friction lie apart, but not where the level is open to a fit."""
    _, residuals, fits, _ = undecided
    first = dataclasses.replace(fits["coulomb"], covariance=spread * fits["coulomb"].covariance)
    values = first.hypothesis.values
    higher = first.hypothesis.with_values(
        {**values, "coulomb.level": 1.05 * values["coulomb.level"]})
    ranking = [make_ranked("coulomb", 0.55, 0.1, first),
               make_ranked("asymmetric_coulomb", 0.45, 0.1,
                           dataclasses.replace(first, hypothesis=higher))]
    assert (next_experiment(residuals, first, ranking) is not None) == is_told
