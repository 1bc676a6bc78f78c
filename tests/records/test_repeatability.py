"""The noise floor: measured where motion repeats, guessed with a caveat where it does not."""

import numpy as np
import pytest

from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.read import read_records
from clie_blocks.analysis.records.repeatability import noise_floor, repeated_period, roughness

STEP, NOISE = 1e-3, 3e-4


def periodic(periods=5, length=1500, noise=NOISE, seed=0, slow=0.0):
    """Reference of a fixed period, a position that follows it late, white and slow noise."""
    k = np.arange(periods * length)
    angle = 2 * np.pi * k / length
    random = np.random.default_rng(seed)
    drift = slow * np.sin(2 * np.pi * k / (7.3 * length) + random.uniform(0, 6))
    q = 0.4 * np.sin(angle - 0.3) + 0.1 * np.sin(3 * angle) + drift
    return Record(k * STEP, q + noise * random.standard_normal(k.size), qd=0.4 * np.sin(angle))


def test_periods_measure_the_noise_including_its_slow_part():
    floor = noise_floor(periodic())
    assert (floor.method, floor.repeats, floor.caveat) == ("periods", 4, "")
    assert floor.std[0] == pytest.approx(NOISE, rel=0.05)
    assert noise_floor(periodic(slow=3e-3)).std[0] > 3 * NOISE


def test_a_slow_transient_at_the_start_is_no_noise():
    record = periodic(periods=8)
    settling = 0.5 * np.exp(-np.arange(len(record)) / 400)
    late = record.replace(q=record.q + settling[:, None])
    assert noise_floor(late).std[0] == pytest.approx(NOISE, rel=0.05)


def test_the_period_is_exact_and_none_is_seen_where_there_is_none():
    record = periodic()
    assert repeated_period(record, 0, len(record)) == 1500
    k = np.arange(len(record))
    chirp = record.replace(qd=np.sin(1e-3 * k + 1e-6 * k**2))
    assert repeated_period(chirp, 0, len(chirp)) == 0


def test_repeated_runs_measure_it_too():
    one, two, three = (periodic(periods=2, seed=seed) for seed in range(3))
    floor = noise_floor(one, two, three)
    assert (floor.method, floor.repeats) == ("runs", 3)
    assert floor.std[0] == pytest.approx(NOISE, rel=0.05)


def test_repeated_runs_are_known_by_what_both_have_logged():
    one, two = (periodic(periods=2, seed=seed) for seed in range(2))
    reference = one.qd.copy()
    reference[[40, 900]] = np.nan
    floor = noise_floor(one.replace(qd=reference), two)
    assert (floor.method, floor.repeats) == ("runs", 2)


def test_a_run_with_another_reference_is_no_repeat():
    other = periodic(periods=2, length=1400)
    assert noise_floor(periodic(periods=2), other).method == "second difference"


def test_without_repeats_white_noise_is_seen_and_the_caveat_is_said():
    floor = noise_floor(periodic(periods=2))
    assert floor.method == "second difference"
    assert floor.std[0] == pytest.approx(NOISE, rel=0.05)
    assert "no motion repeats" in floor.caveat
    assert "filtered" not in floor.caveat


def test_a_filtered_position_is_said_to_be_filtered():
    record = periodic(periods=2)
    smooth = np.convolve(record.q[:, 0], np.ones(15) / 15, "same")
    filtered = record.replace(q=smooth)
    assert roughness(filtered)[1][0] < 0.8
    assert "filtered before it was logged" in noise_floor(filtered).caveat


def test_the_emps_machine_repeats_to_a_fraction_of_a_micrometre(shared):
    floor = noise_floor(read_records(shared / "data/emps")[0])
    assert floor.method == "periods"
    assert 1e-7 < floor.std[0] < 4e-7
