"""The spectrum over the pose: an order that no list of harmonics holds is found."""

import numpy as np
import pytest

from clie_blocks.analysis.gap import own_robots
from clie_blocks.analysis.gap.baseline import baseline
from clie_blocks.analysis.gap.causes.drive import TORQUE_RIPPLE
from clie_blocks.analysis.gap.problem import problem
from clie_blocks.analysis.gap.ripple import ripples
from clie_blocks.analysis.gap.search import residuals


@pytest.mark.parametrize("order", [23.7, 61.3])
def test_an_order_between_the_harmonics_of_the_motor_is_found(order, monkeypatch):
    monkeypatch.setitem(own_robots.EFFECTS, "torque_ripple", lambda rng, joint: joint.update(
        ripple=2e-3 * joint["kp"], order=order))
    made, = own_robots.cases(1, 2, ["torque_ripple"], ["single"], duration=8.0)
    bench, base = baseline(problem(made.robot, made.records))
    (member, drop), = ripples(bench, base, residuals(bench, base), (TORQUE_RIPPLE,))
    k = made.causes["torque_ripple"] - 1
    travel = np.ptp(np.concatenate([log.q[:, k] for log in bench.problem.fit]))
    assert drop[k] > 0.5 * (base.chi2[:2, k].sum() - base.samples[:2, k].sum())
    assert member.values["order"][k] == pytest.approx(order, abs=3.0 / travel)  # half a line
    assert ripples(bench, base, residuals(bench, base), ()) == []
