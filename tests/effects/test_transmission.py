"""Transmission: two bodies against closed forms, energy, the link's motion."""

import control as ct
import numpy as np
import pytest
from effect_runs import run_plant

from clie_blocks.compiled import compile_diagram
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.effects import LIBRARY, with_effects
from clie_blocks.joints import inertial_joints
from clie_blocks.manipulator import two_link_arm
from clie_blocks.signals import DiagramError

MOTOR, LINK, STIFFNESS = 1.2, 0.5, 3000.0
FREE = 1e-12  # a joint without any damping is refused


def joint(*effects, inertia=MOTOR + LINK, damping=FREE, measured="link"):
    plant = inertial_joints([inertia], [damping], [0.0])
    return with_effects(plant, list(effects), measured=measured)


def elasticity(**values):
    return LIBRARY["joint_elasticity"](**{
        "compliance": 1 / STIFFNESS, "damping": 0.0, "motor_inertia": MOTOR, **values})


def modes(plant, output):
    """Undamped frequencies [rad/s] of the zeros and poles from u to an output, linearised."""
    system = ct.linearize(plant, np.zeros(plant.nstates), np.zeros(1))
    channel = ct.ss(system.A, system.B, system.C[[output]], 0.0)
    zeros, poles = ct.zeros(channel), ct.poles(channel)
    return [sorted({round(abs(s), 6) for s in found if s.imag > 1.0}) for found in (zeros, poles)]


def test_resonance_and_antiresonance_of_the_elastic_joint():
    zeros, poles = modes(joint(elasticity(), measured="motor"), 0)
    np.testing.assert_allclose(zeros, [np.sqrt(STIFFNESS / LINK)], rtol=1e-6)
    np.testing.assert_allclose(poles, [np.sqrt(STIFFNESS * (1 / LINK + 1 / MOTOR))], rtol=1e-6)
    assert modes(joint(elasticity()), 0)[0] == []  # from the link no zero is seen


def test_damping_and_friction_stay_where_they_were():
    plant = joint(elasticity(damping=3.0, motor_damping=0.7), damping=0.9, measured="motor")
    rng = np.random.default_rng(0)
    for _ in range(5):
        q, dq, twist, speed, u = values = rng.normal(size=5)
        state = dict(zip(["plant_q[0]", "plant_dq[0]", "joint_elasticity_twist[0]",
                          "joint_elasticity_motor_speed[0]"], values))
        x = np.array([state[label] for label in plant.state_labels])
        rate = dict(zip(plant.state_labels, plant.dynamics(0.0, x, [u])))
        torque = STIFFNESS * twist + 3.0 * (speed - dq)
        np.testing.assert_allclose(
            [rate["plant_q[0]"], rate["plant_dq[0]"], rate["joint_elasticity_twist[0]"],
             rate["joint_elasticity_motor_speed[0]"]],
            [dq, (torque - (0.9 - 0.7) * dq) / LINK, speed - dq,
             (u - torque - 0.7 * speed) / MOTOR], rtol=1e-9)
        np.testing.assert_allclose(plant.output(0.0, x, [u]), [q + twist, speed])


def test_elastic_arm_has_the_links_gravity_and_coupling():
    rotors = np.array([4e-4, 3e-4])
    sizes = ([1.5, 0.8], [0.6, 0.5], [50, 50])
    arm = two_link_arm(*sizes, rotors, [1e-3, 2e-3])
    bare = two_link_arm(*sizes, rotors * 1e-9, [1e-3, 2e-3])
    elastic = with_effects(arm, [elasticity(motor_inertia=50 * rotors * (1 - 1e-9))])
    rng = np.random.default_rng(1)
    x = rng.normal(size=elastic.nstates) * 1e-2
    state = dict(zip(elastic.state_labels, x))
    twist = np.array([state[f"joint_elasticity_twist[{k}]"] for k in (0, 1)])
    link = np.array([state[f"plant_{s}[{k}]"] for s in ("q", "dq") for k in (0, 1)])
    rate = dict(zip(elastic.state_labels, elastic.dynamics(0.0, x, [0.3, -0.2])))
    got = [rate[f"plant_dq[{k}]"] for k in (0, 1)]
    np.testing.assert_allclose(got, bare.dynamics(0.0, link, STIFFNESS * twist)[2:], rtol=1e-5)


