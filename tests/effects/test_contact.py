"""Dry friction that sticks: it holds, it breaks away, and it is the smoothed law when sliding."""

import numpy as np
import pytest
from effect_runs import one_joint, run_loop, run_plant

from clie_blocks.effects import LIBRARY, sticking
from clie_blocks.effects.dry_friction import DryFriction
from clie_blocks.signals import DiagramError

A, B = 2.0, 0.5
DRY = [name for name in LIBRARY if isinstance(LIBRARY[name].build, DryFriction)]


@pytest.mark.parametrize("name", DRY)
def test_it_slides_like_the_smoothed_law(name):
    laws = [LIBRARY[name], sticking(LIBRARY[name])]
    runs = [run_loop(one_joint(law.typical()), lambda t: 0.8 * np.sin(0.9 * t), 8.0)
            for law in laws]
    free = run_loop(one_joint(), lambda t: 0.8 * np.sin(0.9 * t), 8.0)
    smooth, stuck = (np.asarray(run.outputs[0]).ravel() for run in runs)
    effect = np.max(np.abs(smooth - np.asarray(free.outputs[0]).ravel()))
    assert np.max(np.abs(smooth - stuck)) < 0.05 * effect


@pytest.mark.parametrize("name", DRY)
def test_neutral_is_bitwise_invisible(name):
    plain, neutral = one_joint(), one_joint(sticking(LIBRARY[name]).neutral())
    columns = [neutral.state_labels.index(f"plant_{s}") for s in ("q[0]", "dq[0]")]
    rng = np.random.default_rng(0)
    for _ in range(10):
        x, u = np.zeros(neutral.nstates), rng.normal(size=1)
        x[columns] = rng.normal(size=2)
        np.testing.assert_array_equal(neutral.dynamics(0, x, u)[columns],
                                      plain.dynamics(0, x[columns], u))


def test_a_coasting_joint_stops_on_time_and_stays():
    level, speed, reach = 0.4, 3.0, 1e-5
    plant = one_joint(sticking(LIBRARY["coulomb"])(level=level, reach=reach))
    t, q, dq = run_plant(plant, 0.0, 4.0, state={"plant_dq[0]": speed, "coulomb_z[0]": reach})
    stop = np.log1p(A * speed / (B * level)) / A
    assert t[np.argmax(dq <= 0)] == pytest.approx(stop, abs=2e-3)
    assert q[-1] == pytest.approx(speed / A - B * level / A * stop, abs=2 * reach)
    assert abs(dq[-1]) < 1e-12


@pytest.mark.parametrize(("load", "moves"), [(0.39, False), (0.41, True)])
def test_it_holds_any_load_below_the_level(load, moves):
    plant = one_joint(sticking(LIBRARY["coulomb"])(level=0.4))
    _, q, dq = run_plant(plant, lambda t: np.minimum(0.1 * t, load), 10.0)
    assert (q[-1] > 1e-3) == moves
    assert moves or abs(dq[-1]) < 1e-9


def test_a_set_point_within_the_friction_leaves_the_joint_where_it_is():
    loop = run_loop(one_joint(sticking(LIBRARY["coulomb"])(level=0.4)), 0.039, 60.0)
    q = np.asarray(loop.outputs[0]).ravel()
    assert np.max(np.abs(q)) < 5e-4  # level / Kp is 0.04 rad
    assert np.ptp(q[len(q) // 4:]) < 1e-9


def test_stribeck_breaks_away_at_its_static_level():
    plant = one_joint(sticking(LIBRARY["stribeck"])(level=0.4, excess=0.2))
    rate = 0.05
    t, q, _ = run_plant(plant, lambda t: rate * t, 14.0)
    assert rate * t[np.argmax(q > 1e-4)] == pytest.approx(0.6, rel=0.02)


def test_only_dry_friction_has_a_form_that_sticks():
    with pytest.raises(DiagramError, match="gravity has no form that sticks"):
        sticking(LIBRARY["gravity"])
