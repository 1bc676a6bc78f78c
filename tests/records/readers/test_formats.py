"""Readers of binary and folder formats, on files written by the formats' own libraries."""

import gzip
import json
import pickle
import zipfile

import numpy as np
import pytest

from clie_blocks.analysis.records import read_record, read_records, read_robot, write_record
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.records.readers import npz, options, sandbox
from clie_blocks.analysis.records.readers.formats import recognise
from clie_blocks.errors import MissingExtraError, RecordError

N = 400
TIME = np.arange(N) / 500
Q = np.column_stack([np.sin(3 * TIME), np.cos(2 * TIME)])
U = np.column_stack([np.cos(7 * TIME), TIME])


def same(record, **wanted):
    for name, value in wanted.items():
        np.testing.assert_array_equal(getattr(record, name), value)


def test_npz_with_columns_and_with_matrices(tmp_path):
    np.savez(tmp_path / "a.npz", time=TIME, q1=Q[:, 0], q2=Q[:, 1], u1=U[:, 0], u2=U[:, 1])
    np.savez_compressed(tmp_path / "b.npz", time=TIME[:, None], q=Q, u=U.T, rate=500.0)
    for name in ("a.npz", "b.npz"):
        same(read_record(tmp_path / name), time=TIME, q=Q, u=U)


def test_an_npz_bomb_is_refused_before_it_is_loaded(tmp_path, monkeypatch):
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        with archive.open("time.npy", "w", force_zip64=True) as file:
            for _ in range(110):
                file.write(b"\0" * 1_000_000)
    monkeypatch.setattr(npz, "LARGEST", 100_000_000)
    monkeypatch.setattr(np, "load", lambda *a, **k: pytest.fail("the bomb was loaded"))
    assert path.stat().st_size < 200_000
    with pytest.raises(RecordError, match=r"unpack to 0\.11 GB"):
        read_record(path)


def test_objects_in_an_npz_are_refused(tmp_path):
    np.savez(tmp_path / "a.npz", time=TIME, q1=np.array([{"x": 1}] * N, dtype=object))
    with pytest.raises(RecordError, match="'q1' holds Python objects"):
        read_record(tmp_path / "a.npz")


class Hostile:
    def __reduce__(self):
        return pytest.fail, ("a pickle was run",)


@pytest.mark.parametrize("name", ["log.pkl", "log.pt", "log.dat"])
def test_pickles_are_refused_unread(tmp_path, name):
    (tmp_path / name).write_bytes(pickle.dumps(Hostile()))
    with pytest.raises(RecordError, match="never loaded.*numpy.savez"):
        read_record(tmp_path / name)


def test_a_torch_archive_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "log.bin", "w") as archive:
        archive.writestr("archive/data.pkl", b"\x80\x02.")
    with pytest.raises(RecordError, match="never loaded"):
        read_record(tmp_path / "log.bin")


def test_a_spreadsheet_is_told_apart(tmp_path):
    with zipfile.ZipFile(tmp_path / "log.xlsx", "w") as archive:
        archive.writestr("xl/workbook.xml", "<workbook/>")
    with pytest.raises(RecordError, match="save the sheet with the log as CSV"):
        read_record(tmp_path / "log.xlsx")


def test_parquet_with_columns_and_with_lists(tmp_path):
    pa, pq = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    flat = {"time": TIME, "q1": Q[:, 0], "q2": Q[:, 1], "u1": U[:, 0], "u2": U[:, 1]}
    pq.write_table(pa.table(flat), tmp_path / "a.parquet", row_group_size=100)
    listed = {"time": TIME, "position": Q.tolist(), "u": U.tolist()}
    pq.write_table(pa.table(listed), tmp_path / "b.parquet")
    for name in ("a.parquet", "b.parquet"):
        same(read_record(tmp_path / name), time=TIME, q=Q, u=U)


def test_parquet_nulls_are_masked(tmp_path):
    pa, pq = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    q = [None if k == 7 else float(k) for k in range(N)]
    pq.write_table(pa.table({"time": TIME, "q1": q}), tmp_path / "a.parquet")
    record = read_record(tmp_path / "a.parquet")
    assert np.flatnonzero(~record.valid).tolist() == [7]


