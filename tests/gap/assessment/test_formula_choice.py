"""The term that is chosen, against a search over all of them, and on noise alone."""

import numpy as np
import pytest

from clie_blocks.analysis.gap.assessment.formula_choice import choose

BASE, PARTS, ROWS = 2, 6, 200
GROUPS = [(2, 3), (4,), (5, 6), (7,), (8,), (9, 10)]


def equations(columns, target):
    parts = zip(np.array_split(columns, PARTS), np.array_split(target, PARTS))
    grams, rights = zip(*((some.T @ some, some.T @ part) for some, part in parts))
    return np.array(grams), np.array(rights)


def left_by(columns, target, group):
    kept = columns[:, [*range(BASE), *group]]
    return np.sum((target - kept @ np.linalg.lstsq(kept, target, rcond=None)[0])**2)


@pytest.mark.parametrize("seed", range(5))
def test_it_is_the_group_that_least_squares_leaves_least_with(seed):
    rng = np.random.default_rng(seed)
    columns = rng.standard_normal((PARTS * ROWS, 11)) @ rng.standard_normal((11, 11))
    target = columns @ rng.standard_normal(11) + rng.standard_normal(len(columns))
    best, theta, _ = choose(*equations(columns, target), GROUPS, BASE)
    assert best == np.argmin([left_by(columns, target, group) for group in GROUPS])
    kept = columns[:, [*range(BASE), *GROUPS[best]]]
    np.testing.assert_allclose(theta, np.linalg.lstsq(kept, target, rcond=None)[0][BASE:],
                               rtol=1e-6)


def test_units_of_the_columns_do_not_matter():
    rng = np.random.default_rng(7)
    columns = rng.standard_normal((PARTS * ROWS, 11))
    target = 0.4 * columns[:, 5] - 0.2 * columns[:, 6] + rng.standard_normal(len(columns))
    scale = 10.0**np.arange(-5, 6)
    plain, scaled = (choose(*equations(some, target), GROUPS, BASE)
                     for some in (columns, columns * scale))
    assert plain[0] == scaled[0] == 2 and plain[2] == pytest.approx(scaled[2])
    np.testing.assert_allclose(plain[1], scaled[1] * scale[5:7])


def test_noise_gains_nothing_on_parts_left_out():
    rng = np.random.default_rng(3)
    columns, target = rng.standard_normal((1200, 11)), rng.standard_normal(1200)
    assert choose(*equations(columns, target), GROUPS, BASE)[2] < 0.005 * target @ target


def test_a_torque_that_the_logs_do_not_show_is_not_chosen():
    rng = np.random.default_rng(3)
    columns = rng.standard_normal((PARTS * ROWS, 11))
    columns[:, [5, 6]] = 0.0
    target = columns[:, 7] + 0.1 * rng.standard_normal(len(columns))
    assert choose(*equations(columns, target), GROUPS, BASE)[0] == GROUPS.index((7,))
