"""Logs with gaps, lost rows, bad clocks, several rates, slow rates and few samples."""

import numpy as np
import pytest

from clie_blocks.analysis.gap import Problem, diagnose
from clie_blocks.analysis.gap.calibration.robots import draw_cases

pytestmark = pytest.mark.slow
SEED = 5  # of the robots, and of the damage


def with_gap(record, rng):
    """One gap of 50 ms."""
    first = len(record) // 2 + rng.integers(-1000, 1000)
    return rows(record, np.delete(np.arange(len(record)), np.arange(first, first + 50)))


def with_lost_rows(record, rng):
    """Twenty lost rows."""
    return rows(record, np.delete(np.arange(len(record)),
                                  rng.choice(np.arange(1, len(record) - 1), 20, replace=False)))


def with_reset(record, rng):
    """A clock that begins anew in the middle of the log."""
    middle = len(record) // 2
    time = record.time.copy()
    time[middle:] -= time[middle]
    return record.replace(time=time)


def with_restart(record, rng):
    """A logger that was started again, after rows that nobody has."""
    middle = (len(record) - 300) // 2
    kept = np.delete(np.arange(len(record)), np.arange(middle, middle + 300))
    return with_reset(rows(record, kept), rng)


def with_nan(record, rng):
    """Ten values that are not a number."""
    signals = {name: getattr(record, name).copy() for name in record.signals}
    for _ in range(10):
        signals[rng.choice(list(signals))][rng.integers(1, len(record) - 1)] = np.nan
    finite = np.all([np.isfinite(signal).all(axis=1) for signal in signals.values()], axis=0)
    return record.replace(**signals, valid=finite)


def with_jitter(record, rng):
    """Stamps that vary by 3 % of the step."""
    return record.replace(time=record.time + 0.03 * record.sample_time * rng.standard_normal(
        len(record)))


def with_coarse_clock(record, rng):
    """Stamps of a clock that ticks every 15.6 ms."""
    return record.replace(time=0.0156 * np.floor(record.time / 0.0156))


def at_half_rate(record, rng):
    """Every second sample."""
    return rows(record, np.arange(0, len(record), 2))


def rows(record, kept):
    changes = {name: getattr(record, name)[kept] for name in ("time", "valid", *record.signals)}
    return record.replace(**changes, segments=())


DAMAGES = (with_gap, with_lost_rows, with_reset, with_restart, with_nan, with_jitter,
           with_coarse_clock, at_half_rate)


@pytest.fixture(scope="module")
def robots():
    """Robot with Coulomb friction and a sound one, with the diagnoses of their clean logs."""
    drawn = {name: draw_cases(1, SEED, ["coulomb"], [kind], duration=20.0)[0]
             for name, kind in (("coulomb", "single"), ("none", "none"))}
    return {name: (case, diagnose(Problem.from_logs(case.robot, case.records)).to_dict())
            for name, case in drawn.items()}


def diagnosed(case, damage, which=slice(None)):
    rng = np.random.default_rng(SEED)
    records = list(case.records)
    records[which] = [damage(record, rng) for record in records[which]]
    return diagnose(Problem.from_logs(case.robot, records)).to_dict()


@pytest.mark.parametrize("damage", DAMAGES)
def test_the_answer_is_that_of_the_clean_log(robots, damage):
    case, clean = robots["coulomb"]
    answer = diagnosed(case, damage)
    assert clean["effects"][0]["effect"] == answer["effects"][0]["effect"] == "coulomb"
    assert answer["verdict"] == clean["verdict"]
    assert answer["effects"][0]["probability"] == pytest.approx(
        clean["effects"][0]["probability"], abs=0.2)
    assert answer["closed_percent"]["value"] == pytest.approx(
        clean["closed_percent"]["value"], abs=2.0)


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_sound_robot_stays_sound(robots, damage):
    assert diagnosed(robots["none"][0], damage)["verdict"] == "none"


def test_each_log_keeps_its_own_step(robots):
    case, clean = robots["coulomb"]
    answer = diagnosed(case, at_half_rate, slice(1, 2))
    assert answer["effects"][0]["effect"] == "coulomb"
    assert answer["closed_percent"]["value"] == pytest.approx(
        clean["closed_percent"]["value"], abs=2.0)


@pytest.mark.parametrize("samples", [400, 600, 2000])
def test_short_logs_are_answered(robots, samples):
    for name in ("coulomb", "none"):
        case, _ = robots[name]
        answer = diagnosed(case, lambda record, rng: rows(record, np.arange(samples)))
        leading = answer["effects"][0]
        assert leading["effect"] in (name, "unknown") or leading["probability"] < 0.5
