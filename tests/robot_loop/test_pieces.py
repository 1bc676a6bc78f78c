"""Each effect in the sampled robot against its own block in continuous time."""

import numpy as np
import pytest

from clie_blocks.effects import LIBRARY
from clie_blocks.labels import DiagramError
from clie_blocks.robot_loop.dynamics import State
from clie_blocks.robot_loop.pieces import pieces_of
from clie_blocks.signals import ports

DURATION, FINE = 3.0, 2e-4  # s
ROUGH = {"maxwell_slip": 0.01}  # whose block passes the limit of an element by a step


def has_form(name):
    """Whether an effect acts as a signal; a gear between two bodies is in `test_robot_loop`."""
    try:
        pieces = pieces_of(LIBRARY[name], [p.name for p in LIBRARY[name].parameters])
    except DiagramError:
        return False
    return all(piece.port != "transmission" for piece in pieces)


FORMS = [name for name in LIBRARY if has_form(name)]


def motion(t):
    """Position, velocity and command of one joint over time."""
    q = 0.3 * np.sin(2.0 * t) + 0.02 * np.sin(9.0 * t)
    dq = 0.6 * np.cos(2.0 * t) + 0.18 * np.cos(9.0 * t)
    return {"q": q, "dq": dq, "u": 0.8 * np.cos(3.0 * t) + 0.3, "t": t}


def typical(effect):
    """Typical numbers, the smoothing of a jump as narrow as it may be."""
    narrow = {p.name: p.lower for p in effect.parameters if (p.name, p.unit) == ("width", "rad/s")}
    return effect.typical(**narrow)


def continuous(effect):
    """First output of the block along the motion, its state carried by small steps."""
    block = typical(effect).block(1)
    names = list(ports(block.input_labels))
    times = np.arange(0.0, DURATION, FINE)
    x, rows = np.zeros(block.nstates), []

    def inputs(t):
        signals = motion(t)
        return np.array([signals[name] for name in names])

    for t in times:
        rows.append(block.output(t, x, inputs(t))[0])
        if block.nstates:
            k1 = block.dynamics(t, x, inputs(t))
            k2 = block.dynamics(t + FINE / 2, x + FINE / 2 * k1, inputs(t + FINE / 2))
            x = x + FINE * k2
    return times, np.array(rows)


def sampled(effect, period):
    """The same of its pieces, one value per period, at the middle of it."""
    pieces = pieces_of(effect, [p.name for p in effect.parameters])
    p, rows = typical(effect).vectors(1), []
    memory = [[np.zeros(1)] * piece.states for piece in pieces]
    times = np.arange(0.0, DURATION - period, period)
    for t in times:
        middle = {key: np.atleast_1d(value) for key, value in motion(t + period / 2).items()}
        if pieces[0].port == "drive":
            middle["u"] = np.atleast_1d(motion(t)["u"])  # held from the first instant on
        s = State(middle["q"], middle["dq"], middle["u"], t + period / 2, period, None,
                  np.ones(1))
        total = 0.0
        for k, piece in enumerate(pieces):
            value, memory[k] = piece.act(s, memory[k], p)
            if piece.port == "friction":
                forward, backward = value
                value = np.where(s.dq > 0, forward, -np.asarray(backward))
            total = total + value
        rows.append(np.ravel(total)[0])
    return times + period / 2, np.array(rows)


QUICK = ("coulomb", "spring", "back_emf", "encoder_eccentricity", "actuator_lag")  # one of a kind


@pytest.mark.parametrize("name", [
    name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in FORMS])
def test_pieces_follow_the_block_as_the_period_shrinks(name):
    effect = LIBRARY[name]
    times, exact = continuous(effect)
    errors = []
    for period in (4e-3, 1e-3):
        at, value = sampled(effect, period)
        moving = np.abs(motion(at)["dq"]) > 0.05  # a jump at rest has no value
        gap = np.abs(value - np.interp(at, times, exact))[moving]
        errors.append(np.quantile(gap, 0.95))
    size = np.ptp(exact) + 1e-12
    assert errors[1] < ROUGH.get(name, 2e-3) * size or errors[1] < 0.4 * errors[0], (errors, size)
    assert errors[1] < 0.02 * size


def test_what_has_no_form_says_why():
    with pytest.raises(DiagramError, match="hidden_integral: it enters at the controller"):
        pieces_of(LIBRARY["hidden_integral"], ["ki"])


def test_parameters_that_are_not_set_are_constants_of_the_program():
    piece, = pieces_of(LIBRARY["stribeck"], ["level", "excess", "velocity"])
    assert ("exponent", 2.0) in piece.act.constants
    assert "stribeck_limits" in piece.identity and "exponent" in piece.identity


def test_an_idle_part_of_an_effect_is_left_out():
    parts = pieces_of(LIBRARY["friction_drift"], ["viscous_change", "time_constant"])
    assert [piece.port for piece in parts] == ["load"]
