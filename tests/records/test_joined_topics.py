"""Exports that join topics of different clocks: the positions keep their rows, the rest holds."""

import numpy as np

from clie_blocks.analysis.records import read_record

HEADER = ("__time,/joint_states/position/pan,/joint_states/effort/pan,"
          "/controller/reference/pan/position,/controller/command/pan/effort,/battery/voltage")


def export(path, messages=200):
    """States every 10 ms, references every 20 ms and 3 ms later, a voltage now and then."""
    rows = []
    for k in range(messages):
        rows.append((0.01 * k, f"{0.1 * k},{k},,,"))
        if k % 2 == 0:
            rows.append((0.01 * k + 0.003, f",,{k},{-k},"))
        if k % 9 == 0:
            rows.append((0.01 * k + 0.005, ",,,,24"))
    path.write_text("\n".join([HEADER, *(f"{time:.3f},{row}" for time, row in rows)]) + "\n")
    return path


def test_the_last_value_of_a_topic_holds(tmp_path):
    record = read_record(export(tmp_path / "log.csv"))
    k = np.arange(200)
    np.testing.assert_allclose(record.time, 0.01 * k, atol=1e-9)
    np.testing.assert_allclose(record.q[:, 0], 0.1 * k)
    np.testing.assert_array_equal(record.tau[:, 0], k)
    np.testing.assert_array_equal(record.qd[1:, 0], (k[1:] - 1) // 2 * 2)
    np.testing.assert_array_equal(record.u[1:, 0], -((k[1:] - 1) // 2 * 2))
    assert not record.valid[0] and record.valid[1:].all()  # no command before the first state
    assert record.segments == ((0, 200),)
    assert any("kept the 200 of 323 rows that have a position. Held from its own time to the "
               "next: u, qd." in note for note in record.decisions)


def test_a_dropout_is_no_topic(tmp_path):
    lines = ["time,q1,u1", *(f"{0.01 * k:.2f},{'' if 50 < k < 60 or k % 17 == 3 else k},1"
                             for k in range(200))]
    (tmp_path / "log.csv").write_text("\n".join(lines) + "\n")
    record = read_record(tmp_path / "log.csv")
    assert len(record) == 200 and np.count_nonzero(~record.valid) == 20
