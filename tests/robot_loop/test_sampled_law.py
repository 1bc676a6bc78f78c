"""Control laws as blocks in the sampled loop: the contract of their ports, and their runs."""

import control as ct
import numpy as np
import pytest

from clie_blocks.compiled import TraceError, compile_diagram
from clie_blocks.effects import LIBRARY
from clie_blocks.labels import DiagramError, signals
from clie_blocks.robot_loop.block import LoopBlock, Structure
from clie_blocks.robot_loop.links import no_links
from clie_blocks.robot_loop.pieces import pieces_of
from clie_blocks.robot_loop.robot_loop import robot_loop
from clie_blocks.robot_loop.sampled_law import sampled_law

T = 1e-3
KP, KD = np.array([4.0, 2.0]), np.array([0.1, 0.05])


def pd_block(n=2, dt=T, pe=True, inputs=None, outputs=None, name="pd"):
    """PD with a difference of positions, as a user would write it."""
    def update(t, x, u, params):
        return u[n:2 * n]

    def output(t, x, u, params):
        u_pd = params["kp"] * (u[:n] - u[n:2 * n]) - params["kd"] * (u[n:2 * n] - x) / T
        return u_pd + u[2 * n:] if pe else u_pd

    ports = signals("q_d", "q", *(["pe"] if pe else []), n=n)
    return ct.nlsys(update, output, name=name, dt=dt, states=n,
                    inputs=inputs or ports, outputs=outputs or signals("u", n=n),
                    params={"kp": KP[:n], "kd": KD[:n]})


def pd_on_velocity(n=2, drop=0):
    """PD with the velocity of the drive, which it limits; some of its inputs may be missing."""
    def output(t, x, u, params):
        q_d, q, pe, dq = (u[k:k + n] for k in range(0, 4 * n, n))
        return params["kp"] * (q_d - q) - params["kd"] * np.clip(dq, -50.0, 50.0) + pe

    ports = signals("q_d", "q", "pe", "dq", n=n)
    return ct.nlsys(None, output, name="pd", dt=T, inputs=ports[:len(ports) - drop],
                    outputs=signals("u", n=n), params={"kp": KP[:n], "kd": KD[:n]})


def motion(law, steps=400):
    """Positions and commands of two joints that follow a sine under a law."""
    shape = Structure(2, T, no_links(2).layout, False, law=law)
    block = LoopBlock(shape, (), {})
    values = {"inertia": [2e-3, 1e-3], "damping": [5e-3, 4e-3], "load": [0.01, 0.0],
              "kp": KP, "kd": KD, "saturation": [9.0, 9.0], "ratio": [1.0, 1.0],
              "start": [0.0, 0.0], "first": [0.0, 0.0],
              "b": np.outer([1 / T, -1 / T, 0.0], np.ones(2)),
              "a": np.outer([1.0, 0.0, 0.0], np.ones(2))}
    links = no_links(2)
    values |= {f"links.{name}": getattr(links, name) for name in links.parameters}
    if law is not None:
        values["law"] = np.array(law.values)
    system = block.block({key: np.array(value, float) for key, value in values.items()}, "robot")
    t = T * np.arange(steps)[:, None]
    inputs = np.hstack([0.3 * np.sin(9 * t), 0.2 * np.sin(7 * t), 0.1 * np.cos(40 * t), 0 * t,
                        *[0 * t] * (system.ninputs - 4)])
    return np.asarray(compile_diagram(system).run(steps * T, inputs=inputs).outputs)


@pytest.mark.parametrize("pe", [True, False])
def test_pd_as_a_block_moves_the_robot_as_pd_does(pe):
    law = sampled_law(pd_block(pe=pe), T)
    np.testing.assert_allclose(motion(law), motion(None), rtol=1e-11, atol=1e-13)


def test_pd_on_the_velocity_of_the_drive_moves_the_robot_as_pd_does():
    law = sampled_law(pd_on_velocity(), T)
    assert law.reads == ("dq",)
    np.testing.assert_allclose(motion(law), motion(None), rtol=1e-11, atol=1e-13)


