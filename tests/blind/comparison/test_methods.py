"""Methods on the same trials: which trials represent a study, and what a difference is worth."""

from collections import Counter

import pytest

from clie_blocks.analysis.blind.comparison.methods import (
    paired_differences,
    probability_of_truth,
    sample_evenly,
)
from clie_blocks.analysis.blind.population.effects import EFFECTS
from clie_blocks.analysis.blind.population.standard import KINDS, SEVERITY, plan
from clie_blocks.analysis.blind.scoring.decisions import Answer


def study(seeds, trials):
    return {seed: {f"trial-{i:03d}": dict(zip(("kind", "labels", "severity"), plan(seed, i)))
                   for i in range(trials)} for seed in seeds}


def answer(effect, probability, after=2e-4):
    return {"effects": [{"effect": effect, "joint": [1], "probability": probability}],
            "set_90": [effect], "unexplained": False, "gap_before": 4e-4, "gap_after": after,
            "seconds": 1.0}


def test_a_subset_has_every_kind_and_size_in_its_share():
    labels = study((5, 6), 100)
    sample = sample_evenly(labels, 50)
    kinds = Counter(labels[seed][name]["kind"] for seed, name in sample)
    assert len(set(sample)) == 50
    assert all(abs(kinds[kind] - count) <= 1 for kind, count in Counter(KINDS).items())
    singles = [labels[seed][name] for seed, name in sample
               if labels[seed][name]["kind"] == "single"]
    sizes = Counter(label["severity"] for label in singles)
    assert set(sizes) == set(SEVERITY) and max(sizes.values()) - min(sizes.values()) <= 1
    assert len({label["labels"][0] for label in singles}) > 0.7 * len(EFFECTS)
    assert {seed for seed, _ in sample} == {5, 6}


def test_a_subset_that_is_no_smaller_is_the_study():
    labels = study((5,), 20)
    assert sorted(sample_evenly(labels, 30)) == sorted(sample_evenly(labels)) == [
        (5, name) for name in sorted(labels[5])]


def test_only_trials_that_one_of_two_has_right_tell_them_apart():
    labels = {f"t{i}": {"kind": "single", "labels": ["coulomb"]} for i in range(20)}
    first = {name: answer("coulomb", 0.9) for name in labels}
    second = {name: answer("coulomb" if i < 12 else "spring", 0.6, 4e-4)
              for i, name in enumerate(labels)}
    found = paired_differences(first, second, labels)
    assert (found["only_first"], found["only_second"]) == (8, 0)
    assert found["lost"]["value"] == pytest.approx(0.4) and found["lost"]["interval"][0] > 0
    assert found["stated"]["value"] == pytest.approx(0.9 - 0.36)
    assert found["gap"]["value"] == pytest.approx(2.0)
    back = paired_differences(second, first, labels)
    assert back["lost"]["interval"] == pytest.approx([-x for x in found["lost"]["interval"][::-1]])


def test_of_several_effects_the_least_probable_counts():
    answer = Answer({"effects": [{"effect": "coulomb", "joint": [1], "probability": 0.9},
                                 {"effect": "spring", "joint": [1], "probability": 0.3}],
                     "unexplained": False})
    label = {"kind": "pair", "labels": ["coulomb", "spring"]}
    assert probability_of_truth(label, answer) == 0.3
    assert probability_of_truth({"kind": "unknown", "labels": ["wall"]}, answer) == 0.0
