"""The known data sets and the blind trials, as real files: counts, units, controllers."""

import subprocess
import sys

import numpy as np
import pytest

from clie_blocks.analysis.records import read_record, read_records, read_robot, read_trial
from clie_blocks.errors import RecordError


def test_emps(shared):
    robot, (train, pulses) = read_trial(shared / "data" / "emps")
    assert len(train) == len(pulses) == 24_841
    assert train.units["q"] == ("m",)
    assert train.units["u"] == ("V",)
    assert robot.controller.law == "cascade"
    assert train.sample_time == pytest.approx(1e-3, rel=1e-4)
    assert train.pe is None
    assert set(np.round(np.unique(pulses.pe), 9)) == {0.0, 5.07}
    # the law in its README: kp kv (qd - q) - kv dq + pe, dq over two samples, to about 10 mV
    kp, kv = robot.controller.kp[0], robot.controller.kv[0]
    for record, pe in ((train, 0.0), (pulses, pulses.pe[2:, 0])):
        q, dq = record.q[2:, 0], (record.q[2:, 0] - record.q[:-2, 0]) / 2e-3
        law = np.clip(kp * kv * (record.qd[2:, 0] - q) - kv * dq + pe, -10, 10)
        assert np.sqrt(np.mean((record.u[2:, 0] - law) ** 2)) < 0.012


def test_bam(shared):
    records = read_records(shared / "data" / "bam_xl330")
    assert len(records) == 16
    assert sum(len(record) for record in records) == 19_452
    assert len({record.source for record in records}) == 16
    for record in records:
        controller, on = record.robot.controller, record.extra["torque_enable"] > 0
        duty = np.clip(controller.kp * (record.qd - record.q), -1, 1)
        residual = np.sqrt(np.mean((record.u - duty)[on] ** 2))
        assert controller.law == "servo"
        assert residual < 0.025  # duty, as its README says
        assert 5 < record.extra["supply"].mean() < 10
    assert records[0].robot.links.mass == 0.49


def test_so101(shared):
    records = read_records(shared / "data" / "sage_so101")
    assert len(records) == 50
    assert sum(len(record) for record in records) == 225_145
    assert records[0].joints[:3] == ("rotation", "pitch", "elbow")
    assert records[0].u is None and records[0].tau is None
    assert (records[0].extra["tau_abs"] >= 0).all()
    assert records[0].sample_time == pytest.approx(0.02, rel=0.01)
    assert any("without sign" in sentence for sentence in records[0].decisions)


def test_double_pendulum(shared):
    records = read_records(shared / "data" / "dfki_double_pendulum")
    assert len(records) == 28
    assert sum(len(record) for record in records) == 131_631
    assert {record.robot.name[-3:] for record in records} == {"A.0", "C.0", "C.1"}
    assert all(record.valid.all() for record in records)
    unphysical = [record.robot for record in records if record.robot.links.inertia is None]
    assert {robot.name[-3:] for robot in unphysical} == {"C.0"}  # I2 below m2 r2^2 there


def test_a_blind_trial(shared):
    folder = shared / "blind" / "practice" / "trial-000"
    if not folder.is_dir():
        pytest.skip("needs the blind trials")
    robot, records = read_trial(folder)
    assert [record.source[-12:] for record in records] == [f"log-{k}.csv.gz" for k in (1, 2, 3)]
    for k, record in enumerate(records, 1):
        assert record.robot is robot
        assert record.decisions == ()  # the plain format leaves nothing to guess
        assert record.signals == ("q", "u", "qd", "pe")
        assert record.valid.all()
        assert record.duration == pytest.approx(robot.experiments[f"log-{k}"].duration, abs=0.002)
        start = robot.experiments[f"log-{k}"].start
        np.testing.assert_allclose(record.q[0], start, atol=5 * robot.encoder.resolution[0])
    single = read_record(folder / "log-2.csv.gz")  # finds robot.toml beside it
    np.testing.assert_array_equal(single.q, records[1].q)


def write_trial(folder):
    folder.mkdir()
    (folder / "robot.toml").write_text("joints = 1\n[controller]\nKp = 2\nKd = 1\n")
    for k in (2, 10, 1):
        (folder / f"log-{k}.csv").write_text(f"time,q1,u1\n0,{k},0\n0.001,{k},0\n")


def test_logs_of_a_trial_come_in_the_order_of_their_numbers(tmp_path):
    write_trial(tmp_path / "trial")
    robot, records = read_trial(tmp_path / "trial")
    assert [record.q[0, 0] for record in records] == [1, 2, 10]
    assert robot.controller.law == "pd"


def test_what_is_no_trial(tmp_path):
    with pytest.raises(RecordError, match="is not a folder"):
        read_trial(tmp_path / "none")
    with pytest.raises(RecordError, match="is empty, but no log; put logs beside robot.toml"):
        read_trial(tmp_path)
    write_trial(tmp_path / "trial")
    (tmp_path / "trial" / "robot.toml").write_text("joints = 2\n")
    with pytest.raises(RecordError, match="has 1 joints.*robot has 2"):
        read_trial(tmp_path / "trial")


@pytest.mark.parametrize("folder", ["emps", "bam_xl330", "sage_so101", "dfki_double_pendulum"])
def test_a_damaged_data_set_is_an_error_in_words(shared, tmp_path, folder):
    source = shared / "data" / folder
    for path in source.glob("*.*"):
        data = path.read_bytes()
        half = len(data) // 2 if path.suffix in (".parquet", ".json", ".yml") else len(data)
        (tmp_path / path.name).write_bytes(data[:half])
    with pytest.raises(RecordError, match="damaged"):
        read_records(tmp_path)


def test_the_reader_starts_without_heavy_imports():
    code = ("import sys; from clie_blocks.analysis.records import read_record, Record, Robot; "
            "heavy = {'control', 'matplotlib', 'scipy', 'pandas', 'pyarrow', 'rosbags'}; "
            "sys.exit(str(heavy & set(sys.modules)) if heavy & set(sys.modules) else 0)")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True,
                          check=False)
    assert done.returncode == 0, done.stderr


def test_the_facade_names_what_it_has():
    from clie_blocks.analysis import records

    for name in records.__all__:
        assert callable(getattr(records, name))
    with pytest.raises(AttributeError, match="reed"):
        _ = records.reed
    assert records.read_robot is read_robot