def test_a_law_on_a_measured_velocity_in_the_loop_is_that_written_by_hand():
    inertia, damping, lag = 2e-3, 5e-3, 3e-3
    pole = lag / (lag + T)
    block = ct.nlsys(
        lambda t, x, u, params: x + T * (u[:1] - u[1:2]),
        lambda t, x, u, params: 4.0 * (u[:1] - u[1:2]) + 9.0 * x - 0.1 * np.tanh(u[2:]),
        name="own", dt=T, states=1, inputs=["q_d[0]", "q[0]", "dq[0]"], outputs=["u[0]"])
    loop = robot_loop(inertia, damping, 0.0, 0.0, T, law=block,
                      velocity_filter=((1 / (lag + T), -1 / (lag + T), 0.0), (1.0, -pole, 0.0)))
    assert loop.input_labels == ["q_d[0]", "pe[0]", "noise[0]", "noise_dq[0]"]
    rng, steps = np.random.default_rng(4), 300
    q_d = 0.3 * np.sin(9 * T * np.arange(steps))
    pe, noise, noise_dq = rng.normal(size=(3, steps)) * [[0.05], [0.0], [0.02]]
    run = compile_diagram(loop).run(
        steps * T, inputs=np.stack([q_d, pe, noise, noise_dq], axis=1)).outputs
    q, speed, last, rate, total, by_hand = 0.0, 0.0, 0.0, 0.0, 0.0, []
    for k in range(steps):
        rate = pole * rate + (q - last) / (lag + T)
        u = 4.0 * (q_d[k] - q) + 9.0 * total - 0.1 * np.tanh(rate + noise_dq[k]) + pe[k]
        by_hand.append((q, u))
        total, last = total + T * (q_d[k] - q), q
        middle = speed + T / 2 * (u - damping * speed) / inertia
        end = speed + T * (u - damping * middle) / inertia
        q, speed = q + T / 2 * (speed + end), end
    np.testing.assert_allclose(run[:2, :steps].T, by_hand, rtol=1e-9, atol=1e-12)


def around_torque():
    """Proportional law whose torque an integral brings about, by what the drive measures."""
    return ct.nlsys(
        lambda t, x, u, params: x + 0.2 * (4.0 * (u[:1] - u[1:2]) - u[2:]),
        lambda t, x, u, params: 4.0 * (u[:1] - u[1:2]) + x, name="around", dt=T, states=1,
        inputs=["q_d[0]", "q[0]", "tau[0]"], outputs=["u[0]"])


def test_a_law_reads_the_torque_that_a_weak_drive_gave_in_the_sample_before():
    inertia, damping, steps = 2e-3, 5e-2, 300
    loop = robot_loop(inertia, damping, 0.0, 0.0, T, law=around_torque(),
                      effects=[LIBRARY["torque_gain_error"](error=-0.3)])
    q_d = 0.3 * np.sin(9 * T * np.arange(steps))
    noise_tau = 0.02 * np.random.default_rng(5).normal(size=steps)
    zero = np.zeros(steps)
    run = compile_diagram(loop).run(
        steps * T, inputs=np.stack([q_d, zero, zero, noise_tau], axis=1)).outputs
    q, speed, given, total, by_hand = 0.0, 0.0, 0.0, 0.0, []
    for k in range(steps):
        wanted = 4.0 * (q_d[k] - q)
        by_hand.append((q, wanted + total))
        total, given = total + 0.2 * (wanted - given - noise_tau[k]), 0.7 * (wanted + total)
        middle = speed + T / 2 * (given - damping * speed) / inertia
        end = speed + T * (given - damping * middle) / inertia
        q, speed = q + T / 2 * (speed + end), end
    np.testing.assert_allclose(run[:2, :steps].T, by_hand, rtol=1e-9, atol=1e-12)


