"""Insertion: same ports, defined order, the whole family of errors."""

import control as ct
import numpy as np
import pytest
from effect_runs import run_loop

from clie_blocks.compiled import compile_diagram
from clie_blocks.diagrams.clie_composite import clie_composite
from clie_blocks.diagrams.clie_loop import clie_loop
from clie_blocks.diagrams.feedback_linearization import feedback_linearization
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.effects import LIBRARY, with_effects
from clie_blocks.effects.blocks import Static
from clie_blocks.effects.body import plant_with_inertia
from clie_blocks.effects.effect import PORTS, SIMULATORS, Effect
from clie_blocks.effects.parameter import Parameter
from clie_blocks.effects.rewiring import controller_of, with_blocks
from clie_blocks.errors import ClieError
from clie_blocks.joints import decoupled_joints, inertial_joints
from clie_blocks.manipulator import two_link_arm
from clie_blocks.signals import DiagramError


def joints():
    return decoupled_joints([2.0, 2.4], [0.5, 0.6], [0.1, -0.2])


def arm():
    return two_link_arm([1.5, 0.8], [0.6, 0.5], [50, 50], [4e-4, 3e-4], [1e-3, 2e-3])


def points(system, count=10):
    rng = np.random.default_rng(2)
    return [(rng.random(), rng.normal(size=system.nstates), rng.normal(size=system.ninputs))
            for _ in range(count)]


def test_no_effects_leave_the_plant_as_it_is():
    plant = joints()
    assert with_effects(plant, []) is plant


def test_loads_are_subtracted_from_the_torque():
    plant = joints()
    affected = with_effects(plant, [LIBRARY["spring"](stiffness=0.4, hardening=0.0),
                                    LIBRARY["viscous"](extra=0.3)])
    for t, x, u in points(plant):
        torque = u - 0.4 * x[:2] - 0.3 * x[2:]
        np.testing.assert_allclose(affected.dynamics(t, x, u), plant.dynamics(t, x, torque),
                                   rtol=1e-13)


def test_a_plant_keeps_its_ports_and_its_parameters():
    plant = joints()
    affected = with_effects(plant, [LIBRARY["coulomb"](level=[0.2, 0.0])])
    assert affected.input_labels == plant.input_labels
    assert affected.output_labels == plant.output_labels
    assert {"plant.a", "coulomb.level", "coulomb.width"} <= set(affected.params)
    x, u = np.array([0, 0, 0.5, 0.5]), np.zeros(2)
    off = affected.dynamics(0, x, u, params={"coulomb.level": np.zeros(2)})
    np.testing.assert_array_equal(off, plant.dynamics(0, x, u))


def test_effects_reach_the_plant_inside_a_loop():
    effects = [LIBRARY["coulomb"](level=0.2), LIBRARY["torque_gain"](error=0.1)]
    outside = joint_loop(with_effects(joints(), effects), [10, 10], [5, 5])
    inside = with_effects(joint_loop(joints(), [10, 10], [5, 5]), effects)
    for t, x, u in points(outside):
        np.testing.assert_array_equal(outside.dynamics(t, x, u), inside.dynamics(t, x, u))
        np.testing.assert_array_equal(outside.output(t, x, u), inside.output(t, x, u))


def test_one_joint_alone_can_have_the_effect():
    plant = joints()
    affected = with_effects(plant, [LIBRARY["coulomb"](level=0.2, joints=[1])])
    change = affected.dynamics(0, [0, 0, 1.0, 1.0], [0, 0]) - plant.dynamics(
        0, [0, 0, 1.0, 1.0], [0, 0])
    np.testing.assert_allclose(change, [0, 0, 0, -0.2 * 0.6])


def test_the_same_effect_twice_needs_two_names():
    twice = [LIBRARY["periodic_disturbance"](sine=0.1, frequency=1.0),
             LIBRARY["periodic_disturbance"](sine=0.2, frequency=3.0, name="fan")]
    plant = with_effects(joints(), twice)
    torque = 0.1 * np.sin(0.5 * np.pi) + 0.2 * np.sin(1.5 * np.pi)
    np.testing.assert_allclose(plant.dynamics(0.25, np.zeros(4), np.zeros(2))[2:],
                               -torque * np.array([0.5, 0.6]) - [0.1, -0.2])
    with pytest.raises(DiagramError, match="two effects are called 'coulomb'.*name="):
        with_effects(joints(), [LIBRARY["coulomb"](level=1)] * 2)


@pytest.mark.parametrize("plant", [joints(), arm(), inertial_joints([2, 1.5], [4, 3], [0, 0])],
                         ids=["normalised", "arm", "physical"])
def test_no_extra_inertia_is_bitwise_the_plant(plant):
    heavier = plant_with_inertia(plant)
    for t, x, u in points(plant):
        np.testing.assert_array_equal(heavier.dynamics(t, x, np.concatenate((u, np.zeros(4)))),
                                      plant.dynamics(t, x, u))