def test_parquet_with_dates_and_the_emps_file_alone(tmp_path, shared):
    pa, pq = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    dates = np.datetime64("2026-01-15T10:00:00", "ns") + (TIME * 1e9).astype("m8[ns]")
    pq.write_table(pa.table({"time": dates, "q1": TIME}), tmp_path / "a.parquet")
    record = read_record(tmp_path / "a.parquet")
    np.testing.assert_allclose(record.time, TIME, atol=1e-6)
    assert any("counts from 1970" in sentence for sentence in record.decisions)
    emps = read_record(shared / "data" / "emps" / "DATA_EMPS.parquet")
    assert emps.units["q"] == ("m",) and emps.robot.controller.law == "cascade"


def test_a_universal_robots_log(tmp_path):
    names = ["timestamp", *(f"{part}_{k}" for part in ("target_q", "actual_q", "actual_qd",
                                                       "actual_current") for k in range(2))]
    rows = np.column_stack([1.7e9 + TIME, Q, Q + 1, U, 2 * U])
    lines = [" ".join(names), *(" ".join(map(repr, row)) for row in rows.tolist())]
    (tmp_path / "robot_data.csv").write_text("\n".join(lines))
    record = read_record(tmp_path / "robot_data.csv")
    same(record, qd=Q, q=Q + 1, dq=U, u=2 * U)
    np.testing.assert_allclose(record.time, TIME, atol=1e-6)
    assert record.units["u"] == ("A", "A")
    assert "u is in A, not a torque, as its name says." in record.decisions


def test_mat_v5_with_a_structure(tmp_path):
    io = pytest.importorskip("scipy.io")
    io.savemat(tmp_path / "a.mat", {"log": {"time": TIME, "q": Q, "u": U.T}, "note": "hello"})
    same(read_record(tmp_path / "a.mat"), time=TIME, q=Q, u=U)


