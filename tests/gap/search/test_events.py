"""Onsets of a fault in several logs, beside parameters that were fitted to them."""

import numpy as np
import pytest

from clie_blocks.analysis.gap.search.events import Scan, _common_size

ONSETS = (20, 60, 100, 140)
ROWS = 200


def _faults(rng):
    """A course of torque per log from each onset on, and what two fitted parameters do."""
    course = rng.standard_normal((2, ROWS)) + 1.0
    faults = [np.stack([np.where(np.arange(ROWS) >= onset, of_log, 0.0) for onset in ONSETS], 1)
              for of_log in course]
    return faults, [np.stack([of_log, np.ones(ROWS)], 1) for of_log in course]


def _scans(faults, parameters, error):
    basis, _ = np.linalg.qr(np.concatenate(parameters))
    left = error - basis @ (basis.T @ error)
    return [Scan(fault.T @ own, (fault**2).sum(axis=0), fault.T @ of_log)
            for fault, own, of_log in zip(faults, np.split(left, 2), np.split(basis, 2))]


def _drop(faults, parameters, error, places):
    """Second route: chi^2 of a least squares without the fault less that of one with it."""
    columns = np.concatenate(parameters)
    fault = np.concatenate([0.0 * of_log[:, 0] if place is None else of_log[:, place]
                            for of_log, place in zip(faults, places)])
    without, with_it = (
        np.sum((error - x @ np.linalg.lstsq(x, error, rcond=None)[0]) ** 2)
        for x in (columns, np.column_stack([columns, fault])))
    return without - with_it


@pytest.mark.parametrize("seed", range(10))
def test_the_drop_is_that_of_a_least_squares_with_the_parameters(seed):
    rng = np.random.default_rng(seed)
    faults, parameters = _faults(rng)
    error = rng.standard_normal(2 * ROWS)
    _, places, drop = _common_size(_scans(faults, parameters, error), 2)
    assert drop == pytest.approx(_drop(faults, parameters, error, places), rel=1e-4)


@pytest.mark.parametrize("seed", range(10))
def test_onsets_are_found_although_a_fit_has_absorbed_most_of_the_fault(seed):
    rng = np.random.default_rng(100 + seed)
    faults, parameters = _faults(rng)
    true = [1, 3]
    fault = np.concatenate([of_log[:, place] for of_log, place in zip(faults, true)])
    columns = np.concatenate(parameters)
    absorbed = columns @ np.linalg.lstsq(columns, fault, rcond=None)[0]
    error = 0.7 * (fault - absorbed) + 0.05 * rng.standard_normal(2 * ROWS)
    size, places, _ = _common_size(_scans(faults, parameters, error), 2)
    assert places == true
    assert size == pytest.approx(0.7, abs=0.05)


def test_a_log_without_the_fault_has_no_onset():
    rng = np.random.default_rng(7)
    faults, _ = _faults(rng)
    nothing = [np.zeros((ROWS, 1))] * 2
    error = np.concatenate([faults[0][:, 2], np.zeros(ROWS)])
    scans = [Scan(fault.T @ own, (fault**2).sum(axis=0), fault.T @ of_log)
             for fault, own, of_log in zip(faults, np.split(error, 2), nothing)]
    _, places, _ = _common_size(scans, 2)
    assert places == [2, None]


def test_a_held_out_log_takes_the_size_of_the_others():
    rng = np.random.default_rng(9)
    faults, parameters = _faults(rng)
    scans = _scans(faults, parameters, np.concatenate([faults[0][:, 1], faults[1][:, 3]]))
    held_out = Scan(faults[0].T @ faults[0][:, 2], (faults[0]**2).sum(axis=0),
                    np.zeros((len(ONSETS), 2)))
    _, places, _ = _common_size([*scans, held_out], 2)
    assert places == [1, 3, 2]