def test_extra_inertia_on_the_full_arm_is_that_of_its_rotors():
    heavier = two_link_arm([1.5, 0.8], [0.6, 0.5], [50, 50], [6e-4, 3e-4], [1e-3, 2e-3])
    affected = with_effects(arm(), [LIBRARY["inertia"](extra=[50 * 2e-4, 0.0])])
    for t, x, u in points(heavier):
        np.testing.assert_allclose(affected.dynamics(t, x, u), heavier.dynamics(t, x, u),
                                   rtol=1e-9, atol=1e-9)


def test_rewiring_a_diagram_with_its_own_blocks_changes_nothing():
    loop = joint_loop(joints(), [10, 10], [5, 5])
    again = with_blocks(loop, {"plant": joints()})
    assert controller_of(loop, "plant") == "pd"
    for t, x, u in points(loop):
        np.testing.assert_array_equal(loop.dynamics(t, x, u), again.dynamics(t, x, u))
        np.testing.assert_array_equal(loop.output(t, x, u), again.output(t, x, u))


def test_effects_change_the_response_of_the_loop():
    plain = decoupled_joints([2.0], [0.5], [0.0])
    moved = run_loop(with_effects(plain, [LIBRARY["coulomb"](level=0.3)]), 1.0, 4.0)
    free = run_loop(plain, 1.0, 4.0)
    assert 0.3 / 10 * 0.5 < abs(moved.outputs[0][-1] - free.outputs[0][-1]) <= 0.3 / 10


def test_order_is_that_of_the_signals_then_that_of_the_list():
    gain, limit = LIBRARY["torque_gain"](error=1.0), LIBRARY["actuator_saturation"](limit=3.0)
    spring = LIBRARY["spring"](stiffness=1.0, hardening=0.0)
    x, u = np.array([0.5, 0, 0, 0]), np.array([2.0, 0.0])
    plant = joints()
    for effects, torque in (([gain, limit, spring], 3.0), ([spring, gain, limit], 3.0),
                            ([limit, gain, spring], 4.0), ([limit, spring, gain], 4.0)):
        np.testing.assert_allclose(with_effects(plant, effects).dynamics(0, x, u)[2],
                                   plant.dynamics(0, x, [torque - 0.5, 0.0])[2])


@pytest.mark.parametrize("seed", range(6))
def test_any_few_effects_go_together(seed):
    rng = np.random.default_rng(seed)
    two_bodies = {"joint_elasticity", "stiffening_elasticity", "backlash", "torsional_hysteresis"}
    names = rng.permutation([name for name in LIBRARY if name not in two_bodies])[:4]
    names = [str(name) for name in (*names, rng.choice(sorted(two_bodies)))]
    n = int(rng.integers(1, 4))
    plant = decoupled_joints(np.full(n, 2.0), np.full(n, 0.5), np.zeros(n))
    loop = with_effects(joint_loop(plant, np.full(n, 10.0), np.full(n, 5.0)),
                        [LIBRARY[name].typical() for name in names],
                        measured=str(rng.choice(["link", "motor"])))
    run = compile_diagram(loop).run(0.5, 2.5e-4, "ode4", inputs={
        "q_d": lambda t: 0.5 * np.sin(np.arange(n) + 2 * t), "pe": np.zeros(n)})
    assert 1e-3 < np.max(np.abs(run.outputs)) < 1e3


def test_a_linear_plant_takes_effects_too():
    a, b = np.diag([2.0, 2.4]), np.diag([0.5, 0.6])
    zero, eye = np.zeros((2, 2)), np.eye(2)
    linear = ct.ss(np.block([[zero, eye], [zero, -a]]), np.vstack((zero, b)), np.eye(4),
                   np.zeros((4, 2)), name="plant", inputs=joints().input_labels,
                   outputs=joints().output_labels, states=joints().state_labels)
    other = decoupled_joints([2.0, 2.4], [0.5, 0.6], [0.0, 0.0])
    effects = [LIBRARY["payload"](mass=2.0, length=0.6, gear_ratio=20),
               LIBRARY["coulomb"](level=0.2)]
    first, second = with_effects(linear, effects), with_effects(other, effects)
    for t, x, u in points(first):
        np.testing.assert_allclose(first.dynamics(t, x, u), second.dynamics(t, x, u), rtol=1e-12)
    compile_diagram(first)


def magnet_torque(q, strength):
    """Torque of a magnet that holds the joint near zero [N m]."""
    return strength * np.sin(8 * q)


