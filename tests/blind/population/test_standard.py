"""The plan of a study, the size of effects, and trials that are the same each time."""

import types

import numpy as np
import pytest

from clie_blocks.analysis.blind.population import standard
from clie_blocks.analysis.blind.population.effects import EFFECTS
from clie_blocks.analysis.blind.population.maker import RejectedError, make_trial
from clie_blocks.analysis.blind.population.outsiders import OUTSIDERS
from clie_blocks.analysis.blind.population.standard import KINDS, ONE_OF, SEVERITY, STANDARD, plan


def test_a_study_holds_all_kinds_and_every_effect_in_all_sizes():
    plans = [plan(5, index) for index in range(3 * len(KINDS))]
    named = {kind: {name for k, names, _ in plans if k == kind for name in names}
             for kind in ("single", "unknown")}
    assert named == {"single": set(EFFECTS), "unknown": set(OUTSIDERS)}
    assert {kind for kind, _, _ in plans} == set(KINDS)
    sizes = {(names[0], severity) for kind, names, severity in plans if kind == "single"}
    assert len(sizes) == len(EFFECTS) * len(SEVERITY)


def test_pairs_and_triples_hold_that_many_different_effects():
    plans = [plan(6, index) for index in range(2 * len(KINDS))]
    for kind, count in (("pair", 2), ("triple", 3)):
        found = [set(names) for k, names, _ in plans if k == kind]
        assert found and all(len(names) == count for names in found)
        assert all(len(names & set(group)) < 2 for names in found for group in ONE_OF)


@pytest.mark.parametrize(("trace", "size"), [
    (lambda s: np.log(s), 4.0), (lambda s: np.log(40 * s), 0.1), (lambda s: np.log(s / 40), 160.0),
    (lambda s: np.log(1e4 * s), 4e-4),
    (lambda s: np.where(s < 5, np.log(s), np.nan), 4.0),
    (lambda s: np.log(s) + 5.0 * (s > 5), 4.0)],
    ids=["plain", "strong", "weak", "far too strong", "diverges beyond", "rings beyond"])
def test_the_size_of_an_effect_is_found_wherever_it_lies(monkeypatch, trace, size):
    monkeypatch.setattr(standard, "_traces", lambda robot, lanes, *rest: trace(np.array(lanes)))
    hidden = types.SimpleNamespace(name="coulomb", apply=lambda truth, size: size)
    monkeypatch.setitem(standard.SEVERITY, "four", np.sqrt(17.0))
    found, reached = standard._size_for_ratio(None, None, None, None, None, hidden, "four", 0)
    assert reached and found == pytest.approx(size, rel=1e-6)


def test_a_size_that_no_robot_shows_is_reported_as_missed(monkeypatch):
    monkeypatch.setattr(standard, "_traces", lambda robot, lanes, *rest: np.tanh(lanes) - 2.0)
    hidden = types.SimpleNamespace(name="coulomb", apply=lambda truth, size: size)
    assert not standard._size_for_ratio(None, None, None, None, None, hidden, "strong", 0)[1]


def test_a_healthy_trial_shows_nothing_beyond_the_noise(healthy_trial):
    label = healthy_trial[1].label
    assert label["kind"] == "none" and label["labels"] == ["none"]
    assert label["ratio"] == pytest.approx(1.0, abs=0.01)


def test_the_same_seed_makes_the_same_trial(healthy_trial):
    index, trial = healthy_trial
    again = make_trial(STANDARD, 2001, index)
    assert all(np.array_equal(a, b) for one, two in zip(trial.runs, again.runs)
               for a, b in zip(one, two))
    assert again.label == trial.label


@pytest.mark.parametrize("key, value", [("lag", 2e-3), ("limit", 1.0), ("gain", 1.1)])
def test_a_heated_motor_has_nothing_that_the_engine_leaves_out(quiet_robot, key, value):
    truth = {**quiet_robot().truth, "heating": np.array([100.0])}
    standard.check_drive(truth)
    with pytest.raises(RejectedError, match="winding"):
        standard.check_drive({**truth, key: np.array([value])})
