"""What holds for every effect of the catalogue, by listing alone."""

import json
import math

import numpy as np
import pytest

from clie_blocks.compiled import compile_diagram
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.effects import LIBRARY, with_effects
from clie_blocks.effects.blocks import Static
from clie_blocks.effects.effect import FAMILIES, PORTS, SIMULATORS, SYMMETRIES
from clie_blocks.joints import decoupled_joints
from clie_blocks.signals import ports

N = 2
VOCABULARY = set("""
    coulomb stribeck asymmetric_coulomb quadratic_drag load_dependent_friction presliding dahl
    maxwell_slip position_dependent_friction friction_drift rest_time_breakaway
    directional_efficiency gravity payload coupling spring base_tilt counterbalance soft_stop
    fluid_drag joint_elasticity stiffening_elasticity backlash torsional_hysteresis
    kinematic_error gear_mesh_ripple coupled_joints ratio_error actuator_saturation
    torque_speed_limit dead_zone actuator_lag torque_ripple commutation_ripple torque_gain_error
    back_emf supply_sag motor_heating torque_quantization torque_slew setpoint_slew time_delay
    in_loop_delay tick_jitter packet_hold velocity_filter_mismatch gain_error control_law_form
    hidden_integral hidden_compensation encoder_quantization encoder_eccentricity encoder_offset
    velocity_estimate_lag channel_skew sensor_gain periodic_disturbance step_fault inertia
    viscous torque_gain offset""".split())
EFFECTS = [pytest.param(LIBRARY[name], id=name) for name in LIBRARY]
PER_JOINT = [case for case in EFFECTS if case.values[0].per_joint]


def plain_loop():
    return joint_loop(decoupled_joints([2.0, 2.4], [0.5, 0.6], [0.1, -0.2]), [10, 10], [5, 5])


def loop_with(setting):
    return with_effects(plain_loop(), [setting])


def random_points(system, base_states, *, count=20, seed=3):
    """Random times, states and inputs; states of the effect itself start at rest."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        x = np.zeros(system.nstates)
        for label, value in base_states.items():
            x[system.state_labels.index(label)] = value * rng.normal()
        yield 10 * rng.random(), x, rng.normal(size=system.ninputs)


def plant_states(loop):
    """Labels of the joints' own states inside a loop with effects or without."""
    return [s for s in loop.state_labels if s.rpartition("plant_")[2] in
            {"q[0]", "q[1]", "dq[0]", "dq[1]"} and "plant" in s]


@pytest.mark.parametrize("effect", EFFECTS)
def test_facts_are_complete(effect):
    assert LIBRARY[effect.name] is effect
    assert effect.family in FAMILIES and effect.port in PORTS and effect.symmetry in SYMMETRIES
    assert set(effect.simulators) == set(SIMULATORS)
    for text in (effect.equation, effect.reference, effect.signature, effect.wrong):
        assert len(text) > 10
    assert effect.build.kernel.__doc__
    assert effect.confused_with and all(len(e) > 10 for e in effect.confused_with.values())
    assert effect.name not in effect.confused_with
    json.dumps(effect.as_dict(), allow_nan=False)


def test_confusions_name_effects_of_the_vocabulary():
    named = {other for name in LIBRARY for other in LIBRARY[name].confused_with}
    assert named <= VOCABULARY, sorted(named - VOCABULARY)


@pytest.mark.parametrize("effect", EFFECTS)
def test_bounds_are_ordered_and_hold_the_typical_value(effect):
    assert any(p.neutral is not None for p in effect.parameters)
    for p in effect.parameters:
        assert p.lower < p.upper and p.lower <= p.typical <= p.upper, p.name
        assert p.neutral is None or p.lower <= p.neutral <= p.upper, p.name
        assert p.unit and p.meaning and not math.isnan(p.lower + p.upper)
    assert any(p.neutral is not None and p.typical != p.neutral for p in effect.parameters)


@pytest.mark.parametrize("effect", EFFECTS)
def test_ports_stay_those_of_the_loop(effect):
    plain, affected = plain_loop(), loop_with(effect.typical())
    assert affected.input_labels == plain.input_labels
    assert affected.output_labels == plain.output_labels
    assert affected.name == plain.name


