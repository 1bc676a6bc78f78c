"""The recommended run: inside the limits, written as set-points, and it does what it promises."""

import dataclasses
import io

import numpy as np
import pytest

from clie_blocks.analysis.gap import diagnose
from clie_blocks.analysis.gap.assessment.next_experiment import next_experiment
from clie_blocks.analysis.gap.assessment.test_motions import (
    elementary_motions,
    motion_limits,
    scale_inside,
)
from clie_blocks.analysis.gap.calibration.robots import draw_cases
from clie_blocks.analysis.gap.causes.load import GRAVITY, SPRING
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.problem.problem import Problem, problem
from clie_blocks.analysis.gap.report import write_report
from clie_blocks.analysis.gap.search.strategy import search_causes
from clie_blocks.analysis.gap.verdict.posterior import RankedCause, credible_set
from clie_blocks.analysis.records import Record

RIVALS = ("spring", "gravity")


@pytest.fixture(scope="module")
def doubtful():
    """A spring, and two causes of even odds: itself, and gravity."""
    made = draw_cases(1, 3, ["spring"], ["single"], duration=12.0)[0]
    bench, base = fit_nominal(problem(made.robot, made.records[:1]), METHOD)
    fits = {name: search_causes(bench, base, (cause,))[0]
            for name, cause in zip(RIVALS, (SPRING, GRAVITY))}
    ranking = [RankedCause((name,), fit, 0.1, 0.5) for name, fit in fits.items()]
    return made, bench, fits, next_experiment(bench, base, ranking, None)


def test_runs_stay_inside_what_the_robot_may_do(doubtful):
    _, bench, fits, _ = doubtful
    bounds, at = motion_limits(bench.problem), fits["spring"].hypothesis
    for log in elementary_motions(bench.problem, bounds):
        log, moved = scale_inside(at, log, bounds)
        q, u = at.simulator.run(log, at.of_log(0))
        np.testing.assert_array_equal(q, moved)
        assert np.all(q >= bounds.lowest - 1e-6) and np.all(q <= bounds.highest + 1e-6)
        assert np.all(np.abs(u) <= bounds.torque)


def test_the_best_run_is_the_best_of_its_menu_and_separates_the_set(doubtful):
    *_, advice = doubtful
    assert advice.separates == [["spring"], ["gravity"]]
    sizes = [row["expected_set_size"] for row in advice.menu]
    assert advice.best["expected_set_size"] == min(sizes) < 1.5
    assert any("multisine" in row["experiment"] for row in advice.menu)


def test_set_points_are_a_table_of_what_was_simulated(doubtful, case, tmp_path):
    *_, advice = doubtful
    made = case("none")
    found = dataclasses.replace(diagnose(Problem.from_logs(made.robot, made.records)), next_experiment=advice)
    write_report(found, made.records, tmp_path, "arm")
    table = np.genfromtxt(io.StringIO((tmp_path / "arm.next.csv").read_text()), delimiter=",",
                          names=True)
    assert np.diff(table["time"]) == pytest.approx(advice.period)
    assert table["qd1"] == pytest.approx(advice.run.q_d[:, 0], rel=1e-5, abs=1e-6)
    assert table["pe1"] == pytest.approx(advice.run.pe[:, 0], rel=1e-5, abs=1e-6)
    assert '"arm.next.csv"' in (tmp_path / "arm.json").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("true", RIVALS)
def test_the_run_shrinks_the_set_whichever_cause_is_true(doubtful, true):
    made, bench, fits, advice = doubtful
    at, rng = fits[true].hypothesis, np.random.default_rng(1)
    records = [recorded(at, log, [n.sigma for n in bench.noises], rng)
               for log in (bench.problem.fit[0], advice.run)]
    before, after = (diagnose(Problem.from_logs(made.robot, logs, held_out=[]), effects=RIVALS)
                     for logs in (records[:1], records))
    assert credible_set(after.ranking) == [true]
    if true == "spring":  # the old log alone leaves both
        assert set(credible_set(before.ranking)) == set(RIVALS)


def recorded(at, log, sigma, rng):
    """The log that a robot like the model writes."""
    log = dataclasses.replace(log, dither=rng.normal(0, sigma, log.q_d.shape))
    q, u = at.simulator.run(log, at.of_log(0))
    return Record(time=at.problem.period * np.arange(len(q)), q=q, u=u, qd=log.q_d, pe=log.pe,
                  source=log.name)
