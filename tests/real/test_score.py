"""Answers beside a truth that is known."""

import pytest

from clie_blocks.analysis.real.outcome import Outcome, Quantity
from clie_blocks.analysis.real.score import score
from clie_blocks.analysis.real.truth import Run, Size
from clie_blocks.errors import RecordError

JOINTS = ("hip", "thigh")


def outcome(*effects, set_90=None, **quantities):
    rows = [{"effect": name, "joint": joint, "probability": probability}
            for name, joint, probability in effects]
    answer = {"verdict": "effect", "unexplained": False, "effects": rows,
              "set_90": set_90 or [rows[0]["effect"]]}
    return Outcome(answer, {key.replace("__", "."): value for key, value in quantities.items()},
                   JOINTS)


def run(**fields):
    return Run("laps", ("a",), **fields)


def test_any_name_of_the_class_is_right():
    found = score(run(cause=("coulomb", "dahl"), joint=("thigh",)),
                  outcome(("dahl", [2], 0.8), ("coulomb", [2], 0.1)))
    assert (found.is_first, found.is_joint, found.is_in_set) == (True, True, True)


def test_a_cause_at_another_joint_is_at_the_wrong_one():
    found = score(run(cause=("coulomb",), joint=("thigh",)), outcome(("coulomb", [1, 2], 0.8)))
    assert (found.is_first, found.is_joint) == (True, False)


def test_what_is_there_besides_is_passed_over():
    found = score(run(cause=("time_delay",), also=("encoder_quantization",)),
                  outcome(("encoder_quantization", [1], 0.97), ("time_delay", [1], 0.96)))
    assert found.is_first and not found.false


def test_a_cause_in_the_set_is_not_first():
    found = score(run(cause=("coulomb",)), outcome(("unknown", None, 0.6), ("coulomb", [1], 0.4),
                                                   set_90=["unknown", "coulomb"]))
    assert (found.is_first, found.is_joint, found.is_in_set) == (False, None, True)


@pytest.mark.parametrize(("probability", "false"), [(0.49, ()), (0.51, ("time_delay",))])
def test_an_absent_effect_is_false_from_half_the_probability_on(probability, false):
    found = score(run(absent=("time_delay",)), outcome(("time_delay", [1], probability),
                                                       ("none", None, 1 - probability)))
    assert found.false == false and found.is_first is None


def test_whatever_is_named_at_a_control_joint_is_false():
    found = score(run(cause=("coulomb",), control=("hip",)), outcome(("coulomb", [1, 2], 0.9)))
    assert found.false == ("coulomb at hip",)


@pytest.mark.parametrize(("quantity", "right"), [
    (Quantity(3.3, 3.2, 3.4), True),  # within 10 %
    (Quantity(4.0, 3.0, 5.0), True),  # its interval holds the truth
    (Quantity(4.0, 3.9, 4.1), False), (None, False)])
def test_a_size_is_right_within_ten_percent_or_its_interval(quantity, right):
    quantities = {} if quantity is None else {"coulomb__level": quantity}
    (size,) = score(run(size=(Size("coulomb.level", 2.5, 3.1),)),
                    outcome(("coulomb", [1], 0.9), **quantities)).sizes
    assert size.is_right == right


def test_a_truth_of_a_joint_that_is_not_there_is_refused():
    with pytest.raises(RecordError, match="joint 'tigh' that the robot does not have.*thigh"):
        score(run(cause=("coulomb",), joint=("tigh",)), outcome(("coulomb", [2], 0.8)))
