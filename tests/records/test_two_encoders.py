"""Logs with an encoder on the motor beside that of the link: which is which, in which angles."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.records import Record, Robot, read_record
from clie_blocks.analysis.records.columns import find_columns
from clie_blocks.analysis.records.corrections import examine
from clie_blocks.analysis.records.robot_sections import Encoder, Motor
from clie_blocks.analysis.records.single_changes import scaled
from clie_blocks.analysis.records.two_encoders import other_encoder, with_law_encoder
from clie_blocks.analysis.records.write import write_record
from clie_blocks.errors import RecordError

TIME = 0.01 * np.arange(400)
LINK = np.stack([np.sin(TIME), 0.3 + 0.5 * np.cos(2 * TIME)], axis=1)
TWIST = 0.01 * np.sin(9 * TIME)[:, None]
RATIO = np.array([50.0, 80.0])


def robot(mounting=None, ratio=RATIO):
    return Robot(n=2, motor=Motor(gear_ratio=ratio), encoder=Encoder(mounting=mounting))


def record(q_motor, **more):
    return Record(time=TIME, q=LINK, u=0 * LINK, q_motor=q_motor, source="log-1", **more)


@pytest.mark.parametrize("factor, side", [(1.0, "joint"), (RATIO, "motor")])
@pytest.mark.parametrize("mounting", [None, "joint side", "motor side"])
def test_the_law_has_the_encoder_that_the_file_names(factor, side, mounting):
    one, = with_law_encoder([record(factor * (LINK + TWIST))], robot(mounting))
    of_law, other = (LINK + TWIST, LINK) if mounting == "motor side" else (LINK, LINK + TWIST)
    np.testing.assert_allclose(one.q, of_law, atol=1e-12)
    np.testing.assert_allclose(other_encoder(one), other, atol=1e-12)
    assert one.q_motor is None
    assert f"q_motor is in angles of the {side}, by how far it moves." in one.decisions
    again, = with_law_encoder([one], robot(mounting))
    assert again is one


def test_a_motor_may_turn_against_its_joint():
    one, = with_law_encoder([record(RATIO * [1, -1] * LINK)], robot())
    np.testing.assert_allclose(other_encoder(one), LINK, atol=1e-12)
    assert any("turns against q at joint2" in sentence for sentence in one.decisions)


@pytest.mark.parametrize("factor, ratio, message", [
    (np.degrees(1.0), RATIO, "moves 57.3 times as far as q, and gear_ratio is 80"),
    (50.0, None, "moves 50 times as far as q, and no gear_ratio is stated: .*leave the col")])
def test_angles_of_neither_side_are_refused(factor, ratio, message):
    with pytest.raises(RecordError, match=f"log-1: q_motor of joint. {message}"):
        examine([record(factor * LINK)], robot(ratio=ratio))


def test_samples_without_the_motor_do_not_count_and_few_are_no_encoder():
    q_motor = RATIO * LINK
    q_motor[7] = np.nan
    one, = with_law_encoder([record(q_motor)], robot())
    assert np.flatnonzero(~one.valid).tolist() == [7]
    q_motor[:200] = np.nan
    one, = with_law_encoder([record(q_motor)], robot())
    assert other_encoder(one) is None and one.valid.all()
    with pytest.raises(RecordError, match="more than a tenth.*leave it out"):
        with_law_encoder([record(q_motor)], robot("motor side"))


def test_a_correction_of_the_angles_is_one_of_both_encoders():
    one, = with_law_encoder([record(LINK)], robot())
    turned = scaled(one, ("q", "qd"), (1,), np.array([-1.0, -1.0]))
    np.testing.assert_allclose(other_encoder(turned), LINK * [1, -1])
    np.testing.assert_allclose(other_encoder(scaled(one, ("u",), (1,), -np.ones(2))), LINK)


@pytest.mark.parametrize("header, columns", [
    ("time,q1,q2,u1,u2,q_motor1,q_motor2", {"q": [1, 2], "u": [3, 4], "q_motor": [5, 6]}),
    ("time,q_arm,u_arm,q_motor_arm", {"q": [1], "u": [2], "q_motor": [3]}),
    ("time,q,u,q_motor", {"q": [1], "u": [2], "q_motor": [3]}),
    # joints with such names, and no second encoder
    ("time,q_motor1,q_motor2,u_motor1,u_motor2", {"q": [1, 2], "u": [3, 4]}),
    ("time,q_motor,u_motor", {"q": [1], "u": [2]}),
    ("time,q_arm,q_motor,u_arm,u_motor", {"q": [1, 2], "u": [3, 4]})])
def test_columns_of_motors_count_beside_those_of_their_joints(header, columns):
    assert find_columns(header.split(","), "log.csv").columns == columns


def test_both_are_written_and_read_again(tmp_path):
    units = {"q_motor": "m"}
    path = write_record(dataclasses.replace(record(RATIO * LINK), units=units),
                        tmp_path / "log.csv")
    again = read_record(path)
    np.testing.assert_array_equal(again.q_motor, RATIO * LINK)
    assert again.units["q_motor"] == ("m", "m")


def test_a_link_that_rattles_in_its_play_moves_less_far_or_farther_than_its_motor():
    """Play is no wrong unit: what it changes is not in proportion to the motion."""
    rattled = RATIO * (0.85 * LINK + 0.3 * np.sin(9 * TIME)[:, None])
    one, = with_law_encoder([record(rattled)], robot())
    np.testing.assert_allclose(other_encoder(one), rattled / RATIO)
    with pytest.raises(RecordError, match="moves 42.* times as far as q, and gear_ratio is 50"):
        with_law_encoder([record(0.85 * RATIO * (LINK + TWIST))], robot())
