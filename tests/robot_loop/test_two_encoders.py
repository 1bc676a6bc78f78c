"""The sampled robot as two encoders see it, one on the motor and one on the link."""

import numpy as np
import pytest

from clie_blocks.effects import LIBRARY
from clie_blocks.robot_loop.block import LoopBlock, Structure
from clie_blocks.robot_loop.links import no_links
from clie_blocks.robot_loop.pieces import pieces_of


def both_encoders(effect, encoder_on_motor, rows=400, **values):
    """Positions that the law's encoder and the other one see under a moving set-point."""
    pieces = tuple((effect.name, piece) for piece in pieces_of(effect, list(values)))
    shape = Structure(1, 1e-3, no_links(1).layout, False, encoder_on_motor, two_encoders=True)
    loop = LoopBlock(shape, pieces, {effect.name: tuple(values)})
    system = loop.system
    params = {**system.params, "start": np.zeros(1), "first": np.zeros(1), "damping": np.ones(1),
              "load": np.zeros(1), "inertia": np.ones(1), "kp": 40 * np.ones(1),
              "kd": 9 * np.ones(1), "b": np.array([[1e3], [-1e3], [0.0]]),
              "a": np.array([[1.0], [0.0], [0.0]]),
              **{f"{effect.name}.{name}": value * np.ones(1) for name, value in values.items()}}
    params["start"] = loop.joint_at(np.zeros(1), params)
    x, seen = loop.initial_state(params["start"], 0.0, params), []
    for k in range(rows):
        u = np.array([0.5 * np.sin(8e-3 * k), 0.0, 0.0])
        seen.append(system.output(k * 1e-3, x, u, params))
        x = system.dynamics(k * 1e-3, x, u, params)
    q, _, summed, other, summed_other = np.transpose(seen)
    np.testing.assert_allclose(np.diff(summed), q[:-1], atol=1e-12)
    np.testing.assert_allclose(np.diff(summed_other), other[:-1], atol=1e-12)
    return q, other


def test_both_encoders_see_their_own_side_of_a_soft_gear():
    soft = {"compliance": 0.01, "damping": 0.6, "motor_inertia": 0.4, "motor_damping": 0.5}
    link, motor = both_encoders(LIBRARY["joint_elasticity"], False, rows=60, **soft)
    assert np.abs(motor - link).max() > 1e-5
    motor, link = both_encoders(LIBRARY["joint_elasticity"], True, rows=60, **soft)
    pushed = 0.6 * np.gradient(np.gradient(link, 1e-3), 1e-3)  # inertia of the link
    assert np.corrcoef((motor - link)[5:-5], pushed[5:-5])[0, 1] > 0.99


@pytest.mark.parametrize("encoder_on_motor", [False, True])
def test_an_uneven_gear_lies_between_the_encoders(encoder_on_motor):
    wave = {"sine": 5e-3, "cosine": 2e-3, "order": 9.0}
    law, other = both_encoders(LIBRARY["kinematic_error"], encoder_on_motor, **wave)
    motor, link = (law, other) if encoder_on_motor else (other, law)
    np.testing.assert_allclose(
        link, motor + 5e-3 * np.sin(9 * motor) + 2e-3 * np.cos(9 * motor), atol=1e-12)
    if not encoder_on_motor:
        assert link[0] == pytest.approx(0.0, abs=1e-9)  # where the law begins


@pytest.mark.parametrize("encoder_on_motor", [False, True])
def test_an_eccentric_disk_is_at_the_encoder_of_the_law(encoder_on_motor):
    law, other = both_encoders(LIBRARY["encoder_eccentricity"], encoder_on_motor, sine=5e-3,
                               order=9.0)
    np.testing.assert_allclose(law, other + 5e-3 * np.sin(9 * other), atol=1e-12)


@pytest.mark.parametrize(("name", "values"), [
    ("kinematic_error", {"sine": 5e-3, "cosine": 2e-2, "order": 9.0}),
    ("ratio_error", {"error": 0.05}), ("coupled_joints", {"ratio": 0.2})])
@pytest.mark.parametrize("two_encoders", [False, True])
def test_a_robot_whose_encoder_reads_its_set_point_rests(name, values, two_encoders):
    effect, goal = LIBRARY[name], np.array([0.7, -0.4])
    pieces = tuple((name, piece) for piece in pieces_of(effect, list(values)))
    loop = LoopBlock(Structure(2, 1e-3, no_links(2).layout, False, two_encoders=two_encoders),
                     pieces, {name: tuple(values)})
    system = loop.system
    params = {**system.params, "first": np.zeros(2), "load": np.zeros(2), "kp": np.full(2, 40.0),
              **{f"{name}.{key}": np.full(2, value) for key, value in values.items()}}
    params["start"] = loop.joint_at(goal, params)
    x, u = loop.initial_state(params["start"], 0.0, params), np.concatenate((goal, np.zeros(4)))
    assert np.abs(params["start"] - goal).max() > 1e-3
    for k in range(300):
        np.testing.assert_allclose(system.output(k * 1e-3, x, u, params)[:2], goal, atol=1e-7)
        x = system.dynamics(k * 1e-3, x, u, params)
