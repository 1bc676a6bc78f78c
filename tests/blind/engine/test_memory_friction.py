"""Friction with a memory, against closed forms of its published equation."""

import numpy as np
import pytest
from scipy.optimize import brentq

from clie_blocks.analysis.blind.engine.memory_friction import (
    DahlContact,
    DraggingBrake,
    RestingContact,
    SlippingElements,
)
from clie_blocks.analysis.blind.engine.moment import Moment

H = 1e-4


def there_and_back(amplitude, cycles=3, points=800):
    return amplitude * np.sin(2 * np.pi * np.arange(cycles * points) / points)


def test_a_dahl_contact_encloses_the_area_of_its_exact_loop(one_lane, along):
    level, reach, amplitude = 0.3, 4e-3, 6e-3
    contact = DahlContact(one_lane(dahl=level, dahl_reach=reach), H)
    path = there_and_back(amplitude)
    torque, last = along(contact, path), slice(-800, None)
    area = np.trapezoid(torque[last], path[last])
    turn = level * np.tanh(amplitude / reach)  # torque at a reversal
    exact = 2 * (2 * level * amplitude
                 - (level + turn) * reach * (1 - np.exp(-2 * amplitude / reach)))
    assert area == pytest.approx(exact, rel=0.01)


@pytest.mark.parametrize("exponent", [0.5, 1.0, 2.0])
def test_a_dahl_contact_yields_by_its_power(one_lane, along, exponent):
    level, reach = 0.3, 4e-3
    path = np.linspace(0, 0.7 * reach, 2000)
    contact = DahlContact(one_lane(dahl=level, dahl_reach=reach, dahl_exponent=exponent), H)
    x = path[-1] / reach
    exact = 1 - np.exp(-x) if exponent == 1 else 1 - (1 - (1 - exponent) * x) ** (
        1 / (1 - exponent))
    assert along(contact, path)[-1] == pytest.approx(level * exact, rel=2e-3)


def test_slipping_elements_remember_where_they_turned(one_lane, along):
    level, reach = 0.2, 1e-2
    legs = [(0, 8e-3), (8e-3, 2e-3), (2e-3, 5e-3), (5e-3, 2e-3), (2e-3, 2e-2)]
    path = np.concatenate([np.linspace(*leg, 400) for leg in legs])
    torque = along(SlippingElements(one_lane(slip=level, slip_reach=reach), H), path)
    assert torque[4 * 400 - 1] == pytest.approx(torque[2 * 400 - 1])  # the minor loop closes
    assert torque[-1] == pytest.approx(level)
    first, back = torque[:400], torque[400:800]
    virgin = np.interp((8e-3 - path[400:800]) / 2, path[:400], first)
    assert back == pytest.approx(first[-1] - 2 * virgin, abs=1e-3 * level)  # Masing's rule


@pytest.mark.parametrize(("key", "law"), [
    ("dahl", lambda x, reach: 1 - np.exp(-x / reach)),
    ("slip", lambda x, reach: np.mean(np.minimum(
        x / (reach * np.arange(1, 11) / 10), 1)))])
def test_a_joint_that_is_pushed_slowly_stops_where_both_springs_balance(quiet_robot, key, law):
    joint = quiet_robot()
    kp = joint.robot.kp[0]
    level, reach, push = 0.01 * kp, 8e-3, 0.012 * kp
    experiment = joint.experiment(4.0)
    ramp = np.minimum(np.arange(len(experiment.pe)) / 2500, 1)[:, None] * push
    experiment = type(experiment)("other", experiment.start, experiment.q_d, ramp)
    q, _ = joint.run(experiment, **{key: level, f"{key}_reach": reach})
    balance = brentq(lambda x: kp * x + level * law(x, reach) - push, 0, push / kp)
    assert q[-1, 0] - q[0, 0] == pytest.approx(balance, rel=0.01)


def test_break_away_grows_while_the_contact_rests_and_is_lost_as_it_slides(one_lane, along):
    contact = RestingContact(one_lane(rest_rise=0.5, rest_half=0.2, rest_speed=0.02,
                                      rest_slide=0.01), H)
    path = np.concatenate([np.zeros(3000), np.linspace(0, 0.05, 2000)])
    level = along(contact, path)
    t = H * np.arange(1, 3001)
    assert level[:3000] == pytest.approx(0.5 * t / (t + 0.2), rel=1e-6)
    rested = contact.rest[0, 0]
    assert rested < 0.3 * np.exp(-0.05 / 0.01) * 1.1


def test_a_brake_drags_for_its_share_of_the_time(one_lane):
    class Chance:
        def __init__(self):
            self.source = np.random.default_rng(4)

        def __call__(self, kind):
            return self.source.random((1, 1))

    brake = DraggingBrake(one_lane(brake=2.0), Chance(), 0.05)
    now = Moment(0.0, *(np.zeros((1, 1)),) * 3)
    levels = np.array([brake(now)[0, 0] for _ in range(60_000)])
    assert set(levels) == {0.0, 2.0}
    assert np.mean(levels > 0) == pytest.approx(brake.ON / (brake.ON + brake.OFF), rel=0.15)


def test_uneven_friction_holds_at_its_crests_and_yields_in_its_troughs(quiet_robot):
    joint = quiet_robot()
    torque = 0.01 * joint.robot.kp
    moved = [np.ptp(joint.run(joint.experiment(torque=torque), uneven_level=torque, uneven=0.5,
                              waves=9.0, phase=top - 9.0 * joint.robot.pose)[0])
             for top in (0.0, np.pi)]
    assert moved[0] < 1e-5 < 1e-3 < moved[1]


def test_a_gear_that_loses_a_share_starts_with_what_is_left(quiet_robot):
    joint = quiet_robot()
    experiment = joint.experiment(0.03, torque=0.2 * joint.robot.kp)
    free, lossy = (np.ptp(joint.run(experiment, driven_loss=loss, driving_loss=loss)[0])
                   for loss in (0.0, 0.25))
    assert lossy == pytest.approx(0.75 * free, rel=0.02)