def free_energy(effect, torque_energy, duration=2.0):
    """Energy along a free motion after a kick to the motor, inertias MOTOR and LINK."""
    plant = joint(effect)
    start = {f"{effect.name}_motor_speed[0]": 1.0}
    x = np.array([start.get(label, 0.0) for label in plant.state_labels])
    run = compile_diagram(plant).run(duration, 1e-4, "ode4", {"u": [0.0]}, initial_state=x)
    state = dict(zip(plant.state_labels, run.states))
    twist, speed = (state[f"{effect.name}_{s}[0]"] for s in ("twist", "motor_speed"))
    kinetic = 0.5 * MOTOR * speed**2 + 0.5 * LINK * state["plant_dq[0]"]**2
    return kinetic + torque_energy(twist, state), kinetic


def test_an_undamped_spring_keeps_its_energy():
    energy, _ = free_energy(elasticity(), lambda twist, state: 0.5 * STIFFNESS * twist**2)
    np.testing.assert_allclose(energy, 0.5 * MOTOR, rtol=1e-6)


def test_a_damped_spring_never_gains_energy():
    energy, _ = free_energy(elasticity(damping=2.0), lambda z, s: 0.5 * STIFFNESS * z**2)
    assert np.all(np.diff(energy) <= 1e-9) and energy[-1] < 0.9 * energy[0]


def test_backlash_loses_energy_in_contact_alone():
    gap = LIBRARY["backlash"](half_gap=0.01, stiffness=STIFFNESS, damping=20.0,
                              motor_inertia=MOTOR)

    def stored(twist, state):
        return 0.5 * STIFFNESS * (np.abs(twist) - np.minimum(np.abs(twist), 0.01))**2

    energy, kinetic = free_energy(gap, stored)
    assert np.all(np.diff(energy) <= 1e-6) and energy[-1] < 0.9 * energy[0]
    momentum_energy = 0.5 * (MOTOR * 1.0)**2 / (MOTOR + LINK)
    assert energy[-1] >= momentum_energy - 1e-6  # momentum stays, so this much must remain


def test_backlash_without_contact_leaves_the_link_alone():
    gap = LIBRARY["backlash"](half_gap=0.1, motor_inertia=MOTOR)
    t, q, _ = run_plant(joint(gap), 1.0, 0.6)
    before = 0.5 * t**2 / MOTOR < 0.099
    assert np.all(q[before] == 0) and abs(q[-1]) > 1e-3


