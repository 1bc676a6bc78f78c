"""Ridge regression with parts left out, against least squares on the rows themselves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clie_blocks.analysis.gap.fitting.ridge import ridge_cv

PENALTIES = (1e-3, 1.0, 1e3)


def parts_of(seed, parts, columns):
    rng = np.random.default_rng(seed)
    theta = rng.normal(size=columns)
    data = [rng.normal(size=(30, columns)) for _ in range(parts)]
    return data, [x @ theta + 0.1 * rng.normal(size=30) for x in data]


def normal_equations(data, errors):
    return (np.array([x.T @ x for x in data]),
            np.array([x.T @ error for x, error in zip(data, errors)]))


def by_rows(data, errors, penalty):
    """Ridge as least squares with one row more per column."""
    columns = data[0].shape[1]
    rows = np.concatenate([*data, np.sqrt(penalty) * np.eye(columns)])
    return np.linalg.lstsq(rows, np.concatenate([*errors, np.zeros(columns)]), rcond=None)[0]


@given(seed=st.integers(0, 2**32 - 1), parts=st.integers(2, 6), columns=st.integers(1, 5),
       penalty=st.floats(1e-3, 1e3))
def test_each_part_is_predicted_from_the_others(seed, parts, columns, penalty):
    data, errors = parts_of(seed, parts, columns)
    fit = ridge_cv(*normal_equations(data, errors), [penalty])
    assert fit.theta == pytest.approx(by_rows(data, errors, penalty), rel=1e-6, abs=1e-9)
    for k in range(parts):
        others = by_rows(data[:k] + data[k + 1:], errors[:k] + errors[k + 1:], penalty)
        assert fit.left_out[k] == pytest.approx(others, rel=1e-6, abs=1e-9)
        rest = errors[k] - data[k] @ others
        assert fit.drops[k] == pytest.approx(errors[k] @ errors[k] - rest @ rest, rel=1e-6,
                                             abs=1e-9)


def test_the_penalty_that_predicts_best_is_taken():
    data, errors = parts_of(0, 4, 3)
    equations = normal_equations(data, errors)
    drops = [ridge_cv(*equations, [penalty]).drops.sum() for penalty in PENALTIES]
    assert ridge_cv(*equations, PENALTIES).drops.sum() == max(drops)
    worst = ridge_cv(*equations, PENALTIES, score=lambda drop: -drop.sum())
    assert worst.drops.sum() == min(drops)
    assert max(drops) > min(drops) + 1.0
