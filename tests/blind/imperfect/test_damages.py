"""What a damage changes in the files of a robot, and what it leaves alone."""

import copy

import numpy as np
import pytest

from clie_blocks.analysis.blind.imperfect.__main__ import main
from clie_blocks.analysis.blind.imperfect.damages import DAMAGES, DESCRIPTION, KINDS, damage
from clie_blocks.analysis.blind.imperfect.export import DoesNotApplyError, Export, columns
from clie_blocks.analysis.records import read_robot
from clie_blocks.errors import ClieError

ROBOT = """joints = 2
[motor]
gear_ratio = [100.0, 50.0]   # motor turns per joint turn
inertia_kgm2 = [0.02, 0.03]
viscous_friction_nms = [0.04, 0.05]
peak_torque_nm = [20.0, 10.0]
[links]
length_m = [0.6, 0.5]
mass_kg = [0.5, 0.4]
com_m = [0.5, 0.4]
inertia_kgm2 = [0.004, 0.003]
[nominal]
gravity = true
[controller]
Kp = [10.0, 8.0]
Kd = [5.0, 4.0]
sample_time_s = 0.001
[encoder]
resolution_rad = 4e-05
"""
ROWS = 5200


@pytest.fixture
def sound():
    """Two logs of 5.2 s of a robot of two joints."""
    rng = np.random.default_rng(0)
    table = {"time": 1e-3 * np.arange(ROWS)}
    for signal, size in (("q", 0.5), ("u", 3.0), ("qd", 0.5), ("pe", 1.0)):
        for k in (1, 2):
            noise = 1e-4 * rng.standard_normal(ROWS) if signal == "q" else 0.0
            table[f"{signal}{k}"] = size * np.sin(k * table["time"] + len(signal)) + noise
    return Export(ROBOT, {"log-1.csv.gz": table, "log-2.csv": copy.deepcopy(table)})


@pytest.fixture
def damaged(sound):
    """Sound and damaged export, and what was chosen."""
    def make(name, seed=0):
        export = copy.deepcopy(sound)
        chosen = DAMAGES[name].change(export, np.random.default_rng(seed))
        return sound, export, chosen
    return make


@pytest.fixture
def folder(sound, tmp_path):
    """The same on disk, shortened."""
    path = tmp_path / "sound"
    sound.keep(lambda table: np.arange(ROWS) < 400)
    sound.write(path)
    return path


def changed(before, after):
    """Columns that differ in any log."""
    return {name for log in after.logs for name in before.logs[log]
            if name not in after.logs[log]
            or not np.array_equal(before.logs[log][name], after.logs[log][name])}


def test_there_are_enough_and_every_one_can_be_judged():
    assert len(DAMAGES) >= 20
    for name, one in DAMAGES.items():
        assert one.name == name and one.kind in KINDS
        assert bool(one.words) == (one.kind == DESCRIPTION)


IN_FILES = [name for name in DAMAGES if not name.startswith("encoder_noise")]


@pytest.mark.parametrize("name", IN_FILES)
def test_every_damage_changes_what_it_says(name, damaged):
    before, after, _ = damaged(name)
    assert bool(changed(before, after)) or before.robot != after.robot or (
        before.clock_digits, list(before.logs)) != (after.clock_digits, list(after.logs))


@pytest.mark.parametrize("name", ["noise_x5", "wrong_kp", "one_log", "nan_samples"])
def test_files_change_and_the_same_way_again(name, folder, tmp_path):
    first, second = tmp_path / "first", tmp_path / "second"
    assert damage(name, folder, first, 5) == damage(name, folder, second, 5)
    files = sorted(path.name for path in first.iterdir())
    assert all((first / file).read_bytes() == (second / file).read_bytes() for file in files)
    assert files != sorted(path.name for path in folder.iterdir()) or any(
        (first / file).read_bytes() != (folder / file).read_bytes() for file in files)
    assert read_robot(first / "robot.toml").n == 2


@pytest.mark.parametrize("name, signals", [
    ("positions_in_degrees", {"q1", "q2", "qd1", "qd2"}), ("clock_in_ms", {"time"}),
    ("torque_in_percent", {"u1", "u2", "pe1", "pe2"}), ("commands_swapped", {"u1", "u2"}),
    ("positions_swapped", {"q1", "q2"}), ("late_command", {"u1", "u2"}),
    ("lost_pe", {"pe1", "pe2"}), ("lost_reference", {"qd1", "qd2"}),
    ("resolution_12_bit", {"q1", "q2"}), ("noise_x5", {"q1", "q2"}), ("clock_jitter", {"time"})])
