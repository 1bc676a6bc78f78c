"""The softened loop: the same commands, the same residual of a linear model, backlash found."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.gap import backlash
from clie_blocks.analysis.gap.backlash import explain_backlash, soften_loop, to_stated_loop
from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.causes.transmission import BACKLASH
from clie_blocks.analysis.gap.explain import Explanation
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.method.calibration import Calibration
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.verdict.evidence import Row, Table
from clie_blocks.analysis.gap.verdict.posterior import RankedCause

METHOD_OF_TESTS = dataclasses.replace(METHOD, calibration=Calibration())


def table(**left):
    """Evidence with the excess of some hypotheses, and of the nominal model as `nothing`."""
    rows = [Row(tuple(names.split("_and_")), value, 2) for names, value in left.items()
            if names != "nothing"]
    return Table(left["nothing"], 0.0, 0, (), rows)


@dataclasses.dataclass
class Better:
    """Stands for a fit that leaves some excess."""

    excess: float


class Explain:
    """Stands for `explain`: remembers what it was asked and gives prepared evidence."""

    def __init__(self, alone, whole):
        self.answers, self.calls = [alone, whole], []

    def __call__(self, problem, causes, method, steps, test_lack_of_fit=True):
        assert test_lack_of_fit == bool(self.calls)
        self.calls.append((problem, causes, method))
        return Explanation(None, None, self.answers[len(self.calls) - 1])


def softened(problem, first, explain, better=None):
    """Explanation of a problem whose first evidence is given."""
    residuals, nominal = fit_nominal(problem, METHOD_OF_TESTS)
    residuals = dataclasses.replace(residuals, problem=problem)
    return explain_backlash(Explanation(residuals, nominal, first), CAUSES, METHOD_OF_TESTS,
                            explain=explain, restart=lambda *_: Better(better))


def test_a_model_that_moves_as_the_robot_gets_the_recorded_command(healthy):
    led = soften_loop(healthy, METHOD)
    for log, recorded in zip(led.logs, healthy.logs):
        assert np.allclose(led.law.replay(log.q, log.q_d, log.pe), recorded.u, atol=1e-12)
    assert np.all(led.law.kp < healthy.law.kp) and np.all(led.law.kd < healthy.law.kd)


def test_what_a_healthy_robot_leaves_is_noise_in_both_loops(healthy):
    for problem in (healthy, soften_loop(healthy, METHOD)):
        assert abs(fit_nominal(problem, METHOD)[1].excess) < 0.15


def test_backlash_that_is_missed_at_first_is_found(healthy):
    explain = Explain(table(backlash=3.0, nothing=200.0),
                      table(backlash=3.0, joint_elasticity=120.0, nothing=200.0))
    found = softened(healthy, table(joint_elasticity=80.0, nothing=150.0), explain, 2.0)
    left = {row.names: row.excess for row in found.evidence.rows}
    assert left == {("backlash",): 2.0, ("joint_elasticity",): 120.0}
    assert [causes for _, causes, _ in explain.calls] == [(BACKLASH,), CAUSES]
    assert all(problem.quiet for problem, _, _ in explain.calls)


@pytest.mark.parametrize("first", [
    {"coulomb": 0.1, "nothing": 50.0}, {"nothing": 0.2}, {"backlash": 1.0, "nothing": 90.0}],
    ids=["explained", "nothing there", "backlash already"])
def test_no_second_explanation_where_the_first_will_do(healthy, first):
    explain = Explain(None, None)
    assert softened(healthy, table(**first), explain) is None
    assert not explain.calls


def test_no_whole_library_where_backlash_explains_next_to_nothing(healthy):
    explain = Explain(table(backlash=190.0, nothing=200.0), None)
    assert softened(healthy, table(coulomb=80.0, nothing=150.0), explain) is None
    assert len(explain.calls) == 1


def test_a_second_explanation_without_backlash_is_not_believed(healthy):
    """Recorded commands hide a fault of the controller, and nothing seems to be left."""
    explain = Explain(table(backlash=0.3, nothing=2.0), table(coulomb=0.01, nothing=2.0))
    assert softened(healthy, table(coulomb=80.0, nothing=150.0), explain, 1.5) is None


def test_no_whole_library_where_backlash_leaves_more_than_a_good_first_explanation(healthy):
    explain = Explain(table(backlash=60.0, nothing=200.0), None)
    assert softened(healthy, table(coulomb=2.0, nothing=150.0), explain) is None
    assert len(explain.calls) == 1


def test_no_second_explanation_of_a_simulator_nor_without_a_law_that_damps(healthy):
    first, explain = table(coulomb=80.0, nothing=150.0), Explain(None, None)
    servo = dataclasses.replace(healthy, law=dataclasses.replace(healthy.law,
                                                                 kd=0.0 * healthy.law.kd))
    for problem in (dataclasses.replace(healthy, quiet=True), servo):
        assert softened(problem, first, explain) is None
    assert not explain.calls


def test_a_model_of_the_softened_loop_predicts_in_the_stated_loop(healthy):
    bench, base = fit_nominal(healthy, METHOD)
    _, led = fit_nominal(soften_loop(healthy, METHOD), METHOD)
    ranking, model = to_stated_loop([RankedCause(("none",), led, 0.0, 1.0),
                                  RankedCause(("unknown",), None, 0.0, 0.0)], led, bench.problem)
    assert ranking[1].fit is None
    for one in (ranking[0].fit, model):
        difference = one.hypothesis.error(0) - base.hypothesis.error(0)
        assert np.abs(difference).max() < 0.5 * np.abs(base.hypothesis.error(0)).max()
        assert np.array_equal(one.hypothesis.values["kp"], healthy.law.kp)


def test_backlash_is_found_from_a_start_beside_it(healthy):
    """The robot is the model itself with 2 mrad of backlash; the fit starts from half of it."""
    problem = dataclasses.replace(healthy, fit=healthy.fit[:1], held_out=())
    joints, every = tuple(range(problem.n)), np.ones(problem.n)

    def loose(half_gap):
        values = {"half_gap": half_gap * every, "link_share": 0.5 * every, "loose": every,
                  "bearing_share": 0.0 * every, "contact": 500.0 * every}
        return Member(BACKLASH, joints, values, {**values, "half_gap": 1e-3 * every,
                                                 "bearing_share": 0.5 * every})

    bench, base = fit_nominal(problem, METHOD)
    robot = build_hypothesis(bench.problem, [loose(2e-3)], base.hypothesis)
    log, = bench.problem.fit
    moved = dataclasses.replace(log, q=log.q - robot.error(0) + log.dither)
    problem = dataclasses.replace(bench.problem, fit=(moved,))
    begun = fit(build_hypothesis(problem, [loose(1e-3)], base.hypothesis),
                dataclasses.replace(bench, problem=problem), 0)
    found = backlash.multistart(begun, dataclasses.replace(bench, problem=problem))
    assert found.total < 0.1 * begun.total
    assert np.allclose(found.hypothesis.values["backlash.half_gap"], 2e-3, rtol=0.2)
