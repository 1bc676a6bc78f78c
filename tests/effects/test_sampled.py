"""Effects in a sampled controller: exact registers, the same law as in continuous time."""

import control as ct
import numpy as np
import pytest
from effect_runs import block_response, one_joint

from clie_blocks.compiled import compile_diagram, sampled
from clie_blocks.controllers import pd_controller
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.effects import LIBRARY, with_effects
from clie_blocks.filters import difference_filter
from clie_blocks.signals import DiagramError, interconnect, ports

PERIOD = 1e-3
SAMPLED = [name for name in LIBRARY if LIBRARY[name].sampled]


def controller(n=2):
    """Sampled PD law on a differenced position: ports q_d, q, pe -> u."""
    return interconnect(
        [pd_controller([10.0] * n, [5.0] * n, name="pd"), difference_filter(n, PERIOD)],
        [("pd.dq", "velocity_filter.dq")], name="controller",
        inputs={"q_d": "pd.q_d", "q": ["pd.q", "velocity_filter.q"], "pe": "pd.pe"},
        outputs={"u": "pd.u"})


def along(block, rows):
    """Outputs of a discrete block along rows of inputs, as python-control computes them."""
    x, found = np.zeros(block.nstates), []
    for k, u in enumerate(rows):
        found.append(block.output(k * PERIOD, x, u))
        x = block.dynamics(k * PERIOD, x, u)
    return np.array(found)


def rows_for(block, count=120):
    return np.random.default_rng(4).normal(size=(count, block.ninputs))


@pytest.mark.parametrize("name", SAMPLED)
def test_neutral_passes_bit_for_bit(name):
    block = LIBRARY[name].neutral().block(2, PERIOD)
    rows = rows_for(block)
    inputs, outputs = ports(block.input_labels), ports(block.output_labels)
    found = along(block, rows)
    for signal, columns in outputs.items():
        passed = rows[:, inputs[signal]] if signal in inputs else np.zeros_like(found[:, columns])
        np.testing.assert_array_equal(found[:, columns], passed)


