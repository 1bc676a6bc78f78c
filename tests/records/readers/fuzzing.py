"""Damaged logs and robot files without end, and a process of its own that reads them.

Input number k of a kind is the same on every machine.  Run as a program, this reads a range of
them: the number of each is written down before it is read, so that the one that ends or stops the
process is known.
"""

import gzip
import io
import json
import random
import re
import resource
import struct
import sys
import time
import traceback
import warnings
import zipfile
from pathlib import Path

import numpy as np

from clie_blocks.analysis.records import read_records, read_robot
from clie_blocks.analysis.records.check_report import as_text, check_log
from clie_blocks.analysis.records.model import Record, Robot
from clie_blocks.analysis.records.readers import bag, mat_variables
from clie_blocks.errors import ClieError

MEMORY = 3_000_000_000  # bytes of address space
SLOW = 3.0  # s of computing that no input of these sizes may take
CHECKED = 8  # one record in so many is checked too

ROWS = "".join(f"{k / 100},{k * 0.1},{-k},{k % 3}\n" for k in range(12))
LONG = "".join(f"{k / 100:.2f},{np.sin(k / 9):.5f},{np.cos(k / 7):.5f}\n" for k in range(450))
CSV = [
    "time,q1,u1,qd1\n" + ROWS,
    "time,q1,u1\n" + LONG,
    "t[ms];q_elbow[deg];u_elbow\n1;2,5;3\n2;2,6;3\n3;2,7;3\n",
    "# time q1 u1\n0 1 2\n0.01 1 2\n0.02 1 2\n",
    "time,q1\n2026-01-15T10:28:00Z,1\n2026-01-15T10:28:01Z,1\n",
    "time,q1,u1\nms,deg,V\n0,1,\n1,,2\n",
    "timestamp,actual_q_0,actual_qd_0,actual_current_0\n1700000000.0,1,2,3\n1700000000.008,1,2,3\n",
    'time,q,u\n0,"[0.5, 1]","[-1.25, 2]"\n0.001,"[0.6, 1]","[1e-3, 2]"\n',
]
TWO = "time[s],actual_elbow,actual_wrist,u_elbow,u_wrist\n" + "".join(
    f"{k / 100:.2f},{np.sin(k / 9):.4f},{np.cos(k / 5):.4f},1,{k % 7}\n" for k in range(30))
FRANKA = "time, success_rate, state.q[0], cmd.tau_J_d[0]\n" + "".join(
    f"{k},1,{k / 10},{k}\n" for k in range(8))
SAGE = 'type,timestamp,positions,velocities,torques\n' + "".join(
    f'StateMotor,{k * 20000},"[{k}, 2]","[1, 2]","[3, 4]"\n' for k in range(6))
GOAL = 'type,timestamp,positions\nCONTROL,0,"[1, 2]"\nCONTROL,20000,"[1, 2]"\n'
ROBOT = """joints = 2
name = "arm"
joint_names = ["elbow", "wrist"]
[motor]
gear_ratio = [100.0, 100.0]
inertia_kgm2 = 1e-5
[links]
length_m = [0.3, 0.2]
mass_kg = [1.0, 0.5]
[controller]
law = "pd"
Kp = [1, 2]
Kd = [1, 2]
velocity_filter_highpass_rad_s = 200.0
velocity_filter_discretisation = "tustin"
sample_time_s = 0.001
[encoder]
resolution_rad = 1e-4
[experiment.log-1]
start_rad = [0.1, 0.2]
frequencies_hz = [[1.0, 2.0], [3.0]]
[units]
q = "deg"
[columns]
q = "actual_{joint}"
"""
RUNS = [{"run": 0, "trajectory": "lift", "kp": 8, "motor": "xl330", "mass": 0.5, "length": 0.1,
         "vin": 7.4}]
DESIGN = "m1: 0.5\nm2: 0.6\nr1: 0.2\nr2: 0.2\nI1: 0.05\nI2: 0.05\nl1: 0.3\nl2: 0.3\nb1: 0.0\n" \
         "b2: 0.0\nIr: 1e-4\ngr: 6.0\ntl1: 6\ntl2: 6\n"
INFO = {"fps": 30, "features": {"observation.state": {"shape": [2], "names": ["a", "b"]}}}

