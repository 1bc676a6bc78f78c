"""The band of exported samples, and the model into which a correction is exported."""

import types

import numpy as np
import pytest
from scipy.stats import norm

from clie_blocks.analysis.blind.exported import study
from clie_blocks.analysis.blind.exported.measure import coverage, own_model
from clie_blocks.analysis.blind.exported.study import score, terminal_lines
from clie_blocks.analysis.blind.population.effects import EFFECTS
from clie_blocks.analysis.blind.population.one_joint import NAMES, PENDULUMS
from clie_blocks.analysis.export import truth_table
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.robot_sections import Links, Motor, Nominal
from clie_blocks.errors import ClieError


@pytest.mark.parametrize("spread", [0.2, 1.0, 1.5])
def test_the_band_holds_nine_tenths_only_if_its_width_is_right(spread):
    """Models that are off by a fifth of what the truth is, by as much, and by more.

    The band then has the width of a normal distribution of their spread and the noise.
    """
    rng = np.random.default_rng(0)
    noise, samples, count = 0.1, 200, 4000
    truth = rng.standard_normal(count)  # of a parameter, another one at every sample
    measured = truth + noise * rng.standard_normal(count)
    models = spread * rng.standard_normal((samples, count))
    band = 1.645 * np.hypot(spread, noise) / np.hypot(1.0, noise)
    assert coverage(measured - models, noise) == pytest.approx(
        norm.cdf(band) - norm.cdf(-band), abs=0.02)


def test_without_uncertainty_the_noise_is_the_band():
    rng = np.random.default_rng(1)
    errors = 0.3 * rng.standard_normal((1, 20_000))
    assert coverage(errors, 0.3) == pytest.approx(0.9, abs=0.01)
    assert coverage(errors + 1.0, 0.3) < 0.1  # a bias that no sample has


def robot(**links):
    return Robot(n=1, name="one", joints=("hinge",), links=Links(**links),
                 motor=Motor(gear_ratio=[4.0]), nominal=Nominal(gravity=True))


def test_the_model_has_the_stated_link_and_gear():
    mujoco = pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")
    stated = robot(length=[0.4], mass=[1.5], com=[0.2], inertia=[0.01])
    model = mujoco.MjModel.from_xml_string(own_model(stated, 1e-3))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.qfrc_bias[0] == pytest.approx(1.5 * stated.nominal.g * 0.2)  # horizontal at zero
    assert model.dof_M0[0] == pytest.approx(0.01 + 1.5 * 0.2**2)
    assert model.actuator_gear[0, 0] == 4.0
    assert 1e-3 / model.opt.timestep == pytest.approx(round(1e-3 / model.opt.timestep))
    with pytest.raises(ClieError, match="no link is stated"):
        own_model(robot(), 1e-3)


def test_only_right_diagnoses_are_scored():
    rows = [{"trial": "a", "effect": "spring", "right": True, "ratio": 1.0, "package_ratio": 1.0,
             "coverage": 0.9, "module": False},
            {"trial": "b", "effect": "dahl", "right": True, "ratio": 1.3, "package_ratio": 1.1,
             "coverage": None, "module": True},
            {"trial": "c", "effect": "dahl", "right": False},
            {"trial": "d", "effect": "gravity", "right": True, "refused": "no link"}]
    board = score(rows)
    assert board["right"] == 3 and board["refused"] == ["d"]
    assert board["ratio"]["median"] == pytest.approx(1.15) and board["coverage"]["value"] == 0.9
    told = "\n".join(terminal_lines({**board, "command": "clie blind", "trials": rows}))
    assert "b: dahl, 1.300, module" in told and "not exported: no link" in told
    assert types.SimpleNamespace(**score([])).ratio["median"] is None


def test_a_study_that_was_stopped_measures_only_what_is_missing(tmp_path, monkeypatch):
    measured = []
    monkeypatch.setattr(study, "_row", lambda trial, answer, label: (
        measured.append(trial.name), {"right": True, "ratio": 1.25})[1])
    for _ in range(2):
        rows = [study._kept_row(tmp_path, name, {}, {}) for name in ("trial-000", "trial-001")]
    assert measured == ["trial-000", "trial-001"]
    assert [row["ratio"] for row in rows] == [1.25, 1.25]


def test_the_study_draws_every_effect_that_an_export_to_mujoco_brings_in():
    held = [name for name in EFFECTS if truth_table.support(name, "mujoco").kind not in (
        truth_table.CONTROLLER, truth_table.BODIES, truth_table.NOT)]
    assert sorted(NAMES) == sorted(held)
    assert {needs[0] for needs in PENDULUMS.needs.values()} == {("pendulum",)}
