"""Every effect that MuJoCo holds moves the joint there as the corrected model does here."""

import re
from pathlib import Path

import pytest

from clie_blocks.analysis.export import truth_table
from clie_blocks.analysis.export.mujoco_model import corrected_model
from clie_blocks.analysis.export.mujoco_split import split
from clie_blocks.analysis.export.mujoco_stub import stub
from clie_blocks.analysis.export.mujoco_target import export_mujoco
from clie_blocks.effects import LIBRARY
from tests.export import robots

mujoco = pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
PAGE = (Path(__file__).parents[2] / "docs" / "export.md").read_text()
NOISE = 1e-4  # rad, of an encoder of 12 bits at such a joint
ALLOWED = 1.2 * NOISE
OWN_STEP = 2e-3  # s, of MuJoCo where a file states none


def effects_in(*kinds):
    """Effects of one joint that MuJoCo holds in some ways."""
    return [name for name in LIBRARY if truth_table.support(name, "mujoco").kind in kinds
            and name not in (*truth_table.IN_THE_MODEL, "payload", "coupled_joints")]


IN_ELEMENTS = effects_in(truth_table.NATIVE, truth_table.EXTRA_BODY)
BESIDE = effects_in(truth_table.MODULE)
# What docs/export.md says to differ by more, and why: bound [rad].
COARSE = {"back_emf": 2e-4, "soft_stop": 4.2e-4}


def test_the_joint_model_alone_moves_as_here():
    left, _ = robots.difference()
    assert left < ALLOWED / 2


NUMBERS = {  # of the joint: in the answer, and how the package's own robot is told the same
    "inertia": ({"inertia": 0.03, "beside_links": 0.03}, {"inertia": 0.03}, ()),
    "viscous": ({"damping": 0.09}, {"damping": 0.09}, ()),
    "offset": ({"offset": 0.06}, {"load": -0.06}, ()),
    "torque_gain": ({"gain": 1.2}, {}, (robots.setting("torque_gain_error", error=0.2),))}


@pytest.mark.parametrize("name", NUMBERS)
def test_a_number_of_the_joint_moves_as_here(name):
    assert set(NUMBERS) == set(truth_table.IN_THE_MODEL)
    exported, here, effects = NUMBERS[name]
    q_d = robots.set_points(0.6)
    found = robots.in_mujoco(export_mujoco(robots.correction(**exported)), q_d)
    expected = robots.reference(effects, q_d, **here)
    moved = robots.rms(expected - robots.reference((), q_d))
    assert robots.rms(found - expected) < ALLOWED and robots.rms(found - expected) < moved / 10


def test_a_payload_weighs_and_swings_as_here(tmp_path):
    """For one joint it is an inertia and a weight; the arm is along x, and lifts by +q."""
    mass, length, g = 0.1, 0.3, 9.81
    own = tmp_path / "own.xml"
    own.write_text(stub(robots.correction()).replace('gravity="0 0 0"', 'gravity="0 0 -9.81"'))
    load = robots.setting("payload", mass=mass, length=length, gear_ratio=1.0)
    weight = robots.setting("gravity", weight=mass * length * g, gear_ratio=1.0)
    q_d = robots.set_points(0.6)
    found = robots.in_mujoco(export_mujoco(robots.correction(load), own), q_d)
    expected = robots.reference((weight,), q_d, inertia=robots.INERTIA + mass * length**2)
    moved = robots.rms(expected - robots.reference((), q_d))
    assert robots.rms(found - expected) < ALLOWED and robots.rms(found - expected) < moved / 10


@pytest.mark.parametrize("name", IN_ELEMENTS)
def test_an_effect_in_elements_of_mujoco_moves_as_here(name):
    left, moved = robots.difference(robots.setting(name))
    assert left < ALLOWED and left < moved / (1.5 if name == "joint_elasticity" else 10)


def test_the_list_of_native_effects_is_not_empty():
    assert {"coulomb", "spring", "actuator_lag", "time_delay", "joint_elasticity"} <= set(
        IN_ELEMENTS)


@pytest.mark.slow
@pytest.mark.parametrize("name", BESIDE)
def test_an_effect_in_the_module_beside_the_model_moves_as_here(name):
    left, moved = robots.difference(robots.setting(name), seconds=0.6)
    assert left < COARSE.get(name, ALLOWED) and left < max(moved / 2, ALLOWED / 10)


@pytest.mark.parametrize("name", [None, *IN_ELEMENTS, *BESIDE])
def test_at_the_step_of_mujoco_it_moves_as_the_page_says(name):
    """By Runge and Kutta within the noise; by Euler's method, which is its own, as listed."""
    effects = [robots.setting(name)] if name else []
    table = PAGE[PAGE.index("| what it does |"):]
    cells = re.search(rf"\n\| {name or 'none'}(?: \(module\))? \|(.*)\|\n", table)[1].split("|")
    stated = [float(cell) for cell in cells[2:]]
    found = [robots.difference(*effects, period=OWN_STEP, step=OWN_STEP, integrator=integrator)[0]
             for integrator in ("RK4", "Euler", "implicitfast")]
    assert found[0] < COARSE.get(name, ALLOWED)
    assert all(one < 1.1 * told + 1e-6 for one, told in zip(found, stated, strict=True))


@pytest.mark.parametrize("step", [1.25e-4, OWN_STEP])
def test_dry_friction_creeps_as_the_page_says(step):
    """A joint under half of its friction, which the defaults of the engine let go."""
    corrected = robots.correction(robots.setting("coulomb"), offset=0.0, damping=0.0)
    text = re.sub('timestep="[^"]*"', f'timestep="{step}"', stub(corrected))
    speeds = []
    for change in (lambda found: found,
                   lambda found: re.sub(' sol(?:reffriction|impfriction)="[^"]*"', "", found)):
        model = mujoco.MjModel.from_xml_string(change(
            corrected_model(corrected, text, "own.xml").text))
        data = mujoco.MjData(model)
        data.ctrl[0] = 0.05
        mujoco.mj_step(model, data, round(1.0 / step))
        speeds.append(data.qvel[0])
    assert speeds[1] == pytest.approx(2.6e-3, rel=0.05)
    assert speeds[0] == pytest.approx({1.25e-4: 3e-8, OWN_STEP: 5e-7}[step], rel=0.1)
    assert "creeps at 3e-08 rad/s at 0.125 ms, 5e-07 rad/s at 2 ms" in " ".join(PAGE.split())


def test_effects_of_both_kinds_act_together():
    left, moved = robots.difference(robots.setting("coulomb"), robots.setting("torque_ripple"),
                                    robots.setting("actuator_lag"), seconds=0.5)
    assert left < ALLOWED and left < moved / 10


def test_a_limit_behind_a_lag_runs_in_the_module_since_mujoco_limits_before_it():
    lag, limit = robots.setting("actuator_lag"), robots.setting("actuator_saturation")
    before, behind = (split(robots.correction(*order), 0) for order in (
        (limit, lag), (lag, limit)))
    assert before.native == (limit, lag) and not before.block
    assert behind.block == (lag, limit) and not behind.native


def test_friction_that_is_not_native_takes_all_dry_friction_of_the_joint_along():
    found = split(robots.correction(robots.setting("coulomb"), robots.setting("stribeck")), 0)
    assert not found.native and len(found.block) == 2