WORDS = [b",", b";", b"\n", b"\r", b"\t", b'"', b"'", b"[", b"]", b"{", b"}", b"=", b".", b"-",
         b"nan", b"inf", b"-inf", b"1e308", b"-1e308", b"1e999", b"1e-320", b"0", b"-0", b"1_0",
         b"0x10", b"true", b"null", b"9" * 30, b"9" * 400, b"9" * 5000, b"\0", b"\xff\xfe",
         b"\xef\xbb\xbf", b"\x1b[2J", b"\xe2\x80\xae", b"\xf0\x9f\xa4\x96", b"$\\frac{$", b"#",
         b"%", b"//", b"[deg]", b"[x]", b"{joint}", b"{k}", b"time", b"q1", b"u1", b"\xc2\xb2",
         b"\x1f\x8b", b"PK\x03\x04", b"1700000000000000000", b"2026-01-15T10:28:00Z", b"(" * 50,
         b"[" * 200, b"\\", b"\\u0000", b"\x7f", b"\x85", b"\xa0", b"e", b"," * 300]
NUMBER = re.compile(rb"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
NUMBERS = [b"0", b"-0.0", b"1", b"-1", b"2", b"1001", b"1e-300", b"5e-324", b"1e30", b"1e154",
           b"-1e200", b"1.7e308", b"-1.7e308", b"1e999", b"nan", b"inf", b"-inf", b"0x7f", b"1e",
           b"9" * 25, b"9" * 5000, b"0." + b"1" * 400, b"true", b"[1, 2]", b"[]", b"{}", b'"1"',
           b"null", b"1979-05-27", b"1,5", b""]
SIZES = [0, 1, -1, 2, 127, 128, 255, 256, 2**15, 2**16 - 1, 2**31 - 1, -2**31, 2**32 - 1, 2**40,
         2**63 - 1, -2**63]


def damaged(data, dice):
    """Bytes with a few pieces flipped, cut, doubled, moved, overwritten or made huge."""
    data = bytearray(data)
    for _ in range(dice.choice((1, 1, 1, 2, 3, 6))):
        a = dice.randrange(len(data) + 1)
        b = min(len(data), a + dice.choice((1, 1, 2, 4, 8, 40, 400)))
        act = dice.randrange(9)
        if act == 0 and a < len(data):
            data[a] ^= 1 << dice.randrange(8)
        elif act == 1:
            data[a:b] = dice.choice(WORDS)
        elif act == 2:
            data[a:b] = b""
        elif act == 3:
            data[b:b] = data[a:b] * dice.choice((1, 1, 2, 30))
        elif act == 4:
            size, form = dice.choice(((1, "b"), (2, "h"), (4, "i"), (8, "q")))
            value = dice.choice(SIZES) & (2 ** (8 * size) - 1)
            data[a:a + size] = struct.pack(dice.choice("<>") + form.upper(), value)
        elif act == 5:
            del data[a:]
        elif act == 6:
            c = dice.randrange(len(data) + 1)
            data[c:c] = data[a:b]
        elif act == 7:
            data[a:b] = dice.randbytes(b - a)
        elif act == 8:
            data[a:a] = dice.choice(WORDS)
    return bytes(data)


def other_numbers(text, dice):
    """Text with a few of its numbers replaced by telling ones."""
    for _ in range(dice.choice((1, 1, 2, 3, 10))):
        places = list(NUMBER.finditer(text))
        if places:
            place = dice.choice(places)
            text = text[:place.start()] + dice.choice(NUMBERS) + text[place.end():]
    return text


def damaged_text(data, dice):
    """Text with other numbers, with damage, or with both."""
    if dice.random() < 0.5:
        data = other_numbers(data, dice)
        if dice.random() < 0.7:
            return data
    return damaged(data, dice)


def table_bytes(columns):
    """Columns as a Parquet file."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    buffer = io.BytesIO()
    pq.write_table(pa.table(columns), buffer)
    return buffer.getvalue()


def archive(entries):
    """Entries as an uncompressed ZIP archive with right checksums."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        for name, data in entries.items():
            file.writestr(name, data)
    return buffer.getvalue()


def array_bytes(array):
    """Array as an NPY file."""
    buffer = io.BytesIO()
    np.save(buffer, array)
    return buffer.getvalue()


def matlab_bytes(**options):
    """A MATLAB file of version 5."""
    import scipy.io

    buffer = io.BytesIO()
    scipy.io.savemat(buffer, {"time": np.arange(4.0), "log": {"q": np.ones((4, 2)), "name": "x"},
                              "u": np.ones((4, 2), np.float32), "c": np.array([["a"], ["b"]])},
                     **options)
    return buffer.getvalue()


def hdf_bytes():
    """A MATLAB file of version 7.3: HDF5 behind a block of 512 bytes."""
    import h5py

    buffer = io.BytesIO()
    with h5py.File(buffer, "w", userblock_size=512) as file:
        file["time"], file["q"] = np.arange(4.0), np.ones((2, 4))
        file.create_dataset("u", data=np.ones((2, 4)), compression="gzip")
    head = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM"
    return head.ljust(512, b"\0") + buffer.getvalue()[512:]


def bag_bytes(folder, plugin):
    """Bag of joint states, as MCAP or as SQLite."""
    import rosbags.rosbag2 as rosbags
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    stamp = store.types["builtin_interfaces/msg/Time"](1, 0)
    state = store.types["sensor_msgs/msg/JointState"](
        header=store.types["std_msgs/msg/Header"](stamp=stamp, frame_id=""), name=["a", "b"],
        position=np.ones(2), velocity=np.empty(0), effort=np.ones(2))
    raw = store.serialize_cdr(state, "sensor_msgs/msg/JointState")
    name = f"seed{len(list(folder.iterdir()))}"
    with rosbags.Writer(folder / name, version=9,
                        storage_plugin=rosbags.StoragePlugin[plugin]) as writer:
        topic = writer.add_connection("/s", "sensor_msgs/msg/JointState", typestore=store)
        for nanoseconds in range(3):
            writer.write(topic, nanoseconds, raw)
    return next((folder / name).glob("seed*.*")).read_bytes()


def pick(damage, *seeds):
    """Maker of inputs that damages one of some seeds."""
    return lambda dice: damage(dice.choice(seeds), dice)


def text_files(dice):
    """Damaged text, some of it in other encodings or with other ends of lines."""
    data = damaged_text(dice.choice(CSV).encode(), dice)
    kind = dice.randrange(20)
    if kind == 0:
        return data.decode("latin-1").encode("utf-16")
    if kind == 1:
        return data.replace(b"\n", b"\r\n")
    return data


def packed_text(dice):
    """Text damaged before or after it was packed."""
    data = dice.choice(CSV).encode()
    if dice.random() < 0.5:
        return gzip.compress(damaged_text(data, dice), 1, mtime=0)
    return damaged(gzip.compress(data, 1, mtime=0), dice)


def arrays_in_archive(dice):
    """Arrays damaged inside a sound archive, or the archive itself."""
    entries = {"time.npy": array_bytes(np.arange(5) / 10), "q.npy": array_bytes(np.ones((5, 2))),
               "u.npy": array_bytes(np.ones((5, 2), np.float32))}
    if dice.random() < 0.7:
        name = dice.choice(list(entries))
        entries[name] = damaged(entries[name], dice)
        return archive(entries)
    return damaged(archive(entries), dice)


def joint_columns():
    """Columns of EMPS, BAM, SO-101 and the double pendulum."""
    ones = np.ones(4)
    time_ = np.arange(4) / 100
    six = ("rotation", "pitch", "elbow", "wrist_pitch", "wrist_roll", "jaw")
    return {
        "DATA_EMPS.parquet": {"t": time_, "qg": ones, "qm": ones, "vir": ones},
        "runs.parquet": {"run": np.zeros(4, int), "t": time_, "position": ones, "duty": ones,
                         "goal_position": ones, "speed": ones, "input_volts": ones, "temp": ones,
                         "torque_enable": ones > 0},
        "so101.parquet": {"t": time_, "motion": ["a"] * 4, **{
            f"{kind}_{joint}": ones for kind in ("q", "cmd", "dq", "tau_abs") for joint in six}},
        "sysid.parquet": {"run": ["r"] * 4, "design": ["A.0"] * 4, "t": time_, **{
            f"{name}{k}": ones for name in ("pos_meas", "tau_con", "vel_meas", "tau_meas")
            for k in (1, 2)}}}


def lerobot_files():
    """A LeRobot data set of one episode."""
    frames = {"timestamp": np.arange(4) / 30, "episode_index": np.zeros(4, int),
              "observation.state": [[1.0, 2.0]] * 4, "action": [[1.0, 2.0]] * 4}
    return {"meta/info.json": json.dumps(INFO).encode(),
            "data/chunk-000/file-000.parquet": table_bytes(frames)}


def folders():
    """Data sets of several files; one of them is damaged."""
    tables = {name: table_bytes(columns) for name, columns in joint_columns().items()}
    sets = [{"state_motor.csv": SAGE.encode(), "control.csv": GOAL.encode(),
             "joint_list.txt": b"Rotation\nPitch\n"},
            {"runs.parquet": tables["runs.parquet"], "runs.json": json.dumps(RUNS).encode(),
             "bam_params/m1.json": b'{"kt": 0.4, "R": 2.0, "armature": 0.003}'},
            {"sysid.parquet": tables["sysid.parquet"],
             "design_A.0_model_1.yml": DESIGN.encode()},
            {"DATA_EMPS.parquet": tables["DATA_EMPS.parquet"]},
            {"so101.parquet": tables["so101.parquet"]}, lerobot_files(),
            {"robot.toml": ROBOT.encode(), "log-1.csv": TWO.encode()}]

    def files(dice):
        chosen = dict(dice.choice(sets))
        name = dice.choice(list(chosen))
        damage = damaged if name.endswith(".parquet") else damaged_text
        chosen[name] = damage(chosen[name], dice)
        return chosen
    return files


def makers(kind, folder):
    """Name of the file, or None for a folder, and what makes its content."""
    return {
        "robot": lambda: ("robot.toml", pick(damaged_text, ROBOT.encode())),
        "text": lambda: ("log.csv", text_files),
        "franka": lambda: ("log.csv", pick(damaged_text, FRANKA.encode(), SAGE.encode())),
        "packed": lambda: ("log.csv.gz", packed_text),
        "arrays": lambda: ("log.npz", arrays_in_archive),
        "parquet": lambda: ("log.parquet", pick(damaged, table_bytes(
            {"time": [0.0, 0.1, 0.2], "q": [[1.0, 2.0]] * 3, "note": ["a", "b", None]}))),
        "folders": lambda: (None, folders()),
        "matlab": lambda: ("log.mat", pick(damaged, matlab_bytes(),
                                           matlab_bytes(do_compression=True))),
        "hdf": lambda: ("new.mat", pick(damaged, hdf_bytes())),
        "mcap": lambda: ("log.mcap", pick(damaged, bag_bytes(folder, "MCAP"))),
        "sqlite": lambda: ("log.db3", pick(damaged, bag_bytes(folder, "SQLITE3"))),
    }[kind]()


CHILD = {"matlab", "hdf", "mcap", "sqlite"}  # are read in a child, which may die of a file
SHARES = {"robot": 25, "text": 30, "franka": 6, "packed": 6, "arrays": 10, "parquet": 5,
          "folders": 8, "matlab": 6, "hdf": 2, "mcap": 1,
          "sqlite": 1}  # of a hundred inputs


def look(kind, path, number):
    """Whether one input can be read; whatever is raised but a `ClieError` is a fault."""
    try:
        if kind == "robot":
            assert isinstance(read_robot(path), Robot)
            return True
        if kind in CHILD:
            bags = kind in ("mcap", "sqlite")
            job = bag.load if bags else mat_variables.load
            said = {"topic": None, "command_topic": None} if bags else {}
            arrays, found = job(str(path), **said)
            json.dumps(found)
            assert all(array.dtype.kind in "biuf" for array in arrays.values())
            return True
        records = read_records(path)
        assert records
        for record in records:
            assert isinstance(record, Record)
            assert np.isfinite(record.q[record.valid]).all()
            assert all(name.isprintable() for name in record.joints)
        if number % CHECKED == 0:
            text = as_text(check_log(records[0]))
            assert all(line.isprintable() for line in text.split("\n"))
        return True
    except ClieError as error:
        text = str(error)
        assert 10 < len(text) <= 2100 and "Traceback" not in text
        assert all(line.isprintable() for line in text.split("\n"))
        return False


def put(path, content):
    """Write a file, or the files of a folder."""
    if isinstance(content, bytes):
        path.unlink(missing_ok=True)  # ext4 flushes what is overwritten, 5 ms a file
        path.write_bytes(content)
        return
    for name, data in content.items():
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        (path / name).write_bytes(data)


def main(kind, first, count, folder):
    """Read the inputs `first` to `first + count` of a kind; write one line per fault."""
    folder = Path(folder)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    warnings.simplefilter("ignore")
    name, make = makers(kind, folder)
    accepted = 0
    with open(folder / "faults", "a", buffering=1) as faults, \
            open(folder / "number", "r+") as progress:
        for number in range(first, first + count):
            progress.seek(0)
            progress.write(f"{number:9d}")
            progress.flush()
            content = make(random.Random(f"{kind} {number}"))
            path = folder / (name or f"set{number}")
            put(path, content)
            start = time.process_time()
            try:
                accepted += look(kind, path, number)
                seconds = time.process_time() - start
                assert seconds < SLOW, f"took {seconds:.1f} s"
            except Exception:
                last = traceback.format_exc().strip()[-1200:]
                faults.write(json.dumps([kind, number, last]) + "\n")
    print(accepted)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), sys.argv[4])