def test_mat_v73(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as file:
        for name, value in {"time": TIME[:, None], "q": Q, "u": U}.items():
            data = file.create_dataset(name, data=value.T)  # MATLAB stores columns first
            data.attrs["MATLAB_class"] = np.bytes_("double")
    with open(tmp_path / "a.mat", "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(116) + b" " * 8 + b"\x00\x02IM")
    same(read_record(tmp_path / "a.mat"), time=TIME, q=Q, u=U)


def test_the_emps_archive_as_published(tmp_path, shared):
    io, pq = pytest.importorskip("scipy.io"), pytest.importorskip("pyarrow.parquet")
    for stem in ("DATA_EMPS", "DATA_EMPS_PULSES"):
        table = pq.read_table(shared / "data" / "emps" / f"{stem}.parquet")
        io.savemat(tmp_path / f"{stem}.mat",
                   {name: table[name].to_numpy()[:, None] for name in table.column_names})
    ours, theirs = read_records(tmp_path), read_records(shared / "data" / "emps")
    assert len(ours) == len(theirs) == 2
    for a, b in zip(ours, theirs):
        same(a, time=b.time, q=b.q, u=b.u, qd=b.qd)
        assert a.robot.controller.law == "cascade"
        assert a.units["q"] == ("m",)
    same(ours[1], pe=theirs[1].pe)


def test_a_child_that_needs_too_much_memory_is_an_error(tmp_path, monkeypatch):
    io = pytest.importorskip("scipy.io")
    io.savemat(tmp_path / "a.mat", {"time": np.zeros(30_000_000)})
    monkeypatch.setattr(sandbox, "MEMORY", 350_000_000)
    with pytest.raises(RecordError, match="a.mat needs more memory than there is"):
        read_record(tmp_path / "a.mat")


def test_a_child_that_takes_too_long_is_an_error(tmp_path, monkeypatch):
    io = pytest.importorskip("scipy.io")
    io.savemat(tmp_path / "a.mat", {"time": TIME, "q1": TIME})
    monkeypatch.setattr(sandbox, "SECONDS", 0.02)
    with pytest.raises(RecordError, match="given up"):
        sandbox.run("mat_variables.load", tmp_path / "a.mat")


def test_a_child_that_dies_is_an_error(tmp_path, monkeypatch):
    monkeypatch.setattr(sandbox.subprocess, "run",
                        lambda *a, **k: sandbox.subprocess.CompletedProcess(a, -11, b"", b""))
    with pytest.raises(RecordError, match="signal 11"):
        sandbox.run("mat_variables.load", tmp_path / "a.mat")


def bag_file(folder, storage, permute=True):
    rosbags = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = store.types
    plugin = getattr(rosbags.StoragePlugin, storage)
    with rosbags.Writer(folder, version=9, storage_plugin=plugin) as writer:
        state = writer.add_connection("/joint_states", "sensor_msgs/msg/JointState",
                                      typestore=store)
        command = writer.add_connection("/effort", "std_msgs/msg/Float64MultiArray",
                                        typestore=store)
        for k, seconds in enumerate(TIME):
            stamp = 1_700_000_000_000_000_000 + round(seconds * 1e9)
            header = kinds["std_msgs/msg/Header"](
                stamp=kinds["builtin_interfaces/msg/Time"](stamp // 10**9, stamp % 10**9),
                frame_id="")
            order = [1, 0] if permute and k % 2 else [0, 1]
            message = kinds["sensor_msgs/msg/JointState"](
                header=header, name=[("shoulder", "elbow")[i] for i in order],
                position=Q[k][order], velocity=np.empty(0), effort=U[k][order])
            writer.write(state, stamp + 50_000,
                         store.serialize_cdr(message, "sensor_msgs/msg/JointState"))
            if k >= 3:
                layout = kinds["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
                array = kinds["std_msgs/msg/Float64MultiArray"](layout=layout, data=10 * U[k])
                writer.write(command, stamp + 100,
                             store.serialize_cdr(array, "std_msgs/msg/Float64MultiArray"))


@pytest.mark.parametrize("storage", ["SQLITE3", "MCAP"])
def test_a_ros_bag_with_its_command(tmp_path, storage):
    bag_file(tmp_path / "bag", storage)
    record = read_record(tmp_path / "bag", command_topic="/effort")
    np.testing.assert_allclose(record.time, TIME, atol=1e-9)
    same(record, q=Q, tau=U)
    assert record.joints == ("shoulder", "elbow")
    assert record.dq is None
    assert np.flatnonzero(~record.valid).tolist() == [0, 1, 2, 3]  # each command comes 0.1 us late
    same(record.part(4, N), u=10 * U[3:-1])


def test_a_single_mcap_file_and_the_hint_at_commands(tmp_path):
    bag_file(tmp_path / "bag", "MCAP")
    (file,) = (tmp_path / "bag").glob("*.mcap")
    record = read_record(file)
    same(record, q=Q)
    assert any("--command-topic" in sentence for sentence in record.decisions)
    with pytest.raises(RecordError, match="did you mean '/effort'"):
        read_record(file, command_topic="/efort")


def test_states_on_several_topics_are_asked_about(tmp_path):
    rosbags = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    with rosbags.Writer(tmp_path / "bag", version=9) as writer:
        for topic in ("/left", "/right"):
            writer.add_connection(topic, "sensor_msgs/msg/JointState", typestore=store)
    with pytest.raises(RecordError, match="joint states on /left, /right; choose one: --topic"):
        read_record(tmp_path / "bag")
    with pytest.raises(RecordError, match="/left has no usable joint states"):
        read_record(tmp_path / "bag", topic="/left")


@pytest.mark.parametrize("text", ["{", "[]", '{"features": {}}', '{"features": 3}'])
def test_a_lerobot_folder_with_a_damaged_description(tmp_path, text):
    (tmp_path / "meta").mkdir()
    (tmp_path / "meta" / "info.json").write_text(text)
    with pytest.raises(RecordError, match="info.json cannot be read as JSON"):
        read_records(tmp_path)


def test_a_lerobot_folder_without_data(tmp_path):
    lerobot_folder(tmp_path / "set", "v3.0", 1.0, None)
    assert read_records(tmp_path / "set")[0].joints == ("joint1", "joint2")
    assert read_records(tmp_path / "set")[0].units["q"] == ("rad", "rad")
    (tmp_path / "set" / "data" / "chunk-000" / "file-000.parquet").unlink()
    with pytest.raises(RecordError, match="downloaded without its data"):
        read_records(tmp_path / "set")


def lerobot_folder(folder, version, scale, names):
    pa, pq = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    (folder / "meta").mkdir(parents=True)
    feature = {"dtype": "float32", "shape": [2], "names": names}
    (folder / "meta" / "info.json").write_text(json.dumps(
        {"codebase_version": version, "fps": 50, "features": {"observation.state": feature,
                                                              "action": feature}}))
    chunk = folder / "data" / "chunk-000"
    chunk.mkdir(parents=True)
    tables = [pa.table({
        "observation.state": pa.array((scale * Q[:100]).astype(np.float32).tolist(),
                                      pa.list_(pa.float32())),
        "action": pa.array((scale * Q[:100]).astype(np.float32).tolist(), pa.list_(pa.float32())),
        "timestamp": pa.array((np.arange(100) / 50).astype(np.float32)),
        "frame_index": np.arange(100), "episode_index": np.full(100, episode)})
        for episode in range(2)]
    if version == "v2.1":
        for episode, table in enumerate(tables):
            pq.write_table(table, chunk / f"episode_{episode:06d}.parquet")
    else:
        pq.write_table(pa.concat_tables(tables), chunk / "file-000.parquet")


@pytest.mark.parametrize("version", ["v2.1", "v3.0"])
def test_lerobot_episodes(tmp_path, version):
    lerobot_folder(tmp_path / "set", version, 120.0, ["shoulder_pan.pos", "elbow_flex.pos"])
    records = read_records(tmp_path / "set")
    assert [len(record) for record in records] == [100, 100]
    assert records[0].joints == ("shoulder_pan", "elbow_flex")
    assert records[0].u is None
    np.testing.assert_allclose(records[1].q, np.deg2rad(120 * Q[:100]), rtol=1e-6)
    assert any("degrees" in sentence for sentence in records[0].decisions)
    with pytest.raises(RecordError, match="has 2 runs"):
        read_record(tmp_path / "set")


def test_lerobot_keeps_an_unknown_unit_until_it_is_stated(tmp_path):
    lerobot_folder(tmp_path / "set", "v3.0", 90.0, {"motors": ["a", "b"]})
    assert read_records(tmp_path / "set")[0].units["q"] == ("%", "%")
    (tmp_path / "robot.toml").write_text('joints = 2\njoint_names = ["b", "a"]\n'
                                         '[units]\nq = "deg"\n')
    record = read_record(tmp_path / "set", part=0)  # robot.toml beside the folder
    assert record.joints == ("b", "a")
    np.testing.assert_allclose(record.q[:, 1], np.deg2rad(90 * Q[:100, 0]), rtol=1e-6)


def sage_folder(folder, factor, word):
    folder.mkdir()
    goal = [f'CONTROL,{float(t * factor)!r},"{q.tolist()}"' for t, q in zip(TIME[::5], Q[::5])]
    state = [f'{word},{float(t * factor)!r},"{q.tolist()}","{u.tolist()}","{u.tolist()}"'
             for t, q, u in zip(TIME, Q, U)]
    (folder / "control.csv").write_text("\n".join(["type,timestamp,positions", *goal]))
    (folder / "state_motor.csv").write_text("\n".join(
        ["type,timestamp,positions,velocities,torques", *state]))
    (folder / "joint_list.txt").write_text("Rotation\nPitch\n")


@pytest.mark.parametrize("factor, word", [(1e6, "StateMotor"), (1.0, "STATE_MOTOR")])
def test_sage_in_microseconds_and_in_seconds(tmp_path, factor, word):
    sage_folder(tmp_path / "run", factor, word)
    record = read_record(tmp_path / "run")
    np.testing.assert_allclose(record.time, TIME, atol=1e-12)
    same(record, q=Q, dq=U, tau=U, qd=np.repeat(Q[::5], 5, axis=0))
    assert record.joints == ("Rotation", "Pitch")


def franka_file(path):
    names = ["time", "success_rate"]
    for part in ("state.q", "state.q_d", "state.dq", "state.tau_J"):
        names += [f"{part}[{k}]" for k in range(2)]
    names += ["cmd.q_d[0]", "cmd.q_d[1]", "cmd.tau_J_d[0]", "cmd.tau_J_d[1]"]
    sent = np.vstack([np.zeros((1, 2)), U[:-1]])  # the row of state k has the command of k - 1
    rows = np.column_stack([1000 * TIME, np.ones(N), Q, Q, U, U, Q, sent])
    lines = [", ".join(names), *(",".join(map(repr, row)) for row in rows.tolist())]
    path.write_text("\n".join(lines) + "\n")


def test_libfranka_commands_are_moved_by_one_sample(tmp_path):
    franka_file(tmp_path / "log.csv")
    record = read_record(tmp_path / "log.csv")
    np.testing.assert_allclose(record.time, TIME, atol=1e-12)
    same(record.part(0, N - 1), q=Q[:-1], u=U[:-1], dq=U[:-1], qd=Q[:-1])
    assert np.flatnonzero(~record.valid).tolist() == [N - 1]
    assert any("moved by one row" in sentence for sentence in record.decisions)


def test_a_missing_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pyarrow.parquet", None)
    (tmp_path / "a.parquet").write_bytes(b"PAR1....PAR1")
    with pytest.raises(MissingExtraError, match=r"pyarrow.*\[parquet\]"):
        read_record(tmp_path / "a.parquet")
    assert MissingExtraError.exit_code == 2


@pytest.mark.parametrize("head, name", [
    (b"PAR1", "parquet"), (b"\x89MCAP0\r\n", "bag"), (b"SQLite format 3\0", "bag"),
    (b"MATLAB 5.0", "mat"), (b"time,q1\n0,0", "csv")])
def test_formats_are_recognised_by_content(tmp_path, head, name):
    (tmp_path / "log").write_bytes(head)
    assert recognise(tmp_path / "log") == name


def test_paths_that_cannot_be_read(tmp_path):
    with pytest.raises(RecordError, match="does not exist"):
        read_record(tmp_path / "no.csv")
    with pytest.raises(RecordError, match="is empty, but no log"):
        read_record(tmp_path)
    (tmp_path / "empty.csv").touch()
    with pytest.raises(RecordError, match="is empty"):
        read_record(tmp_path / "empty.csv")
    with pytest.raises(RecordError, match="Not a directory"):
        read_record(tmp_path / "empty.csv" / "x.csv")


def test_a_file_without_permission(tmp_path, monkeypatch):
    (tmp_path / "a.csv").write_text("time,q1\n0,0\n")

    def refuse(*args, **kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("builtins.open", refuse)
    with pytest.raises(RecordError, match="cannot open .*Permission denied"):
        recognise(tmp_path / "a.csv")


def test_a_robot_beside_the_log_is_used_and_named(tmp_path):
    record = Record(TIME, Q, U)
    write_record(record, tmp_path / "a.csv")
    (tmp_path / "robot.toml").write_text("joints = 2\n[motor]\ngear_ratio = [3, 4]\n")
    found = read_record(tmp_path / "a.csv")
    np.testing.assert_array_equal(found.robot.motor.gear_ratio, [3, 4])
    assert any("lies next to the log" in sentence for sentence in found.decisions)
    other = read_robot(tmp_path / "robot.toml")
    assert read_record(tmp_path / "a.csv", other).robot is other


def test_foreign_faults_become_record_errors():
    with pytest.raises(RecordError, match="x cannot be read as a thing: boom"):
        with options.library_errors("x", "a thing"):
            raise ZeroDivisionError("boom")


def test_arrays_of_other_lengths_are_left_out(tmp_path):
    columns = npz.of_one_length({"time": TIME, "q": Q, "gain": np.ones(3)}, "x")
    assert set(columns) == {"time", "q"}
    with gzip.open(tmp_path / "a.csv.gz", "wt") as file:
        file.write("time,q1\n")
    with pytest.raises(RecordError, match="no samples"):
        read_record(tmp_path / "a.csv.gz")