def test_a_loop_beside_its_own_record_reads_the_torque_of_the_record():
    effect = LIBRARY["actuator_lag"](lag=4e-3)
    law = sampled_law(around_torque(), T, [2.0])  # torques are logged per unit of command
    pieces = [("lag", piece) for piece in pieces_of(effect.effect, ["lag"])]
    links = no_links(1)
    values = {key: np.ones(1) for key in ("kp", "kd", "ratio")} | {
        "inertia": np.array([2e-3]), "damping": np.array([5e-2]), "saturation": np.array([9.0]),
        "load": np.zeros(1), "start": np.zeros(1), "first": np.zeros(1),
        "lag.lag": np.array([4e-3]),
        "b": np.zeros((3, 1)), "a": np.zeros((3, 1)),
        **{f"links.{name}": getattr(links, name) for name in links.parameters}}

    def stepped(beside, *inputs):
        """Commands, and torques that the drive gave before them, in each sample."""
        shape = Structure(1, T, links.layout, False, law=law, beside_record=beside)
        block = LoopBlock(shape, pieces, {"lag": ("lag",)}).block(values, "robot")
        x, rows = np.zeros(block.nstates), []
        for row in np.stack(inputs, axis=1):
            rows.append((block.output(0.0, x, row)[1], x[block.state_labels.index("given[0]")]))
            x = block.dynamics(0.0, x, row)
        return np.transpose(rows)

    t = T * np.arange(120)
    q_d, offset, zero = 0.3 * np.sin(30 * t), 0.1 + 0.05 * np.cos(50 * t), 0.0 * t
    u, given = stepped(False, q_d, zero, zero, offset)
    assert np.std(given) > 0.2
    again, beyond = stepped(True, q_d, zero, zero, given / 2.0 + offset, u)
    np.testing.assert_allclose(again, u, rtol=1e-9, atol=1e-12)
    assert np.abs(beyond).max() < 1e-12
    other, _ = stepped(True, 1.1 * q_d, zero, zero, given / 2.0 + offset, u)
    linear, _ = stepped(False, 1.1 * q_d, zero, zero, offset)
    np.testing.assert_allclose(other, linear, rtol=1e-9, atol=1e-12)


def test_a_transfer_function_without_states_of_its_own_is_a_law():
    gain = ct.ss([], [], [], [[3.0, -3.0]], inputs=["q_d[0]", "q[0]"], outputs=["u[0]"], dt=T)
    law = sampled_law(gain, T)
    _, u = law.step(0.0, np.zeros(0), np.array([1.0]), np.array([0.5]), np.array([0.1]),
                    np.zeros(0))
    assert u == pytest.approx([1.6])


def test_inputs_may_stand_in_any_order():
    shuffled = pd_block(pe=False, inputs=["q_d[0]", "q_d[1]", "q[0]", "q[1]"])
    swapped = ct.nlsys(
        lambda t, x, u, params: shuffled.dynamics(t, x, np.concatenate((u[2:], u[:2]))),
        lambda t, x, u, params: params["kp"] * (u[2:] - u[:2]) - params["kd"] * (u[:2] - x) / T,
        name="swapped", dt=T, states=2, inputs=["q[0]", "q[1]", "q_d[0]", "q_d[1]"],
        outputs=["u[0]", "u[1]"], params={"kp": KP, "kd": KD})
    rng = np.random.default_rng(1)
    q_d, q, pe, x = rng.normal(size=(4, 2))
    one, other = (sampled_law(block, T) for block in (shuffled, ct.nlsys(
        lambda t, x, u, params: u[:2], swapped.outfcn, name="swapped", dt=T, states=2,
        inputs=swapped.input_labels, outputs=swapped.output_labels,
        params={"kp": KP, "kd": KD})))
    first = one.step(0.0, x, q_d, q, pe, np.array(one.values))
    second = other.step(0.0, x, q_d, q, pe, np.array(other.values))
    np.testing.assert_allclose(np.concatenate(first), np.concatenate(second), rtol=1e-14)


def test_commands_in_another_unit_are_scaled():
    law = sampled_law(pd_block(), T, [2.0, 3.0])
    own = sampled_law(pd_block(), T)
    x, q_d, q, zero = np.zeros(2), np.array([1.0, 1.0]), np.zeros(2), np.zeros(2)
    p = np.array(law.values)
    np.testing.assert_allclose(law.step(0.0, x, q_d, q, zero, p)[1],
                               [2.0, 3.0] * own.step(0.0, x, q_d, q, zero, p)[1])
    pe = np.array([0.5, -0.5])  # an excitation is logged in the unit of the torque
    np.testing.assert_allclose(law.step(0.0, x, q, q, pe, p)[1], pe)


