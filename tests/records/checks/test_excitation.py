"""What a motion shows and hides, and the advice that follows."""

import numpy as np
import pytest

from clie_blocks.analysis.records.check_report import check_log
from clie_blocks.analysis.records.checks.capability import best_experiment, facts
from clie_blocks.analysis.records.checks.excitation import check_excitation, motions, remedy
from clie_blocks.analysis.records.model import Record

STEP = 1e-3
TIME = STEP * np.arange(20_000)
NOISE = 1e-4 * np.random.default_rng(2).standard_normal(TIME.size)


def log(q, inertia=0.5, friction=1.0, **more):
    """Log of a joint that moved exactly so, seen with noise."""
    dq, ddq = np.gradient(q, STEP), np.gradient(np.gradient(q, STEP), STEP)
    return Record(TIME, q + NOISE, u=inertia * ddq + friction * dq + 0.2, **more)


def sine(frequency, amplitude=0.4):
    return amplitude * np.sin(2 * np.pi * frequency * TIME)


def test_a_multisine_shows_everything():
    record = log(sine(0.3) + sine(1.1, 0.15))
    assert motions(record, None)[0].hidden == ()
    assert check_excitation(record, None) == []


def test_a_motion_one_way_ties_friction_to_the_offset():
    record = log(0.3 * TIME + 0.02 * np.sin(TIME))
    motion = motions(record, None)[0]
    assert motion.hidden == ("viscous friction", "offset")
    assert motion.reversals == 0
    finding = check_excitation(record, None)[0]
    assert "viscous friction and offset have the same effect in this motion" in finding.what
    assert "move in both directions" in finding.fix


def test_a_very_slow_motion_drowns_the_inertia():
    finding = check_excitation(log(sine(0.02, 0.05)), None)[0]
    assert finding.severity == "error"
    assert "inertia" in finding.what
    assert "accelerate more" in finding.fix or "multisine" in finding.fix


def test_one_weak_joint_of_two_is_a_warning_and_two_are_exit_code_four():
    rich, poor = log(sine(0.3) + sine(1.1, 0.15)), log(0.3 * TIME + 0.02 * np.sin(TIME))
    both = Record(TIME, np.hstack((rich.q, poor.q)), u=np.hstack((rich.u, poor.u)))
    assert [(f.severity, f.joint) for f in check_excitation(both, None)] == [
        ("warning", "joint2")]
    assert check_log(both).exit_code == 0
    assert check_log(poor).exit_code == 4


def test_facts_of_the_motion_are_those_of_the_sine():
    motion = motions(log(sine(0.5)), None)[0]
    assert motion.sweep == pytest.approx(0.8, abs=0.002)
    assert motion.top_speed == pytest.approx(2 * np.pi * 0.5 * 0.4, rel=0.02)
    assert motion.frequency == pytest.approx(0.5, rel=0.05)
    assert motion.reversals == 20


@pytest.mark.parametrize("hidden", [("inertia",), ("viscous friction", "offset"),
                                    ("inertia", "viscous friction", "offset")])
def test_every_combination_has_a_remedy(hidden):
    assert len(remedy(hidden)) > 30


def test_the_advice_names_the_greatest_want_first(clean):
    def advice(record):
        return best_experiment(record, facts(record, record.robot))

    assert "Log the command" in advice(clean.replace(u=None, tau=None, pe=None))
    assert "Log the reference" in advice(clean.replace(qd=None))
    assert "State the control law" in advice(clean.replace(robot=None))
    assert "Repeat one motion three times" in advice(clean)


def test_repeated_runs_count_as_a_measurement_of_the_noise(clean):
    again = clean.replace(q=clean.q + 1e-4 * np.random.default_rng(8).standard_normal(
        clean.q.shape), source="again.csv")
    report = check_log(clean, others=[again])
    noise = next(c for c in report.capabilities if c.subject.endswith("is noise"))
    assert noise.possible
    assert noise.reason == "2 runs compared"