@pytest.mark.parametrize("effect", EFFECTS)
def test_neutral_is_bitwise_invisible(effect):
    plain, affected = plain_loop(), loop_with(effect.neutral())
    joints = plant_states(affected)
    columns = [affected.state_labels.index(s) for s in joints]
    assert len(joints) == plain.nstates
    for t, x, u in random_points(affected, dict.fromkeys(joints, 1.0)):
        np.testing.assert_array_equal(affected.dynamics(t, x, u)[columns],
                                      plain.dynamics(t, x[columns], u))
        np.testing.assert_array_equal(affected.output(t, x, u), plain.output(t, x[columns], u))


@pytest.mark.parametrize("effect", PER_JOINT)
def test_joints_are_independent_unless_stated(effect):
    block = effect.typical().block(N)
    rng = np.random.default_rng(1)
    of_second = np.array([label.endswith("[1]") for label in block.input_labels])
    x = np.zeros(block.nstates)
    u = rng.normal(size=block.ninputs)
    changed = np.where(of_second, u + 1.0, u)
    first = [k for k, label in enumerate(block.output_labels) if label.endswith("[0]")]
    np.testing.assert_array_equal(block.output(0.3, x, u)[first],
                                  block.output(0.3, x, changed)[first])


@pytest.mark.parametrize("effect", PER_JOINT)
def test_effect_on_one_joint_leaves_the_other_untouched(effect):
    plain, affected = plain_loop(), loop_with(effect.typical(joints=1))
    joints = plant_states(affected)
    columns = [affected.state_labels.index(s) for s in joints]
    other = [k for k, s in enumerate(plain.state_labels) if s.endswith("[0]")]
    for t, x, u in random_points(affected, dict.fromkeys(joints, 1.0)):
        np.testing.assert_array_equal(affected.dynamics(t, x, u)[columns][other],
                                      plain.dynamics(t, x[columns], u)[other])


@pytest.mark.parametrize("effect", EFFECTS)
def test_typical_effect_changes_the_loop(effect):
    plain, affected = plain_loop(), loop_with(effect.typical())
    joints = plant_states(affected)
    columns = [affected.state_labels.index(s) for s in joints]
    changes = []
    for t, x, u in random_points(affected, dict.fromkeys(joints, 1.0)):
        x = x + 1e-3 * np.array([s not in joints for s in affected.state_labels])
        changes += [affected.dynamics(t, x, u)[columns] - plain.dynamics(t, x[columns], u),
                    affected.output(t, x, u) - plain.output(t, x[columns], u)]
    assert max(np.max(np.abs(change)) for change in changes) > 1e-6


@pytest.mark.parametrize("effect", EFFECTS)
def test_compiled_is_interpreted(effect):
    """The compiler compares the program with the diagram at random points, or raises."""
    program = compile_diagram(loop_with(effect.typical()))
    response = program.run(0.05, 1e-3, inputs={"q_d": [0.3, -0.2], "pe": [0.1, 0.1]})
    assert np.all(np.isfinite(response.outputs)) and np.any(response.outputs != 0)


STATIC = [case for case in EFFECTS if isinstance(case.values[0].build, Static)
          and set(case.values[0].build.inputs) - {"t"}]


