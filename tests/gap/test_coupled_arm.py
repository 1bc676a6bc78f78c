"""Arms whose links push each other: slopes of a fit, and a refit from numbers that are far off."""

import dataclasses

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.blind.folder import robot_text  # noqa: E402
from clie_blocks.analysis.blind.loop import run  # noqa: E402
from clie_blocks.analysis.blind.motion import Motion, draw_motions  # noqa: E402
from clie_blocks.analysis.blind.robot import draw_robot, draw_truth  # noqa: E402
from clie_blocks.analysis.gap.baseline import baseline  # noqa: E402
from clie_blocks.analysis.gap.evidence import excess  # noqa: E402
from clie_blocks.analysis.gap.fit import fit, linearised  # noqa: E402
from clie_blocks.analysis.gap.hypothesis import hypothesis  # noqa: E402
from clie_blocks.analysis.gap.problem import problem  # noqa: E402
from clie_blocks.analysis.records import Record, read_robot  # noqa: E402

ROWS = 6000


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """Problem of a five-joint arm with gears of 1.6 to 130, whose file has one wrong rotor."""
    rng = np.random.default_rng(20)
    body = dataclasses.replace(draw_robot(rng, "arm", True), period=1e-3)
    truth = draw_truth(rng, body)
    motions = [Motion(m.excitation, m.start, m.q_d[:ROWS], m.pe[:ROWS])
               for m in draw_motions(rng, body)[:2]]
    runs = run(body, [truth] * 2, motions, [body.sigma * rng.standard_normal(m.q_d.shape)
                                            for m in motions])
    file = tmp_path_factory.mktemp("arm") / "robot.toml"
    file.write_text(robot_text(body, motions))
    robot = read_robot(file)
    records = [Record(time=body.period * np.arange(ROWS), q=q, u=u, qd=m.q_d, pe=m.pe,
                      source=f"log-{j + 1}") for j, (m, (q, u)) in enumerate(zip(motions, runs))]
    wrong = np.where(np.arange(body.n) == 1, 1.5, 1.0)
    motor = dataclasses.replace(robot.motor, inertia=wrong * robot.motor.inertia)
    return problem(dataclasses.replace(robot, motor=motor), records, [])


def test_slopes_of_numbers_on_their_own_hold_what_one_joint_does_to_another(arm):
    bench, base = baseline(arm)
    at, last = base.hypothesis, len(base.hypothesis.open)
    columns = linearised(at, bench, apart=True).columns[:-last]
    entry = at.open[1]
    step = 0.02 * entry.size
    sides = [linearised(at.with_values(at.moved([(entry, at.get(entry) + sign * step)])),
                        bench).residual[:-last] for sign in (-1, 1)]
    slope = (sides[1] - sides[0]) * entry.size / (2 * step)
    quick = linearised(at.with_values(at.values), bench).columns[:-last]
    far = [np.linalg.norm(found[:, 1] - slope) / np.linalg.norm(slope)
           for found in (columns, quick)]
    assert far[0] < 0.05 < far[1]


def test_the_refit_goes_on_where_the_quick_slopes_lead_nowhere(arm):
    bench, base = baseline(arm)
    quick = fit(hypothesis(bench.problem, ()), bench, 40)
    assert base.cost < 0.7 * quick.cost
    assert excess(base) < excess(quick)
