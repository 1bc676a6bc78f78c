"""What logs prove about themselves is corrected and said; what contradicts itself stops."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.corrections import Examination, examine
from clie_blocks.analysis.records.robot_sections import Experiment
from clie_blocks.analysis.records.velocity_filter import response_from_rest, velocity_filter
from clie_blocks.errors import NotIdentifiableError, RecordError

RATIO = np.array([25.0, 50.0, 30.0])


@pytest.fixture(scope="module")
def logs(clean):
    """Two logs of one robot, cut from one run."""
    return clean.part(0, 4000), clean.part(6000, 10_000)


def of(robot, logs):
    return [log.replace(robot=robot) for log in logs]


def scale(factor, *names):
    return lambda log: log.replace(**{name: getattr(log, name) * factor for name in names})


def at_joint(k, change, name):
    def changed(log):
        x = getattr(log, name).copy()
        x[:, k] = change(x[:, k])
        return log.replace(**{name: x})
    return changed


def order(columns, *names):
    return lambda log: log.replace(**{name: getattr(log, name)[:, columns] for name in names})


def late(x, rows):
    return np.concatenate([np.repeat(x[:1], rows, axis=0), x[:-rows]])


def with_lead(log):
    """The command of a law with Kd (dqd/dt - v) in the place of -Kd v."""
    b, a = velocity_filter("tustin", 1e-3, (200.0, 300.0))
    lead = [4.0, 6.0, 3.0] * response_from_rest(b, a, log.qd - log.qd[0])
    return log.replace(u=log.u + lead)


DAMAGES = {
    "degrees": (scale(180 / np.pi, "q", "qd"), "units.position", "degrees"),
    "degrees of q alone": (scale(180 / np.pi, "q"), "units.position", "degrees"),
    "turns": (scale(1 / (2 * np.pi), "q", "qd"), "units.position", "turns"),
    "motor side of q": (scale(RATIO, "q", "qd"), "position.side", "motor side"),
    "joint side of u": (scale(RATIO, "u"), "torque.side", "joint side"),
    "joint side of u and pe": (scale(RATIO, "u", "pe"), "torque.side", "joint side"),
    "gear ratio once more": (scale(1 / RATIO, "u", "pe"), "torque.side", "once more"),
    "mN m": (scale(1e3, "u", "pe"), "units.torque", "mN m"),
    "percent of a rated torque": (scale(100 / 7.3, "u", "pe"), "units.torque", "another unit"),
    "sign of a command": (at_joint(1, np.negative, "u"), "signs", "opposite sign"),
    "sign of a position": (at_joint(2, np.negative, "q"), "signs", "opposite sign"),
    "commands swapped": (order([1, 0, 2], "u"), "order", "swapped"),
    "positions swapped": (order([0, 2, 1], "q"), "order", "swapped"),
    "positions in a circle": (order([1, 2, 0], "q"), "order", "swapped"),
    "late command": (at_joint(slice(None), lambda x: late(x, 4), "u"), "lag", "4 rows too late"),
    "late position": (at_joint(1, lambda x: late(x, 7), "q"), "lag", "7 rows too late"),
    "late reference": (at_joint(slice(None), lambda x: late(x, 30), "qd"), "lag", "30 rows"),
    "lead of the reference": (with_lead, "law.reference_velocity", "velocity of the reference"),
    "dead command": (at_joint(0, np.zeros_like, "u"), "command.dead", "not recorded"),
}


def test_sound_logs_pass_as_they_are(logs, robot):
    seen = examine(logs, robot)
    assert seen.corrections == seen.obstacles == ()
    assert {finding.check for finding in seen.warnings} <= {"reach.short"}
    assert all(one is other for one, other in zip(seen.records, logs, strict=True))


@pytest.mark.parametrize("name", DAMAGES)
def test_what_the_law_proves_is_corrected_and_said(name, logs, robot):
    damage, check, word = DAMAGES[name]
    seen = examine([damage(log.replace(dq=None, tau=None)) for log in logs], robot)
    assert not seen.obstacles
    (correction,) = seen.corrections
    assert correction.check == check
    assert word in str(correction)
    for log, mended in zip(logs, seen.records, strict=True):
        if check == "law.reference_velocity":
            assert np.ptp(mended.u - with_lead(log).u) == 0  # the lead is excitation
            continue
        rows = np.searchsorted(log.time, mended.time)
        apart = {"q": 1e-9, "qd": 1e-9, "u": 2e-3 * np.abs(log.u).max()}
        for signal, error in apart.items():
            difference = getattr(mended, signal) - getattr(log, signal)[rows]
            assert np.abs(difference[200:]).max() < error  # where the filter has settled
        assert any(correction.done in sentence for sentence in mended.decisions)


@pytest.mark.parametrize("factor", [0.96, 1.05])
def test_a_factor_near_one_is_no_unit(factor, logs, robot):
    wrong = [scale(factor, "q", "qd")(log.replace(dq=None, tau=None)) for log in logs]
    seen = examine(wrong, robot)
    assert seen.corrections == () and seen.obstacles == ()


@pytest.mark.parametrize("factor", [60.0, 55.0])
def test_a_factor_near_degrees_is_not_degrees(factor, logs, robot):
    wrong = [scale(factor, "q", "qd")(log.replace(dq=None, tau=None)) for log in logs]
    seen = examine(wrong, robot)
    assert seen.corrections == ()
    with pytest.raises(RecordError, match=r"counts per turn"):  # by the steps of the encoder
        seen.raise_obstacles()
    blind = dataclasses.replace(robot, encoder=dataclasses.replace(robot.encoder, resolution=None))
    with pytest.raises(RecordError, match=r"leave open which.*times that of the law.*the angle"):
        examine(wrong, blind).raise_obstacles()


def test_one_sound_log_refutes_a_change(logs, robot):
    mixed = [logs[0].replace(u=-logs[0].u, tau=None), logs[1]]
    assert examine(mixed, robot).corrections == ()


def test_other_gains_and_filters_are_no_fault_of_the_log(logs, robot):
    for change in ({"kp": robot.controller.kp * 1.25}, {"lowpass": 150.0}):
        other = dataclasses.replace(robot, controller=dataclasses.replace(
            robot.controller, **change))
        seen = examine(of(other, logs), other)
        assert seen.corrections == () and seen.obstacles == ()
        assert any(finding.check.startswith("law.") for finding in seen.warnings)


@pytest.mark.parametrize("share", [0.05, 0.1, 1.0])
def test_a_law_that_takes_the_velocity_of_the_reference_has_none_that_is_late(share, logs, robot):
    coarse = np.full(3, 0.03)  # rounding of the command, in which a shift nearly hides
    laws = [log.replace(u=coarse * np.round((log.u + share * (with_lead(log).u - log.u)) / coarse))
            for log in logs]
    stated = dataclasses.replace(robot, controller=dataclasses.replace(
        robot.controller, command_resolution=coarse))
    assert "lag" not in [one.check for one in examine(of(stated, laws), stated).corrections]


def test_a_lost_excitation_is_read_from_the_command_where_a_log_proves_the_law(clean, robot):
    still = clean.part(0, 5000)
    still = still.replace(pe=None, u=still.u - still.pe, tau=None)  # replays without excitation
    shaken = clean.part(6000, 12_000).replace(pe=None, tau=None)
    seen = examine([still, shaken], robot)
    assert [one.check for one in seen.corrections] == ["missing.pe"]
    assert not seen.records[0].pe.any()
    settled = slice(200, None)
    assert np.abs(seen.records[1].pe - clean.pe[6000:12_000])[settled].max() < 1e-3
    assert [one.check for one in examine([shaken], robot).corrections] == []


def test_a_zero_that_every_log_shows_is_that_of_the_file(logs, robot):
    starts = {f"log-{k + 1}": Experiment(start=log.q[0]) for k, log in enumerate(logs)}
    stated = dataclasses.replace(robot, experiments=starts)
    shift = np.array([0.0, 0.2, 0.0])
    both = [log.replace(q=log.q + shift, qd=log.qd + shift) for log in logs]
    alone = [log.replace(q=log.q + shift) for log in logs]
    for moved in (both, alone):
        seen = examine(of(stated, moved), stated)
        assert [one.check for one in seen.corrections] == ["position.zero"]
        assert np.abs(seen.records[1].q - logs[1].q).max() < 1e-3
    assert examine(both, robot).corrections == ()


def test_an_encoder_that_reads_off_the_start_of_its_reference_has_the_zero_of_the_file(
        logs, robot):
    """An eccentric disc does so in every log that begins at the same place."""
    starts = {f"log-{k + 1}": Experiment(start=log.qd[0]) for k, log in enumerate(logs)}
    stated = dataclasses.replace(robot, experiments=starts)
    read = [log.replace(q=log.q - log.q[0] + log.qd[0] + np.array([0.0, 0.05, 0.0]), dq=None,
                        tau=None) for log in logs]
    law = [log.replace(u=_law(log, robot)) for log in read]
    assert examine(of(stated, law), stated).corrections == ()


def test_two_readings_of_one_log_stop_it(logs, robot):
    alike = dataclasses.replace(robot, controller=dataclasses.replace(
        robot.controller, kp=np.full(3, 20.0), kd=np.full(3, 4.0)))
    bare = [log.replace(pe=0 * log.pe, u=log.u - log.pe, dq=None, tau=None) for log in logs]
    law = [log.replace(u=np.round(_law(log, alike) / 1e-3) * 1e-3) for log in bare]
    assert examine(of(alike, law), alike).corrections == ()
    swapped = [order([1, 0, 2], "u")(log) for log in law]
    seen = examine(of(alike, swapped), alike)
    assert seen.corrections == ()
    with pytest.raises(RecordError, match=r"leave open which.*command u.*; or: .*--trust-log"):
        seen.raise_obstacles()


def _law(log, robot):
    b, a = velocity_filter("tustin", 1e-3, (200.0, 300.0))
    rate = response_from_rest(b, a, log.q - log.q[0])
    return robot.controller.kp * (log.qd - log.q) - robot.controller.kd * rate + log.pe


def test_a_dead_position_is_said_at_once(logs, robot):
    dead = [at_joint(1, lambda x: np.full_like(x, x[0]), "q")(log.replace(dq=None, tau=None))
            for log in logs]
    with pytest.raises(NotIdentifiableError, match=r"arm: Its position never changes.*cable"):
        examine(dead, robot).raise_obstacles()


def test_the_gains_of_a_file_in_another_order_stop(logs, robot):
    swapped = dataclasses.replace(robot, controller=dataclasses.replace(
        robot.controller, kp=robot.controller.kp[[1, 0, 2]], kd=robot.controller.kd[[1, 0, 2]]))
    with pytest.raises(RecordError, match=r"gains of base, arm in the robot file are swapped"):
        examine(of(swapped, logs), swapped).raise_obstacles()


@pytest.mark.parametrize(("change", "hint"), [
    (scale(180 / np.pi, "q"), "q were in degrees"),
    (scale(RATIO, "u"), "joint side of the gear"),
    (scale(1e3, "u"), "u were in mN m")])
def test_without_a_law_the_stated_inertia_stops_wrong_units(change, hint, logs, robot):
    bare = dataclasses.replace(robot, controller=Controller(sample_time=1e-3), links=dataclasses.
                               replace(robot.links, mass=np.zeros(3)))
    raw = [log.replace(qd=None, pe=None, dq=None, tau=None, robot=bare) for log in logs]
    assert examine(raw, bare).obstacles == ()
    seen = examine([change(log) for log in raw], bare)
    assert seen.corrections == ()
    with pytest.raises(RecordError, match=hint):
        seen.raise_obstacles()


def test_logs_of_several_robots_are_not_compared_with_the_law_of_one(logs, robot):
    stiff = dataclasses.replace(robot, controller=dataclasses.replace(
        robot.controller, kp=2 * robot.controller.kp))
    mixed = [logs[0], logs[1].replace(robot=stiff, u=-logs[1].u, tau=None)]
    assert examine(mixed, robot).corrections == ()


def test_no_obstacle_no_error(logs, robot):
    Examination(robot, logs).raise_obstacles()