def test_a_damage_touches_its_own_channels(damaged, name, signals):
    before, after, _ = damaged(name)
    assert changed(before, after) == signals
    assert before.robot == after.robot


@pytest.mark.parametrize("name, signal", [
    ("command_sign", "u"), ("position_sign", "q"), ("late_position", "q"), ("dead_position", "q"),
    ("dead_command", "u"), ("position_offset", "q")])
def test_a_damage_of_one_joint_leaves_the_others(damaged, name, signal):
    for seed in range(4):
        before, after, chosen = damaged(name, seed)
        assert changed(before, after) == {f"{signal}{chosen['joint']}"}


@pytest.mark.parametrize("name, section, key", [
    ("wrong_kp", "controller", "Kp"), ("wrong_kd", "controller", "Kd"),
    ("wrong_motor_inertia", "motor", "inertia_kgm2"), ("wrong_gear_ratio", "motor", "gear_ratio"),
    ("wrong_link_mass", "links", "mass_kg"), ("wrong_com", "links", "com_m")])
def test_a_wrong_number_stands_in_the_file_at_the_joint_chosen(damaged, name, section, key):
    before, after, chosen = damaged(name)
    ratio = after.stated(section, key) / before.stated(section, key)
    wrong = np.flatnonzero(ratio != 1)
    assert wrong.tolist() == [chosen["joint"] - 1]
    assert ratio[wrong[0]] == pytest.approx(chosen.get("factor", ratio[wrong[0]]))
    assert not changed(before, after)
    other = "motor" if section == "links" else "links"
    assert np.array_equal(before.stated(other, "inertia_kgm2"),
                          after.stated(other, "inertia_kgm2"))


def test_the_noise_grows_by_its_factor(damaged):
    before, after, _ = damaged("noise_x20")
    for name in ("q1", "q2"):
        rough = [np.std(np.diff(export.logs["log-2.csv"][name], 3)) for export in (before, after)]
        assert rough[1] / rough[0] == pytest.approx(20, rel=0.05)


@pytest.mark.parametrize("name, rows", [
    ("gap", ROWS - 50), ("lost_rows", ROWS - 20), ("repeated_rows", ROWS + 52),
    ("logged_at_500_hz", ROWS // 2), ("logged_at_50_hz", ROWS // 20), ("short_logs", 5000)])
def test_rows_go_and_come(damaged, name, rows):
    _, after, _ = damaged(name)
    assert all(table["time"].size == rows for table in after.logs.values())


def test_clocks(damaged):
    stamps = {name: damaged(name)[1].logs["log-2.csv"]["time"] for name in (
        "clock_reset", "coarse_clock", "clock_jitter")}
    assert np.sum(np.diff(stamps["clock_reset"]) < 0) == 1
    assert np.mean(np.diff(stamps["coarse_clock"]) == 0) > 0.9
    steps = np.diff(stamps["clock_jitter"])
    assert steps.min() >= 0 and steps.std() == pytest.approx(np.sqrt(2) * 3e-5, rel=0.1)


def test_stamps_with_few_digits_repeat(folder, tmp_path):
    damage("few_clock_digits", folder, tmp_path / "out")
    stamps = Export.read(tmp_path / "out").logs["log-2.csv"]["time"]
    assert stamps[0] == 1000 and np.mean(np.diff(stamps) == 0) == pytest.approx(0.9, abs=0.01)


def test_twenty_degrees_are_written_as_such(damaged):
    before, after, _ = damaged("positions_in_degrees")
    q = columns(before.logs["log-2.csv"], "q")[0]
    assert np.allclose(after.logs["log-2.csv"][q], np.degrees(before.logs["log-2.csv"][q]),
                       rtol=1e-9)


def test_what_cannot_be_is_refused_with_the_reason(folder, tmp_path):
    export = Export.read(folder)
    export.robot = export.robot.replace("gravity = true", "gravity = false")
    export.write(folder)
    with pytest.raises(DoesNotApplyError, match="pose"):
        damage("zero_offset", folder, tmp_path / "out")
    with pytest.raises(ClieError, match="cannot have the damage zero_offset"):
        main([str(folder), "-o", str(tmp_path / "out"), "--damage", "zero_offset"])


def test_the_command_lists_and_copies(folder, tmp_path, capsys):
    assert main([]) == 0
    listed = capsys.readouterr().out
    assert all(name in listed for name in DAMAGES)
    out = tmp_path / "out"
    assert main([str(folder), "-o", str(out), "--damage", "gap"]) == 0
    assert "50 ms" in capsys.readouterr().out and (out / "robot.toml").is_file()
    with pytest.raises(ClieError, match="gap"):
        main([str(folder), "-o", str(out), "--damage", "gapp"])