def test_backlash_has_the_describing_function_of_play():
    """A light, damped link stays where the motor leaves it: the play operator."""
    amplitude, half_gap, w, heavy = 0.05, 0.02, 0.5, 1e4
    plant = joint(LIBRARY["backlash"](half_gap=half_gap, stiffness=2e4, damping=20.0,
                                      motor_inertia=heavy),
                  inertia=heavy + 2e-2, damping=5.0, measured="link")
    period = 2 * np.pi / w
    step = period / 32000
    start = {"backlash_motor_speed[0]": amplitude * w}
    t, q, _ = run_plant(plant, lambda t: -heavy * amplitude * w**2 * np.sin(w * t) + 0.0,
                        2 * period, step, start)
    lap = slice(len(t) // 2, -1)
    harmonic = 2 * np.mean((q - np.mean(q[lap]))[lap] * np.exp(-1j * w * t[lap])) * 1j
    h = half_gap / amplitude
    root = np.sqrt(h * (1 - h))
    wanted = (np.pi / 2 + np.arcsin(1 - 2 * h) + 2 * (1 - 2 * h) * root) / np.pi
    wanted = wanted - 4j * h * (1 - h) / np.pi
    assert abs(harmonic / amplitude - wanted) < 0.01, (harmonic / amplitude, wanted)


def test_stiffness_rises_by_half_at_the_knee_and_by_all_far_beyond():
    torque = LIBRARY["stiffening_elasticity"].build.kernel
    numbers = {"compliance": 1e-3, "stiffening": 3.0, "knee": 2.0, "damping": 0.0}
    twist, h = np.array([0.0, 2e-3, -2e-3, 2.0]), 1e-7
    slope = (torque(twist + h, 0.0, **numbers) - torque(twist - h, 0.0, **numbers)) / (2 * h)
    np.testing.assert_allclose(slope, [1e3, 2.5e3, 2.5e3, 4e3], rtol=1e-5)


def test_a_stiffening_gear_is_a_cubic_spring_well_below_its_knee():
    torque = LIBRARY["stiffening_elasticity"].build.kernel
    numbers = {"compliance": 1e-3, "stiffening": 50.0, "knee": 20.0, "damping": 0.0}
    twist = np.linspace(-2e-3, 2e-3, 9)
    np.testing.assert_allclose(torque(twist, 0.0, **numbers),
                               1e3 * (twist + 50.0 / 3 * twist**3 / 0.02**2), rtol=3e-3)


def hysteresis_loss(rate, *, reach=2e-4, level=0.5, amplitude=2e-3):
    """Energy per cycle of a given twist, by the kernels alone."""
    build = LIBRARY["torsional_hysteresis"].build
    t = np.linspace(0, 3 / rate, 6001)
    w = 2 * np.pi * rate
    twist, speed = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t)
    z, torques = 0.0, []
    for k, v in enumerate(speed):
        torques.append(build.kernel(twist[k], v, z, level=level, stiffness=5e3, damping=0.0))
        if k + 1 < len(t):
            h = t[1] - t[0]
            slope = build.memory(z, v, reach)
            z = z + h / 2 * (slope + build.memory(z + h * slope, speed[k + 1], reach))
    lap = slice(4000, None)
    return np.trapezoid((np.array(torques) * speed)[lap], t[lap])


def test_hysteresis_does_not_mind_the_rate_and_loses_the_area_of_its_loop():
    slow, fast = hysteresis_loss(0.1), hysteresis_loss(10.0)
    assert slow == pytest.approx(fast, rel=1e-9)
    # a loop of height 2 level over 4 amplitude, less the corners where it still bends
    assert 0.8 * 4 * 0.5 * 2e-3 < slow < 4 * 0.5 * 2e-3


def constant_speed_spectrum(effect, signal, speed=0.5, duration=8.0):
    """Amplitude of each line [per Hz of 1/duration] of the measured signal at constant speed."""
    plant = with_effects(inertial_joints([1.0], [FREE], [0.0]), [effect])
    start = {"plant_dq[0]": speed}
    t, *shown = run_plant(plant, 0.0, duration, 1e-3, start)
    wave = (shown[0] - speed * t if signal == "q" else shown[1])[:-1]
    return 2 * np.abs(np.fft.rfft(wave - wave.mean())) / len(wave)


@pytest.mark.parametrize("name", ["kinematic_error", "encoder_eccentricity"])
def test_position_ripple_is_one_line_of_its_amplitude(name):
    speed, cycles = 0.5, 40
    order = 2 * np.pi * cycles / (8.0 * speed)
    lines = constant_speed_spectrum(LIBRARY[name](order=order, sine=6e-4, cosine=-8e-4), "q")
    assert lines[cycles] == pytest.approx(1e-3, rel=1e-6)
    assert np.max(np.delete(lines, cycles)) < 1e-8


def test_the_velocity_belongs_to_the_wobbling_position():
    lines = constant_speed_spectrum(
        LIBRARY["kinematic_error"](sine=1e-3, order=2 * np.pi * 10), "dq")
    assert lines[40] == pytest.approx(1e-3 * 2 * np.pi * 10 * 0.5, rel=1e-6)


