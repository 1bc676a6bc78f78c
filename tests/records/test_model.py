"""The record itself: read-only, complete, and clear about what is wrong with it."""

import pickle

import numpy as np
import pytest

from clie_blocks.analysis.records.model import Record, Robot
from clie_blocks.errors import RecordError

TIME = np.arange(5) / 10
Q = np.arange(10.0).reshape(5, 2)


def test_arrays_are_copies_and_read_only():
    q = Q.copy()
    record = Record(TIME, q, u=q)
    q[0, 0] = 99
    assert record.q[0, 0] == 0
    for array in (record.time, record.q, record.u, record.valid):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
    with pytest.raises(TypeError, match="do not change"):
        record.units["q"] = "deg"


def test_a_read_only_array_is_not_copied():
    q = Q.copy()
    q.flags.writeable = False
    assert Record(TIME, q).q is q


def test_one_joint_may_be_given_flat():
    record = Record(TIME, TIME, u=TIME)
    assert record.q.shape == record.u.shape == (5, 1)
    assert record.joints == ("joint1",)


def test_defaults_and_derived_values():
    record = Record(TIME, Q, units={"u": "V"}, decisions=["said"])
    assert record.signals == ("q",)
    assert record.units["u"] == ("V", "V")
    assert record.units["q"] == ("rad", "rad")
    assert record.units["time"] == "s"
    assert record.segments == ((0, 5),)
    assert record.decisions == ("said",)
    assert (record.n, len(record)) == (2, 5)
    assert record.duration == pytest.approx(0.4)
    assert record.sample_time == pytest.approx(0.1)


def test_samples_with_holes_are_masked():
    q, u = Q.copy(), Q.copy()
    q[1, 0], u[3, 1] = np.nan, np.inf
    assert Record(TIME, q, u).valid.tolist() == [True, False, True, False, True]


@pytest.mark.parametrize("fields, message", [
    ({"time": TIME[:4]}, "4 stamps but 5 positions"),
    ({"u": Q[:, :1]}, r"u of shape \(5, 1\), but N x n is \(5, 2\)"),
    ({"q": [["a", "b"]] * 5}, "q that is not numeric"),
    ({"time": [0, 1, np.nan, 3, 4]}, "stamps that are NaN or infinite"),
    ({"joints": ("a",)}, "2 joints but 1 names"),
    ({"joints": ("a", "a")}, "one joint 'a'"),
    ({"valid": [True]}, r"mask of shape \(1,\)"),
    ({"units": {"qq": "rad"}}, "did you mean 'qd'|did you mean 'q'"),
    ({"units": {"q": ("rad",)}}, "2 joints but 1 units"),
    ({"segments": [(0, 9)]}, "segments that do not lie in order"),
    ({"segments": [(3, 5), (0, 3)]}, "segments that do not lie in order"),
    ({"extra": {"supply": TIME[:2]}}, "channel 'supply'"),
    ({"q": Q[0]}, "5 stamps but 2 positions"),
    ({"robot": Robot(3)}, "its robot has 3"),
    ({"time": [], "q": np.empty((0, 2))}, "no samples"),
])
def test_what_does_not_fit_is_named(fields, message):
    with pytest.raises(RecordError, match=f"a.csv (has|gives|names) .*({message})"):
        Record(**{"time": TIME, "q": Q, "source": "a.csv", **fields})


def test_a_part_keeps_masks_segments_and_channels():
    record = Record(TIME, Q, valid=[1, 1, 0, 1, 1], segments=[(0, 3), (3, 5)],
                    extra={"supply": TIME})
    part = record.part(1, 4)
    np.testing.assert_array_equal(part.q, Q[1:4])
    assert part.valid.tolist() == [True, False, True]
    assert part.segments == ((0, 2), (2, 3))
    np.testing.assert_array_equal(part.extra["supply"], TIME[1:4])


def test_joints_are_found_by_name_or_number():
    record = Record(TIME, Q, joints=("shoulder", "elbow"))
    assert record.joint("elbow") == record.joint(1) == 1
    with pytest.raises(RecordError, match="did you mean 'elbow'"):
        record.joint("elbw")


def test_a_robot_orders_the_joints_of_its_record():
    robot = Robot(2, joints=("elbow", "shoulder"))
    record = Record(TIME, Q, joints=("shoulder", "elbow"), units={"q": ("rad", "m")},
                    extra={"current": Q, "supply": TIME})
    ordered = record.of_robot(robot)
    np.testing.assert_array_equal(ordered.q, Q[:, ::-1])
    assert ordered.units["q"] == ("m", "rad")
    np.testing.assert_array_equal(ordered.extra["current"], Q[:, ::-1])
    np.testing.assert_array_equal(ordered.extra["supply"], TIME)
    with pytest.raises(RecordError, match="did you mean 'elbow'"):
        Record(TIME, Q, joints=("shoulder", "ellbow")).of_robot(robot)
    assert record.of_robot(Robot(2)).joints == ("shoulder", "elbow")


def test_notes_are_added_not_changed():
    record = Record(TIME, Q)
    assert record.noted("a", "b").decisions == ("a", "b")
    assert record.decisions == ()


def test_records_and_robots_travel_to_workers():
    record = Record(TIME, Q, extra={"supply": TIME}, robot=Robot(2))
    twin = pickle.loads(pickle.dumps(record))
    np.testing.assert_array_equal(twin.q, record.q)
    assert twin.units == record.units
    assert not twin.q.flags.writeable
