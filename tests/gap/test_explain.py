"""The nominal model of an explanation, where held-out logs show what the fitted ones do not."""

import dataclasses

import pytest
from factories import make_fit, make_problem, make_residual_model

from clie_blocks.analysis.gap.explain import EXPLAIN_STEPS, explain


def fitted(problem, excess_of_held_out):
    fit = make_fit(problem)
    chi2 = fit.samples.copy()
    chi2[len(problem.fit):] *= 1.0 + excess_of_held_out
    return dataclasses.replace(fit, chi2=chi2)


@pytest.mark.parametrize("excess, pooled", [(0.0, False), (50.0, True)])
def test_the_model_of_the_stated_split_is_kept_where_held_out_logs_are_fitted(excess, pooled):
    models = []

    def fit_nominal(problem, method, noise_model):
        models.append(fitted(problem, excess))
        return make_residual_model(problem, method=method), models[-1]

    steps = dataclasses.replace(EXPLAIN_STEPS, fit_nominal=fit_nominal)
    found = explain(make_problem(held_out=1), (), steps=steps, test_lack_of_fit=False)
    assert len(models) == 1 + pooled and found.nominal is models[-1]
    assert found.before_pooling is (models[0] if pooled else None)
    assert len(found.nominal.hypothesis.problem.held_out) == 1 - pooled