def test_an_effect_of_ones_own_needs_no_place_in_the_catalogue():
    magnet = Effect(
        name="magnet", family="load", port="load", build=Static(magnet_torque, ("q",)),
        parameters=(Parameter("strength", "N m", 0.0, 10.0, 0.1, 0.0, "largest torque"),),
        equation="tau = strength sin(8 q)", reference="this test", signature="eight wells a turn",
        confused_with={"torque_ripple": "switch the drive off: a magnet stays"},
        simulators=dict.fromkeys(SIMULATORS, "none"), wrong="one harmonic")
    plant = joints()
    affected = with_effects(plant, [magnet(strength=0.3, joints=0)])
    for t, x, u in points(plant):
        torque = u - [0.3 * np.sin(8 * x[0]), 0.0]
        np.testing.assert_allclose(affected.dynamics(t, x, u), plant.dynamics(t, x, torque))


def test_settings_read_as_they_are_written():
    assert repr(LIBRARY["coulomb"](level=0.3)) == "coulomb(level=0.3)"
    assert repr(LIBRARY["coulomb"]) == "<effect coulomb(level, width) at the load>"


@pytest.mark.slow
def test_all_neutral_effects_at_once_are_bitwise_invisible():
    own_motion = {"stiffening_elasticity", "backlash", "torsional_hysteresis"}
    loop = joint_loop(joints(), [10, 10], [5, 5])
    neutral = [LIBRARY[name].neutral() for name in LIBRARY if name not in own_motion]
    affected = with_effects(loop, neutral)
    joint_states = [s for s in affected.state_labels
                    if s.endswith(tuple(f"plant_{label}" for label in joints().state_labels))]
    columns = [affected.state_labels.index(s) for s in joint_states]
    assert len(columns) == loop.nstates
    for t, x, u in points(loop):
        full = np.zeros(affected.nstates)
        full[columns] = x
        np.testing.assert_array_equal(affected.dynamics(t, full, u)[columns],
                                      loop.dynamics(t, x, u))
        np.testing.assert_array_equal(affected.output(t, full, u), loop.output(t, x, u))


DIAGRAMS = [
    joint_loop(joints(), [10, 10], [5, 5]),
    clie_loop(joints(), [10, 10], [5, 5], 20.0, velocity="filtered-both"),
    clie_composite(joints(), [10, 10], [5, 5], 20.0, 1e-4),
    feedback_linearization(joints(), np.array([2.0, 2.4, 0.5, 0.6, 0.1, -0.2]), [10, 10], [5, 5]),
]


@pytest.mark.parametrize("diagram", DIAGRAMS, ids=lambda diagram: diagram.name)
def test_every_diagram_takes_effects_at_every_port(diagram):
    names = ("actuator_saturation", "coulomb", "payload", "periodic_disturbance",
             "joint_elasticity", "encoder_offset", "channel_skew", "gain_error")
    assert {LIBRARY[name].port for name in names} == set(PORTS)
    affected = with_effects(diagram, [LIBRARY[name].typical() for name in names])
    assert affected.input_labels == diagram.input_labels
    assert affected.output_labels == diagram.output_labels
    compile_diagram(affected)  # which compares it with python-control


@pytest.mark.parametrize(("call", "text"), [
    (lambda: LIBRARY["culomb"], "no effect is called 'culomb'; did you mean 'coulomb'"),
    (lambda: LIBRARY["coulomb"](lvl=1.0), "no parameter 'lvl'; did you mean 'level'"),
    (lambda: LIBRARY["coulomb"](level=-1.0), r"level .* must lie within \[0, 100\] N m"),
    (lambda: LIBRARY["coulomb"](width=1e-3), "without a value for level it changes nothing"),
    (lambda: LIBRARY["coulomb"](level=1, joints=-1), "joints must be whole numbers from 0"),
    (lambda: LIBRARY["payload"](mass=1, joints=0), "acts on the robot as a whole"),
    (lambda: with_effects(joints(), [LIBRARY["coulomb"](level=1, joints=2)]),
     "the plant has 2; joints count from 0"),
    (lambda: with_effects(joints(), [LIBRARY["coulomb"](level=[1, 1, 1])]),
     "needs 2 numbers, one per joint"),
    (lambda: with_effects(joints(), ["coulomb"]), r"write LIBRARY\['coulomb'\]\(level=0.3\)"),
    (lambda: with_effects(joints(), [LIBRARY["coulomb"]]), "not an effect with its parameters"),
    (lambda: with_effects(joint_loop(joints(), [1, 1], [1, 1]), [LIBRARY["coulomb"](level=1)],
                          plant="robot"), "no block 'robot'"),
    (lambda: with_effects(with_effects(joints(), [LIBRARY["coulomb"](level=1)]),
                          [LIBRARY["inertia"](extra=1)]), "in one call of with_effects"),
])
def test_mistakes_are_told_with_their_remedy(call, text):
    with pytest.raises(ClieError, match=text):
        call()
