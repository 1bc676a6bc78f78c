"""Every row of the table of bad inputs: the fault is made in a clean log, and told as such."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.analysis.records.checks import check_record, fix_units
from clie_blocks.analysis.records.checks.clock import even_clock
from clie_blocks.analysis.records.checks.stability import nominal_joints, slowest_growth

DEGREE = 180 / np.pi


def test_a_clean_log_has_no_finding(clean):
    assert check_record(clean) == []


def changed(signal, change):
    """Fault that changes one signal of a record."""
    def fault(record):
        x = getattr(record, signal).copy()
        return record.replace(**{signal: change(x)})
    return fault


def column(k, change):
    """Change of one column."""
    def apply(x):
        x[:, k] = change(x[:, k])
        return x
    return apply


def law(**gains):
    """Fault in what is stated of the controller."""
    def fault(record):
        controller = dataclasses.replace(record.robot.controller, **gains)
        return record.replace(robot=dataclasses.replace(record.robot, controller=controller))
    return fault


def motor_side(signal, k=0):
    return changed(signal, column(k, lambda x: x * 25.0))


def with_gap(record):
    time = record.time.copy()
    time[6000:] += 0.5
    return record.replace(time=time, segments=[(0, 6000), (6000, 12000)])


def with_reset(record):
    time = record.time.copy()
    time[6000:] -= 4.0
    return record.replace(time=time, segments=[(0, 6000), (6000, 12000)])


def stamps(change):
    def fault(record):
        return record.replace(time=change(record.time.copy()))
    return fault


def shuffled(time):
    time[100:9000:100] -= 0.005
    return time


def jittered(share):
    def change(time):
        return time + share * 1e-3 * np.random.default_rng(1).uniform(-1, 1, time.size)
    return stamps(change)


def twice(time):
    time[500] = time[499]
    return time


def holes(share):
    def fault(record):
        q = record.q.copy()
        q[3000:3000 + int(share * len(record))] = np.nan
        return record.replace(q=q, valid=None)
    return fault


def late(samples, signal="u"):
    return changed(signal, lambda x: np.concatenate((np.repeat(x[:1], samples, 0), x[:-samples])))


def filtered(x):
    """First-order low-pass of 20 ms."""
    out = np.empty_like(x)
    held = x[0]
    for i, row in enumerate(x):
        held = held + (row - held) * 0.05
        out[i] = held
    return out


def stuck(x):
    x[5000:6500, 1] = x[5000, 1]
    return x


def permuted(signal, order):
    return changed(signal, lambda x: x[:, order])


ERRORS = {
    "many backward stamps": (stamps(shuffled), "clock.backward", "runs backwards 89 times"),
    "time in ms": (stamps(lambda t: t * 1e3), "clock.unit", "--time-unit ms"),
    "time in us": (stamps(lambda t: t * 1e6), "clock.unit", "--time-unit us"),
    "time in ns": (stamps(lambda t: t * 1e9), "clock.unit", "--time-unit ns"),
    "clock stands": (stamps(lambda t: 0 * t), "clock.stopped", "never advances"),
    "6 % missing": (holes(0.06), "missing.share", "6.00%"),
    "velocity turned": (changed("dq", column(1, np.negative)), "velocity.sign", "sign = -1"),
    "command turned": (changed("u", column(0, np.negative)), "law.sign", "sign = -1 for u_base"),
    "position turned": (changed("q", column(0, np.negative)), "reference.sign", "sign = -1"),
    "torque turned": (changed("tau", column(2, np.negative)), "torque.sign", "sign = -1"),
    "velocities swapped": (permuted("dq", [1, 0, 2]), "velocity.swapped", "[2, 1, 3]"),
    "references swapped": (permuted("qd", [0, 2, 1]), "reference.swapped", "[1, 3, 2]"),
    "commands swapped": (permuted("u", [2, 0, 1]), "law.swapped", "[3, 1, 2]"),
    "velocity on the motor side": (motor_side("dq"), "velocity.side", "gear ratio being 25"),
    "position on the motor side": (motor_side("q"), "reference.side", "gear of 25"),
    "torque on the joint side": (motor_side("tau"), "torque.side", "gear ratio being 25"),
    "command as measurement": (lambda r: r.replace(q=r.qd), "reference.copied",
                               "one was logged as the other"),
    "command a sample late": (late(1), "law.shifted", "Shift u by -1 samples"),
    "command two samples late": (late(2), "law.shifted", "2 samples late"),
    "saturated": (changed("u", lambda x: np.clip(x, -0.5, 0.5)), "command.saturated", "limit of"),
    "wrong Kp": (law(kp=np.array([10.0, 30.0, 15.0])), "law.gain", "Kp = 20 +-"),
    "wrong Kd": (law(kd=np.array([4.0, 6.0, 2.0])), "law.gain", "stated is 2"),
    "gains per degree": (law(kp=np.array([20.0, 30.0, 15.0]) / DEGREE,
                             kd=np.array([4.0, 6.0, 3.0]) / DEGREE), "law.per_degree", "57.3"),
    "gains on the joint side": (law(kp=np.array([500.0, 30.0, 15.0]),
                                    kd=np.array([100.0, 6.0, 3.0])), "law.side", "gear ratio"),
    "excitation doubled": (changed("pe", column(1, lambda x: 2 * x)), "law.excitation",
                           "0.5 +-"),
    "unstable gains": (law(kd=np.array([4.0, 6.0, 3.0]) * 300), "gains.unstable",
                       "It is stable from Kd ="),
}


@pytest.mark.parametrize("name", ERRORS)
def test_errors(clean, name):
    fault, check, text = ERRORS[name]
    found = [f for f in check_record(fault(clean)) if f.check == check]
    assert found, f"{name}: nothing found"
    assert found[0].severity == "error"
    assert text in str(found[0])


WARNINGS = {
    "gap": (with_gap, "clock.gaps", "1 gaps, together 0.501 s"),
    "coarse clock": (stamps(lambda t: np.floor(t / 0.004) * 0.004), "clock.coarse", "75%"),
    "jitter 20 %": (jittered(0.25), "clock.jitter", "cycle"),
    "rate": (law(sample_time=4e-3), "clock.rate", "the controller one of 4 ms"),
    "velocity in degrees": (changed("dq", column(2, lambda x: x * DEGREE)), "units.velocity",
                            "dq_wrist[deg/s]"),
    "position in degrees": (changed("q", column(2, lambda x: x * DEGREE)), "units.reference",
                            "the position were in deg"),
    "reference in degrees": (changed("qd", column(2, lambda x: x * DEGREE)), "units.reference",
                             "qd_wrist[deg]"),
    "sweep of many turns": (lambda r: r.replace(q=r.q * DEGREE, qd=None, dq=None), "units.range",
                            "is it in degrees?"),
    "velocity scaled": (changed("dq", column(0, lambda x: 1.2 * x)), "velocity.scale",
                        "1.2 times"),
    "velocity of something else": (changed("dq", column(0, lambda x: np.cos(np.arange(x.size)
                                                                           * 0.02))),
                                   "velocity.unlike", "does not follow its position"),
    "velocity filtered": (changed("dq", filtered), "velocity.late", "as a filtered one does"),
    "dead joint": (changed("q", column(1, lambda x: 0 * x)), "signal.dead", "left out"),
    "stuck encoder": (changed("q", stuck), "signal.stuck", "1500 equal samples"),
    "clipped position": (changed("q", column(0, lambda x: np.minimum(x, 0.15))), "signal.clipped",
                         "end stop"),
    "coarse position": (changed("q", lambda x: np.round(x / 0.02) * 0.02), "signal.quantised",
                        "steps of 0.02"),
    "coarser than stated": (changed("q", column(0, lambda x: np.round(x / 5e-4) * 5e-4)),
                            "signal.resolution", "steps of 0.0005, robot.toml states 0.0001"),
    "another filter": (law(discretisation="backward"), "law.variant",
                       "'tustin', not by 'backward'"),
    "unknown filter": (law(highpass=80.0, lowpass=120.0), "law.residual", "unexplained"),
    "unsigned torque": (changed("tau", np.abs), "torque.unsigned", "never negative"),
    "torque is the command": (lambda r: r.replace(tau=r.u), "torque.copied", "equals its command"),
    "dead command": (changed("u", column(1, lambda x: 0 * x)), "command.dead", "never changes"),
    "late torque": (late(12, "tau"), "torque.late", "Its torque trails its command by 12"),
    "too short": (lambda r: r.part(0, 4000), "reach.short", "4 s long"),
    "too slow": (lambda r: r.replace(**{name: getattr(r, name)[::20] for name in
                                        ("time", "valid", *r.signals)}, segments=()),
                 "reach.slow", "faster than 25 Hz"),
    "velocity with holes": (changed("dq", column(1, lambda x: np.where(x > 0.5, np.nan, x))),
                            "missing.dq", "dq is NaN or infinite in"),
    "long run missing": (holes(0.01), "missing.samples", "longest of 120 samples"),
    "K-bar not positive": (law(kp=np.array([20.0, 300.0, 15.0])), "gains.k_bar",
                           "From Kd ="),
}


@pytest.mark.parametrize("name", WARNINGS)
def test_warnings(clean, name):
    fault, check, text = WARNINGS[name]
    found = [f for f in check_record(fault(clean)) if f.check == check]
    assert found, f"{name}: nothing found"
    assert found[0].severity == "warning"
    assert text in str(found[0])


REPAIRS = {
    "one reset": (with_reset, "clock.reset", "jumps back once"),
    "a stamp twice": (stamps(twice), "clock.repeated", "1 stamps repeat"),
    "jitter 3 %": (jittered(0.04), "clock.jitter", "true stamps are used"),
    "few missing": (holes(0.0003), "missing.samples", "masked"),
    "some saturation": (changed("u", lambda x: np.clip(x, -2, 2)), "command.saturated",
                        "no weight"),
}


@pytest.mark.parametrize("name", REPAIRS)
def test_repairs(clean, name):
    fault, check, text = REPAIRS[name]
    found = [f for f in check_record(fault(clean)) if f.check == check]
    assert found, f"{name}: nothing found"
    assert found[0].severity == "repair"
    assert text in str(found[0])


def test_a_coarse_clock_is_rebuilt_from_its_rate(clean):
    coarse = stamps(lambda t: np.floor(t / 0.004) * 0.004)(clean)
    assert even_clock(coarse).sample_time == pytest.approx(1e-3, rel=1e-3)
    assert even_clock(clean) is clean


def test_units_are_fixed_only_when_asked_and_then_the_log_is_clean(clean):
    wrong = changed("dq", column(2, lambda x: x * DEGREE))(clean)
    mended = fix_units(wrong, check_record(wrong))
    assert np.allclose(mended.dq, clean.dq, rtol=1e-12)
    assert "Multiplied dq of wrist by 0.0174533" in mended.decisions[-1]
    assert check_record(mended) == []


def test_the_damping_that_is_named_is_indeed_the_border_of_stability(clean):
    wild = law(kd=np.array([4.0, 6.0, 3.0]) * 300)(clean)
    said = next(f for f in check_record(wild) if f.check == "gains.unstable")
    largest = float(said.fix.split("Kd = ")[-1].rstrip("."))
    a, b = (x[0] for x in nominal_joints(wild.robot))
    assert slowest_growth(a, b, 20.0, 0.97 * largest, wild.robot.controller) < 0
    assert slowest_growth(a, b, 20.0, 1.05 * largest, wild.robot.controller) > 0


def test_the_kd_that_is_named_makes_k_bar_positive(clean):
    soft = law(kp=np.array([20.0, 300.0, 15.0]))(clean)
    said = next(f for f in check_record(soft) if f.check == "gains.k_bar")
    kd = float(said.fix.split("Kd = ")[1].split(" ")[0])
    a, b = (x[1] for x in nominal_joints(soft.robot))
    assert 1.001 * kd / 300 * (a + b * 1.001 * kd) > 1
    assert 0.999 * kd / 300 * (a + b * 0.999 * kd) < 1
