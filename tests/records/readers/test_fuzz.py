"""Any bytes give a record or a `RecordError`: random bytes, and valid files mutated."""

import base64
import gzip
import io
import json
import zlib

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from clie_blocks.analysis.records import read_records, read_robot
from clie_blocks.analysis.records.model import Record, Robot
from clie_blocks.analysis.records.readers import bag, sandbox
from clie_blocks.errors import ClieError, RecordError

ROWS = "".join(f"{k / 100},{k * 0.1},{-k},{k % 3}\n" for k in range(12))
SEEDS = [
    "time,q1,u1,qd1\n" + ROWS,
    "t[ms];q_elbow[deg];u_elbow\n" + "1;2,5;3\n2;2,6;3\n3;2,7;3\n",
    "# time q1 u1\n" + "0 1 2\n0.01 1 2\n0.02 1 2\n",
    'type,timestamp,positions\nCONTROL,0,"[1, 2]"\nCONTROL,20000,"[1, 2]"\n',
    "time, success_rate, state.q[0], cmd.tau_J_d[0]\n1,1,2,3\n2,1,2,3\n",
    "time,q1\n2026-01-15T10:28:00Z,1\n2026-01-15T10:28:01Z,1\n",
    "time,q1,u1\nms,deg,V\n0,1,\n1,,2\n",
    "timestamp,actual_q_0,actual_qd_0,actual_current_0\n1700000000.0,1,2,3\n1700000000.008,1,2,3\n",
]
TOKENS = [b",", b";", b"\n", b"\r", b'"', b"[", b"]", b"nan", b"inf", b"-", b"1e999", b"1_0",
          b"\0", b"\xff\xfe", b"\xef\xbb\xbf", b"time", b"q1", b"[deg]", b"[x]", b"#", b"%", b"{",
          b"\x1f\x8b", b"PK\x03\x04", b"1700000000000000000", b"\xc2\xb2", b"9" * 400]
QUICK = settings(max_examples=120, deadline=None, derandomize=True,
                 suppress_health_check=[HealthCheck.function_scoped_fixture])


def mutated(seeds):
    """Seeds with pieces cut out, doubled, overwritten, or replaced by telling tokens."""
    def change(draw):
        data = bytearray(draw(st.sampled_from(seeds)))
        for _ in range(draw(st.integers(1, 4))):
            a = draw(st.integers(0, len(data)))
            b = draw(st.integers(a, min(len(data), a + 40)))
            data[a:b] = draw(st.one_of(st.sampled_from(TOKENS), st.binary(max_size=8),
                                       st.just(bytes(data[a:b]) * 2)))
        return bytes(data)
    return st.composite(change)()


def outcome(path):
    """Records or a `RecordError`; whatever else is raised fails the test."""
    try:
        records = read_records(path)
    except RecordError as error:
        assert str(path.parent) in str(error) or "topic" in str(error)
        return
    for record in records:
        assert isinstance(record, Record)
        assert record.q.shape == (len(record), record.n)
        assert np.isfinite(record.q[record.valid]).all()
        assert not record.q.flags.writeable