@pytest.mark.parametrize("name", SAMPLED)
def test_compiled_is_interpreted(name):
    block = LIBRARY[name].typical().block(2, PERIOD)
    rows = rows_for(block)
    given = {signal: rows[:, columns] for signal, columns in ports(block.input_labels).items()}
    run = compile_diagram(block).run(len(rows) * PERIOD, inputs=given)
    np.testing.assert_allclose(np.asarray(run.outputs).T[:len(rows)], along(block, rows),
                               rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", [name for name in SAMPLED if name != "packet_hold"])
def test_a_slow_signal_passes_as_in_continuous_time(name):
    setting = LIBRARY[name].typical()
    block = setting.block(1, PERIOD)
    waves = {base: lambda t: 0.3 * np.sin(2.0 * t) for base in ports(block.input_labels)}
    if name == "in_loop_delay":
        waves["dq"] = lambda t: 0.6 * np.cos(2.0 * t)
    t = PERIOD * np.arange(1000)
    found = along(block, np.stack([wave(t) for wave in waves.values()], axis=1))
    _, y = block_response(setting, waves, 1.0, PERIOD)
    late = slice(100, 1000)
    np.testing.assert_allclose(found[late].T, y[:, late], atol=6e-3 * np.max(np.abs(y)))


def test_a_delay_of_whole_samples_is_exact_in_the_controller():
    plain, delayed = controller(), with_effects(controller(), [LIBRARY["time_delay"](delay=0.003)])
    assert delayed.input_labels == plain.input_labels and delayed.dt == PERIOD
    rows = rows_for(plain)
    np.testing.assert_array_equal(along(delayed, rows)[3:], along(plain, rows)[:-3])


def test_a_late_measurement_is_exact_in_the_controller():
    block = LIBRARY["in_loop_delay"](delay=0.002).block(1, PERIOD)
    rows = rows_for(block)
    found = along(block, rows)
    np.testing.assert_array_equal(found[2:], rows[:-2])
    np.testing.assert_array_equal(found[:2], np.tile(rows[0], (2, 1)))  # at rest before


def test_lost_packets_hold_the_last_command_bit_for_bit():
    block = LIBRARY["packet_hold"](hold=0.005, interval=0.02).block(1, PERIOD)
    rows = rows_for(block)
    held = along(block, rows)
    for start in (20, 60):
        np.testing.assert_array_equal(held[start:start + 5], np.tile(rows[start - 1], (5, 1)))
        np.testing.assert_array_equal(held[start + 5:start + 20], rows[start + 5:start + 20])


def test_a_rate_limiter_never_moves_faster():
    block = LIBRARY["setpoint_slew"](speed=0.5).block(1, PERIOD)
    moved = along(block, rows_for(block))
    assert np.max(np.abs(np.diff(moved[:, 0]))) <= 0.5 * PERIOD * (1 + 1e-12)


def test_effects_keep_their_order_at_a_controller():
    effects = [LIBRARY["torque_quantization"](resolution=0.1), LIBRARY["time_delay"](delay=0.002),
               LIBRARY["encoder_quantization"](resolution=1e-3)]
    law = with_effects(controller(), effects)
    u = along(law, rows_for(law))
    np.testing.assert_allclose(u / 0.1, np.rint(u / 0.1), atol=1e-9)
    assert np.all(u[:2] == 0) and np.any(u[2] != 0)


def test_a_velocity_made_inside_the_controller_cannot_be_replaced():
    with pytest.raises(DiagramError, match="no signal 'dq' here"):
        with_effects(controller(), [LIBRARY["gain_error"](kp_error=0.1)])


@pytest.mark.parametrize(("effect", "text"), [
    ("coulomb", "enters at the load, which a controller does not have"),
    ("backlash", "enters at the transmission, which a controller does not have")])
def test_a_controller_refuses_effects_of_the_plant(effect, text):
    with pytest.raises(DiagramError, match=text):
        with_effects(controller(), [LIBRARY[effect].typical()])


def test_a_continuous_state_is_refused_in_a_sampled_diagram():
    moving = "rest_time_breakaway: its state moves in continuous time"
    with pytest.raises(DiagramError, match=moving):
        LIBRARY["rest_time_breakaway"](rise=0.1).block(1, PERIOD)


def sampled_loop():
    """A joint whose torque is held, under the sampled law: a diagram in discrete time."""
    def step(t, x, u, params):
        q, dq = x
        return np.array([q + PERIOD * dq, dq + PERIOD * 0.5 * u[0]])

    plant = ct.nlsys(step, lambda t, x, u, params: x, dt=PERIOD, name="plant",
                     states=["q[0]", "dq[0]"], inputs=["u[0]"], outputs=["q[0]", "dq[0]"])
    return joint_loop(plant, [10.0], [5.0])


def test_a_sampled_loop_takes_exact_delays():
    def run(*effects):
        return along(with_effects(sampled_loop(), effects), np.ones((30, 2)))

    plain = run()
    skewed = run(LIBRARY["channel_skew"](skew=2 * PERIOD))
    np.testing.assert_array_equal(skewed[2:, 2], plain[:-2, 2])
    np.testing.assert_array_equal(skewed[:, :2], plain[:, :2])
    moves = np.argmax(plain[:, 0] > 0)
    assert np.argmax(run(LIBRARY["time_delay"](delay=2 * PERIOD))[:, 0] > 0) == moves + 2
    late = run(LIBRARY["in_loop_delay"](delay=2 * PERIOD))
    first = np.argmax(plain[:, 2] != plain[0, 2])
    assert np.argmax(late[:, 2] != late[0, 2]) == first + 2


def test_a_sampled_plant_refuses_a_continuous_load():
    moving = "rest_time_breakaway: its state moves in continuous time"
    with pytest.raises(DiagramError, match=moving):
        with_effects(sampled_loop(), [LIBRARY["rest_time_breakaway"](rise=0.1)])


def hybrid(plant, law):
    """Position of a continuous joint under the sampled law."""
    loop = sampled(plant, law, wires=[("plant.u", "controller.u"), ("controller.q", "plant.q")])
    run = loop.run(3.0, 1e-4, "ode4", every=10, log="plant.q",
                   inputs={"q_d": lambda t: np.array([np.sin(2 * t)]), "pe": [0.0]})
    return np.asarray(run.outputs).ravel()


def test_the_register_and_the_memory_are_the_same_delay():
    """Exact in the sampled half, approximant in the continuous one: two routes to one motion."""
    late = LIBRARY["time_delay"](delay=8 * PERIOD)
    in_law = hybrid(one_joint(), with_effects(controller(1), [late]))
    in_plant = hybrid(one_joint(late), controller(1))
    plain = hybrid(one_joint(), controller(1))
    np.testing.assert_allclose(in_law, in_plant, atol=1e-8)
    assert np.max(np.abs(in_law - plain)) > 3e-3


def test_effects_of_both_halves_run_in_one_loop():
    plant = one_joint(LIBRARY["backlash"](half_gap=2e-3), LIBRARY["coulomb"](level=0.1))
    law = with_effects(controller(1), [
        LIBRARY["encoder_quantization"](resolution=1e-3),
        LIBRARY["packet_hold"](hold=0.01, interval=0.1),
        LIBRARY["torque_quantization"](resolution=0.01)])
    change = hybrid(plant, law) - hybrid(one_joint(), controller(1))
    assert 1e-3 < np.max(np.abs(change)) < 0.1