@pytest.mark.parametrize("effect", STATIC)
def test_kernel_takes_a_whole_record_at_once(effect):
    """Rows of a record as one array, as a regression needs it, equal the block row by row."""
    setting = effect.typical()
    block, kernel = setting.block(N), effect.build.kernel
    rng = np.random.default_rng(8)
    t, rows = np.linspace(0, 10, 25)[:, None], {
        name: rng.normal(size=(25, N)) for name in effect.build.inputs if name != "t"}
    found = kernel(*(t if name == "t" else rows[name] for name in effect.build.inputs),
                   **setting.vectors(N))
    parts = [part.reshape(25, -1) for part in (found if isinstance(found, tuple) else (found,))]
    together = np.concatenate(parts, axis=1)
    for k in range(25):
        u = np.concatenate([rows[name][k] for name in rows])
        np.testing.assert_allclose(together[k], block.output(t[k, 0], np.zeros(0), u),
                                   rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("effect", [c for c in EFFECTS if c.values[0].curve is not None])
def test_characteristic_can_be_drawn_and_is_on_the_block(effect):
    x, y = effect.typical().characteristic()
    assert x.shape == y.shape and np.all(np.isfinite(y)) and np.ptp(x) > 0
    kind, curve = effect.typical().block(N).icon
    assert kind == "curve"
    np.testing.assert_array_equal(np.array(list(curve)), np.array([x, y]))


def motion(duration=4.0, step=2e-3, seed=0, n=N):
    """Random smooth periodic motion over two laps: t, q, dq, ddq."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, 2 * duration + step / 2, step)
    w = 2 * np.pi / duration * np.arange(1, 6)[:, None, None]
    a, phase = rng.normal(size=(5, 1, n)) / w, 2 * np.pi * rng.random((5, 1, n))
    angle = w * t[None, :, None] + phase
    other = np.sin(1.7 * t + seed)[:, None] * np.ones(n)
    return t, {"q_d": other, "pe": 0.5 * other, "q": np.sum(a * np.sin(angle), axis=0),
               "dq": np.sum(a * w * np.cos(angle), axis=0),
               "ddq": np.sum(-a * w**2 * np.sin(angle), axis=0),
               "u": 3 * np.sin(1.3 * t)[:, None] * np.ones(n)}


def outputs_along(block, t, signals):
    """Outputs of a block along signals, inertia as its torque; its state by Heun's method."""
    inputs = np.concatenate([np.zeros((len(t), 0))] + [
        signals[base] for base in ports(block.input_labels)], axis=1)
    x, rows = np.zeros(block.nstates), []
    for k, u in enumerate(inputs):
        rows.append(block.output(t[k], x, u))
        if block.nstates and k + 1 < len(t):
            h = t[k + 1] - t[k]
            slope = block.dynamics(t[k], x, u)
            x = x + h / 2 * (slope + block.dynamics(t[k + 1], x + h * slope, inputs[k + 1]))
    rows = np.array(rows)
    found = {name: rows[:, columns] for name, columns in ports(block.output_labels).items()}
    if "inertia" in found:
        matrices = found.pop("inertia").reshape(-1, N, N)
        found["inertial"] = np.einsum("tij,tj->ti", matrices, signals["ddq"])
    return found


LOADS = [pytest.param(LIBRARY[name], id=name) for name in LIBRARY
         if {"tau", "inertia"} & set(LIBRARY[name].build.outputs)
         and LIBRARY[name].port != "transmission"]


@pytest.mark.parametrize("effect", [p for p in LOADS if p.values[0].passive])
def test_passive_effects_take_energy_over_any_closed_motion(effect):
    block = effect.typical().block(N)
    for seed in range(2):
        t, signals = motion(duration=2.0, seed=seed)
        found = outputs_along(block, t, signals)
        torque = sum(found[name] for name in ("tau", "inertial") if name in found)
        power = np.sum(torque * signals["dq"], axis=1)
        lap = slice(len(t) // 2, None)
        work = np.trapezoid(power[lap], t[lap])
        scale = np.trapezoid(np.abs(power[lap]), t[lap])
        assert work >= -1e-3 * scale, f"gives {-work} J in a lap"


@pytest.mark.parametrize("effect", [p for p in EFFECTS if p.values[0].symmetry != "none"])
def test_symmetry_is_as_stated(effect):
    block = effect.typical().block(N)
    t, signals = motion(duration=0.02, step=1e-4, seed=5)
    t = t + 0.5  # past the first moments, in which some hold still
    signals["q"] *= 2.0 / np.max(np.abs(signals["q"]))  # far enough to reach a stop
    signals["u"] = 3.0 * np.sin(200.0 * t)[:, None] * np.ones(N)
    forward = outputs_along(block, t, signals)
    backward = outputs_along(block, t, {key: -value for key, value in signals.items()})
    sign = -1.0 if effect.symmetry == "odd" else 1.0
    for name, values in forward.items():
        np.testing.assert_allclose(backward[name], sign * values,
                                   atol=1e-12 * (1e-3 + np.max(np.abs(values))))
    assert max(np.max(np.abs(values)) for values in forward.values()) > 0
