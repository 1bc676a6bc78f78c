"""A robot in MuJoCo with another cause at each of its joints."""

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
from clie_blocks import gap  # noqa: E402
from clie_blocks.analysis.blind.population.catalogue import CATALOGUE  # noqa: E402
from clie_blocks.analysis.blind.population.files import write_trial  # noqa: E402
from clie_blocks.analysis.blind.population.standard import MANY, draw_trial  # noqa: E402
from clie_blocks.analysis.gap.search.candidates import joints_worth_keeping  # noqa: E402

CAUSES = ("actuator_lag", "friction_drift", "quadratic_drag")


DRAWS = ((11, 4), (12, 37))  # of robots with three joints, which hold one cause each


@pytest.mark.slow
@pytest.mark.parametrize("draw", DRAWS)
def test_each_joint_gets_its_own_cause(tmp_path, draw):
    trial = draw_trial(np.random.default_rng(draw), 0, MANY, CAUSES, ("medium",) * 3, "axes",
                       vocabulary=CATALOGUE)
    write_trial(trial, tmp_path)
    found = gap.diagnose(gap.read(tmp_path))
    truth = {one["effect"]: [joint - 1 for joint in one["joints"]]
             for one in trial.label["effects"]}
    assert {joint for some in truth.values() for joint in some} == {0, 1, 2}
    model = next(ranked.fit for ranked in found.ranking if ranked.fit is not None)
    told = {member.cause.name: list(member.joints) for member in model.hypothesis.members}
    assert set(told) >= {"friction_drift", "quadratic_drag"}
    delayed = "actuator_lag" if "actuator_lag" in told else "time_delay"  # hardly told apart
    assert told[delayed] == truth["actuator_lag"]
    for name in ("friction_drift", "quadratic_drag"):
        assert told[name] == truth[name]
    assert found.reduction.after < 1.05 * found.reduction.floor


def test_a_joint_that_gains_next_to_nothing_is_no_joint_of_its_own():
    from clie_blocks.analysis.gap.method.method import METHOD
    assert joints_worth_keeping(np.array([1e6, 2e5, 1e3]), METHOD) == (0, 1)