@pytest.mark.parametrize(("block", "message"), [
    (lambda: pd_block(1, inputs=["q_d[0]", "dqs[0]", "pe[0]"]),
     "no input 'dqs'; did you mean 'dq'.*it forms itself"),
    (lambda: pd_block(1, inputs=["q_d[0]", "dq[0]", "pe[0]"]), "no input 'q'; its ports are"),
    (lambda: pd_on_velocity(2, drop=1), "dq has 1 signals and u has 2"),
    (lambda: pd_block(1, inputs=["q_d[0]", "r[0]", "pe[0]"]), "no input 'r'"),
    (lambda: pd_block(1, pe=False, outputs=["tau[0]"]), "no output 'u'.*it has q_d, q, tau"),
    (lambda: pd_block(2, pe=False, inputs=["q_d[0]", "q_d[1]", "q_d[2]", "q[0]"]),
     "q_d has 3 signals and u has 2"),
    (lambda: pd_block(1, dt=0), "continuous time.*dt=0.001"),
    (lambda: pd_block(1, dt=2e-3), "every 0.002 s and the controller of the robot every 0.001"),
    (lambda: pd_block(1, dt=None), "no sample time"),
    (lambda: "pd", "python-control system, not str")])
def test_a_law_that_breaks_the_contract_is_refused(block, message):
    with pytest.raises(DiagramError, match=message):
        sampled_law(block(), T)


def test_a_law_whose_parts_need_each_other_at_once_is_refused_with_the_way_round():
    inner = ct.nlsys(None, lambda t, x, u, params: u[:1] - 0.5 * u[1:2] - u[2:], name="inner",
                     inputs=["q_d[0]", "dq[0]", "back"], outputs=["out"], dt=T)
    outer = ct.nlsys(None, lambda t, x, u, params: 2.0 * u[:1] - u[1:], name="outer",
                     inputs=["out", "q[0]"], outputs=["back"], dt=T)
    law = ct.interconnect([inner, outer], inputs=["q_d[0]", "dq[0]", "q[0]"], outputs=["u[0]"],
                          outlist=["outer.back"], name="law", dt=T)
    with pytest.raises(DiagramError, match="algebraic loop: inner.out -> outer.back"):
        sampled_law(law, T)


@pytest.mark.parametrize(("output", "message"), [
    (lambda t, x, u, params: u[:1] if u[0] > 0 else -u[:1], "np.where"),
    (lambda t, x, u, params: 1 / 0 * u[:1], "ZeroDivisionError"),
    (lambda t, x, u, params: np.random.default_rng().normal() + u[:1], "random|changes")])
def test_what_cannot_become_machine_code_is_refused_without_a_callback(output, message):
    block = ct.nlsys(None, output, name="own", dt=T, inputs=["q_d[0]", "q[0]"], outputs=["u[0]"])
    with pytest.raises(TraceError, match=f"own.*{message}") as refused:
        sampled_law(block, T)
    assert "opaque" not in str(refused.value)


def test_an_opaque_law_is_refused_with_its_block():
    block = ct.nlsys(None, lambda t, x, u, params: u[:1] if u[0] > 0 else -u[:1], name="own", dt=T,
                     inputs=["q_d[0]", "q[0]"], outputs=["u[0]"])
    block.opaque = True
    with pytest.raises(TraceError, match="'own'.*opaque and cannot be traced.*np.where"):
        sampled_law(block, T)


def test_a_law_with_all_its_past_is_refused():
    n = 1001
    line = ct.ss(np.eye(n, k=-1), np.eye(n, 1), np.eye(1, n), [[0.0]], inputs=["q[0]"],
                 outputs=["u[0]"], dt=T)
    with pytest.raises(DiagramError, match="1001 states"):
        sampled_law(line, T)