@QUICK
@given(data=mutated([seed.encode() for seed in SEEDS]))
def test_mutated_text(data, tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(data)
    outcome(path)


@QUICK
@given(data=st.binary(max_size=300), name=st.sampled_from(["a.csv", "a.npz", "a.parquet"]))
def test_random_bytes(data, name, tmp_path):
    path = tmp_path / name
    path.write_bytes(data)
    outcome(path)


@QUICK
@given(data=mutated([gzip.compress(SEEDS[0].encode(), mtime=0)]))
def test_mutated_gzip(data, tmp_path):
    path = tmp_path / "log.csv.gz"
    path.write_bytes(data)
    outcome(path)


def npz_bytes():
    buffer = io.BytesIO()
    np.savez(buffer, time=np.arange(5) / 10, q=np.ones((5, 2)))
    return buffer.getvalue()


@QUICK
@given(data=mutated([npz_bytes()]))
def test_mutated_npz(data, tmp_path):
    path = tmp_path / "log.npz"
    path.write_bytes(data)
    outcome(path)


def parquet_bytes():
    pa, pq = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    buffer = io.BytesIO()
    pq.write_table(pa.table({"time": [0.0, 0.1, 0.2], "q": [[1.0, 2.0]] * 3}), buffer)
    return buffer.getvalue()


@settings(QUICK, max_examples=60)
@given(data=st.data())
def test_mutated_parquet(data, tmp_path):
    path = tmp_path / "log.parquet"
    path.write_bytes(data.draw(mutated([parquet_bytes()])))
    outcome(path)


def in_process(module, path, **said):
    """The child's work done here, so that many files can be tried."""
    try:
        arrays, found = module.load(str(path), **said)
    except RecordError:
        return
    json.dumps(found)
    assert all(array.dtype.kind in "biuf" for array in arrays.values())


def mat_bytes(oned):
    scipy_io = pytest.importorskip("scipy.io")
    buffer = io.BytesIO()
    scipy_io.savemat(buffer, {"time": np.arange(4.0), "log": {"q": np.ones((4, 2))}},
                     oned_as=oned)
    return buffer.getvalue()


# A file found by mutation that ends SciPy 1.17 with a segmentation fault.
CRASH = (b"c-r%I4DoSvQZUssQ1EpO(M`+DNmU5QNi0drFUqx2D9A6)tk6+#E=o--Nlj76&$ChpPApOI%P&(fGE^`$ure^P"
         b"GO|=KGB7e@AOkRZ`tkv(03c=qVh$(`0<2Iz3rHClvoMro=B9E2*$Nm2eXxfz93T{j1IXMBNaix3nac>r%nUjC=|"
         b"FK7uo^}nSqP*-`U?oSiwVgb5a2{O0Le{QXeC@S0P5`})c")


def test_a_mat_file_that_crashes_its_reader(tmp_path):
    pytest.importorskip("pymatreader")
    (tmp_path / "log.mat").write_bytes(zlib.decompress(base64.b85decode(CRASH)))
    with pytest.raises(RecordError, match="log.mat crashed its reader|log.mat cannot be read"):
        read_records(tmp_path / "log.mat")


@settings(QUICK, max_examples=8)
@given(data=st.data())
def test_mutated_mat(data, tmp_path):
    path = tmp_path / "log.mat"
    path.write_bytes(data.draw(mutated([mat_bytes("row"), mat_bytes("column")])))
    outcome(path)  # in a child process, as always


def test_a_truncated_mat_file_through_the_child(tmp_path):
    (tmp_path / "log.mat").write_bytes(mat_bytes("row")[:-30])
    outcome(tmp_path / "log.mat")
    (tmp_path / "other.mat").write_bytes(b"MATLAB 5.0 MAT-file" + b"\xff" * 400)
    outcome(tmp_path / "other.mat")
    (tmp_path / "new.mat").write_bytes(b"\x89HDF\r\n\x1a\n" + b"\xff" * 400)
    outcome(tmp_path / "new.mat")


@pytest.fixture(scope="module")
def bag_seeds(tmp_path_factory):
    rosbags = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store, seeds = get_typestore(Stores.ROS2_HUMBLE), []
    header = store.types["std_msgs/msg/Header"](
        stamp=store.types["builtin_interfaces/msg/Time"](1, 0), frame_id="")
    state = store.types["sensor_msgs/msg/JointState"](
        header=header, name=["a", "b"], position=np.ones(2), velocity=np.empty(0),
        effort=np.ones(2))
    raw = store.serialize_cdr(state, "sensor_msgs/msg/JointState")
    for plugin in rosbags.StoragePlugin:
        folder = tmp_path_factory.mktemp("seed") / "bag"
        with rosbags.Writer(folder, version=9, storage_plugin=plugin) as writer:
            topic = writer.add_connection("/s", "sensor_msgs/msg/JointState", typestore=store)
            for stamp in range(3):
                writer.write(topic, stamp, raw)
        seeds += [path.read_bytes() for path in folder.glob("bag.*")]
    return seeds


@settings(QUICK, max_examples=40)
@given(data=st.data())
def test_mutated_bags(data, bag_seeds, tmp_path):
    found = data.draw(mutated(bag_seeds))
    path = tmp_path / ("log.db3" if found.startswith(b"SQLite") else "log.mcap")
    path.write_bytes(found)
    in_process(bag, path, topic=None, command_topic=None)


def test_a_damaged_bag_through_the_child(tmp_path):
    pytest.importorskip("rosbags")
    (tmp_path / "log.mcap").write_bytes(b"\x89MCAP0\r\n" + b"\0" * 50)
    outcome(tmp_path / "log.mcap")


TOML = """joints = 2
name = "arm"
[motor]
gear_ratio = [100.0, 100.0]
[controller]
Kp = [1, 2]
Kd = [1, 2]
velocity_filter_discretisation = "tustin"
[experiment.log-1]
start_rad = [0.1, 0.2]
"""


@QUICK
@given(data=mutated([TOML.encode()]))
def test_mutated_robot_files(data, tmp_path):
    path = tmp_path / "robot.toml"
    path.write_bytes(data)
    try:
        assert isinstance(read_robot(path), Robot)
    except RecordError as error:
        assert str(path) in str(error)


def test_the_child_reports_its_own_errors(tmp_path):
    with pytest.raises(ClieError, match="cannot be read as a MATLAB file"):
        (tmp_path / "log.mat").write_bytes(b"nonsense")
        sandbox.run("mat_variables.load", tmp_path / "log.mat")
