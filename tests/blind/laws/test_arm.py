"""Arms of the study: their dynamics by hand against MuJoCo's, effects at a joint, right files."""

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.blind.laws import control_laws as laws  # noqa: E402
from clie_blocks.analysis.blind.laws.arm import PERIOD, draw_arm, model_text  # noqa: E402
from clie_blocks.analysis.blind.laws.run import Effect, Reference, run  # noqa: E402


@pytest.mark.parametrize("n", [1, 2])
@pytest.mark.parametrize("has_gravity", [False, True])
def test_dynamics_by_hand_are_those_of_the_engine(n, has_gravity):
    rng = np.random.default_rng(3)
    arm = draw_arm(rng, n, has_gravity)
    model = mujoco.MjModel.from_xml_string(model_text(arm))
    data = mujoco.MjData(model)
    for _ in range(5):
        q, dq, ddq = rng.normal(size=(3, n))
        data.qpos[:], data.qvel[:], data.qacc[:] = q, dq, ddq
        mujoco.mj_inverse(model, data)
        mass, bias = arm.terms(q, dq)
        np.testing.assert_allclose(mass @ ddq + bias, data.qfrc_inverse, rtol=3e-5, atol=3e-5)


def test_references_begin_at_rest_and_fit_their_derivatives():
    reference = Reference(np.random.default_rng(1), 2, 1.6)
    h = 1e-5
    before, now, after = (reference(0.7 + k * h) for k in (-1, 0, 1))
    np.testing.assert_allclose((after[0] - before[0]) / (2 * h), now[1], rtol=1e-6)
    np.testing.assert_allclose((after[1] - before[1]) / (2 * h), now[2], rtol=1e-6)
    np.testing.assert_allclose(reference(0.0)[1], 0.0, atol=1e-12)


@pytest.mark.parametrize(("name", "size"), [
    ("coulomb", 0.5), ("backlash", 0.02), ("joint_elasticity", 300.0), ("time_delay", 3.0),
    ("quadratic_drag", 1.0)])
def test_an_effect_acts_most_at_its_joint(name, size):
    rng = np.random.default_rng(8)
    arm = draw_arm(rng, 2, False)
    kp = arm.inertia * 20.0**2 / arm.gear
    kd = 1.4 * arm.inertia * 20.0 / arm.gear

    def moved(effect):
        log = run(arm, laws.pd(kp, kd), Reference(np.random.default_rng(4), 2, 1.5),
                  np.random.default_rng(5), 2.0, 1e-6, effect)
        return log[:, 1:3]

    change = np.abs(moved(Effect(name, 1, size)) - moved(Effect())).max(axis=0)
    assert change[1] > 20.0 * 2e-5 and change[1] > 2.0 * change[0]


def test_a_loop_that_is_unstable_ends_early():
    rng = np.random.default_rng(2)
    arm = draw_arm(rng, 1, False)
    log = run(arm, laws.pd(1e6, -1e3), Reference(rng, 1, 1.0), rng, 2.0, 1e-6)
    assert len(log) < round(2.0 / PERIOD)