def test_ratio_and_coupling_act_on_the_link():
    plant = inertial_joints([1.0, 1.0], [FREE, FREE], [0.0, 0.0])
    x = np.array([0.3, 0.5, -1.0, 2.0])
    stretched = with_effects(plant, [LIBRARY["ratio_error"](error=0.1)])
    np.testing.assert_allclose(stretched.output(0, x, [0, 0]), 1.1 * x)
    dragged = with_effects(plant, [LIBRARY["coupled_joints"](ratio=0.2)])
    np.testing.assert_allclose(dragged.output(0, x, [0, 0]), [0.3, 0.56, -1.0, 1.8])
    both = with_effects(plant, [LIBRARY["coupled_joints"](ratio=0.2),
                                LIBRARY["ratio_error"](error=0.1)])
    np.testing.assert_allclose(both.output(0, x, [0, 0]), 1.1 * np.array([0.3, 0.56, -1.0, 1.8]))


def test_loads_of_the_link_see_the_link_and_those_of_the_motor_the_motor():
    plant = joint(elasticity(), LIBRARY["viscous"](extra=0.5), LIBRARY["gravity"](weight=2.0))
    x = np.zeros(4)
    x[plant.state_labels.index("plant_q[0]")] = np.pi
    x[plant.state_labels.index("joint_elasticity_motor_speed[0]")] = 2.0
    rate = dict(zip(plant.state_labels, plant.dynamics(0.0, x, [0.0])))
    assert rate["plant_dq[0]"] == pytest.approx(2.0 / LINK)
    assert rate["joint_elasticity_motor_speed[0]"] == pytest.approx(-0.5 * 2.0 / MOTOR)


@pytest.mark.parametrize("preload", [0.0, 2.0])
def test_mesh_ripple_grows_with_the_torque_from_that_of_its_preload(preload):
    torque = LIBRARY["gear_mesh_ripple"].build.kernel(
        0.0, np.array([0.0, 5.0, -5.0]), sine=0.3, cosine=0.02, order=1.0, preload=preload)
    np.testing.assert_allclose(torque, 0.02 * (preload + np.array([0.0, 5.0, 5.0])))


def test_a_motor_must_leave_inertia_to_the_link():
    with pytest.raises(DiagramError, match="motor_inertia .* leaves nothing to the link"):
        joint(elasticity(motor_inertia=1.8))


@pytest.mark.parametrize("zero", [0.0, 2.5])
def test_the_links_inertia_is_checked_in_many_poses(zero):
    """The outer joint is lightest outstretched, wherever its angle counts from."""
    arm = two_link_arm([1.5, 0.8], [0.6, 0.5], [2, 2], [4e-4, 3e-4], [1e-3, 2e-3])
    turned = ct.nlsys(
        lambda t, x, u, params: arm.updfcn(t, x + [0, zero, 0, 0], u, arm.params), None,
        inputs=arm.input_labels, outputs=arm.output_labels, states=arm.state_labels, name="arm")
    assert 0.06 < np.max([inertia_of_the_outer_joint(arm, q) for q in (0.0, 1.5)])
    assert 0.06 > inertia_of_the_outer_joint(arm, 0.0)
    with pytest.raises(DiagramError, match="leaves nothing to the link of arm"):
        with_effects(turned, [elasticity(motor_inertia=0.06, joints=[1])])


def inertia_of_the_outer_joint(arm, q):
    x = np.array([0.0, q, 0.0, 0.0])
    return 1 / (arm.dynamics(0, x, [0.0, 1.0]) - arm.dynamics(0, x, [0.0, 0.0]))[3]


def test_one_transmission_can_give_the_motor_its_motion():
    with pytest.raises(DiagramError, match="joint_elasticity and backlash each give the motor"):
        joint(elasticity(), LIBRARY["backlash"](half_gap=1e-3))


def test_sensors_sit_at_link_or_motor():
    with pytest.raises(DiagramError, match="measured='motr'.*did you mean 'motor'"):
        with_effects(joint_loop(inertial_joints([1.0], [0.1], [0.0]), [1], [1]),
                     [elasticity()], measured="motr")
