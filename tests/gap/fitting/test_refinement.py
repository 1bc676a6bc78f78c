"""Where the logs leave numbers open, the datasheet closes them, and the intervals say so."""

import numpy as np
import pytest

from clie_blocks.analysis.gap.causes.drive import TORQUE_GAIN_ERROR
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal
from clie_blocks.analysis.gap.fitting.refinement import refine_to_prior
from clie_blocks.analysis.gap.method.method import METHOD
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.records import Record
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.robot import Robot
from clie_blocks.analysis.records.robot_sections import Encoder, Experiment, Motor

PERIOD = 2e-3
TIME = PERIOD * np.arange(3000)
HIGH, LOW = 200.0 * PERIOD, 300.0 * PERIOD  # corners of the stated velocity filter
INERTIA, DAMPING, KP, KD, LSB = 0.05, 0.1, 8.0, 0.6, 2e-5
TOLERANCE = {"inertia": 0.01 * INERTIA, "damping": 0.15 * DAMPING, "load": 0.02}


def truth(seed, weak=True):
    """Numbers of a joint anywhere inside its datasheet, and the gain error of its drive."""
    rng = np.random.default_rng(seed)
    z = rng.uniform(-1.0, 1.0, 3)
    return {"inertia": INERTIA + z[0] * TOLERANCE["inertia"],
            "damping": DAMPING + z[1] * TOLERANCE["damping"], "load": z[2] * TOLERANCE["load"],
            "torque_gain_error.error": weak * rng.choice([-1, 1]) * rng.uniform(0.05, 0.25)}


def experiment(robots, k, noise, late):
    """Set-point, excitation, positions and commands of many joints, exact for a held torque.

    The torque may be late by a share of a period.
    """
    rng, count = np.random.default_rng(k), len(robots)
    q_d = 0.5 * np.sin(2 * np.pi * (0.3 + 0.1 * k) * TIME)
    pe = 0.25 * np.sin(2 * np.pi * np.outer(TIME, [0.5, 1.3, 2.9, 5.3]) + k).sum(axis=1)
    inertia, damping, load, gain = np.transpose([list(robot.values()) for robot in robots])
    a, b = _held(inertia, damping)
    x, past = np.zeros((2, count)), np.zeros((3, count))  # measurement, its rates
    seen, u = np.empty((2, len(TIME), count))
    for i in range(len(TIME)):
        seen[i] = LSB * np.round((x[0] + noise * rng.standard_normal(count)) / LSB)
        last, fast, slow = past if i else (seen[0], 0.0 * seen[0], 0.0 * seen[0])
        fresh = ((2 - HIGH) * fast + 2 * HIGH / PERIOD * (seen[i] - last)) / (2 + HIGH)
        past = seen[i], fresh, ((2 - LOW) * slow + LOW * (fresh + fast)) / (2 + LOW)
        u[i] = KP * (q_d[i] - seen[i]) - KD * past[2] + pe[i]
        drive = (1.0 - late) * u[i] + late * u[max(i - 1, 0)]
        x = (a @ x.T[..., None])[..., 0].T + b * ((1.0 + gain) * drive - load)
    return q_d, pe, seen, u


def _held(inertia, damping):
    """Transition over one period of position and speed, (., 2, 2), and of a torque, (2, .)."""
    gone = np.exp(-damping / inertia * PERIOD)
    moved = (1.0 - gone) * inertia / damping
    a = np.moveaxis(np.array([[np.ones_like(gone), moved], [0.0 * gone, gone]]), -1, 0)
    return a, np.array([PERIOD - moved, 1.0 - gone]) / damping


def stated(robots, noise=LSB, late=0.0):
    """Problem of each of some joints, as its datasheet says."""
    runs = [experiment(robots, k, noise, late) for k in range(2)]
    robot = Robot(
        n=1, motor=Motor(gear_ratio=[1.0], inertia=[INERTIA], viscous_friction=[DAMPING],
                         inertia_tolerance=0.01, viscous_friction_tolerance=0.15,
                         torque_offset_tolerance=[TOLERANCE["load"]]),
        controller=Controller(law="pd", kp=[KP], kd=[KD], highpass=200.0, lowpass=300.0,
                              discretisation="tustin", sample_time=PERIOD),
        encoder=Encoder(resolution=[LSB]),
        experiments={f"log-{k + 1}": Experiment(start=[0.0]) for k in range(2)})
    for place in range(len(robots)):
        at = slice(place, place + 1)
        yield Problem.from_logs(robot, [Record(time=TIME, q=q[:, at], u=u[:, at], qd=q_d[:, None],
                                     pe=pe[:, None], source=f"log-{k + 1}")
                              for k, (q_d, pe, q, u) in enumerate(runs)])


def fitted(asked):
    """Bench of a joint, and the fit of a weak drive from the datasheet's numbers."""
    residuals, _ = fit_nominal(asked, METHOD)
    slight = {"error": np.array([0.05])}
    weak = Member(TORQUE_GAIN_ERROR, (0,), slight, slight)
    return residuals, fit(build_hypothesis(asked, (weak,)), residuals, 12)


def numbers(found):
    return np.array([found.hypothesis.get(entry) for entry in found.hypothesis.free_parameters])


def gain_over_inertia(found):
    inertia, *_, gain = numbers(found)
    return (1.0 + gain) / inertia


def along(at, scale):
    """Model that moves as another one does: all torques and all that resists, times a factor."""
    *resisting, gain = ((entry, at.get(entry)) for entry in at.free_parameters)
    return at.with_values(at.moved([*((entry, scale * value) for entry, value in resisting),
                                    (gain[0], (1.0 + gain[1]) * scale - 1.0)]))


@pytest.mark.parametrize("weak, noise", [(True, LSB), (False, LSB), (False, 1e-2)])
def test_intervals_hold_the_true_numbers_wherever_the_datasheet_allows_them(weak, noise):
    robots = [truth(seed, weak) for seed in range(24)]
    errors = []
    for robot, asked in zip(robots, stated(robots, noise)):
        residuals, found = fitted(asked) if weak else fit_nominal(asked, METHOD)
        found = refine_to_prior(found, residuals)
        names = [entry.key for entry in found.hypothesis.free_parameters]
        errors.append((numbers(found) - [robot[name] for name in names]) / found.spread)
        assert found.spread[0] < 0.6 * TOLERANCE["inertia"]
    assert np.mean(np.abs(errors) < 1.96) > 0.9


def test_of_models_that_are_equal_the_nearest_to_the_datasheet_is_told():
    robot = truth(3)
    asked, = stated([robot])
    residuals, found = fitted(asked)
    true_ratio = (1.0 + robot["torque_gain_error.error"]) / robot["inertia"]
    ends = []
    for scale in (0.985, 1.0, 1.015):  # along the valley, and beyond the datasheet
        home = refine_to_prior(fit(along(found.hypothesis, scale), residuals, 0), residuals)
        assert gain_over_inertia(home) == pytest.approx(true_ratio, rel=1e-3)
        assert home.chi2.sum() < found.chi2.sum() + 1.0
        ends.append(numbers(home))
    assert np.ptp(ends, axis=0)[0] < 0.02 * TOLERANCE["inertia"]
    assert abs(ends[0][0] - INERTIA) < 0.1 * TOLERANCE["inertia"]


def test_what_the_logs_tell_is_left():
    asked, = stated([truth(2, weak=False)])
    residuals, found = fit_nominal(asked, METHOD)
    home = refine_to_prior(found, residuals)
    assert np.all(np.abs(numbers(home) - numbers(found)) < 0.05 * home.spread)
    assert home.spread == pytest.approx(np.sqrt(np.diag(found.covariance)), rel=0.1)


@pytest.mark.parametrize("error", [-0.3, 0.5])
def test_a_fit_reaches_the_floor_of_a_flat_valley(error):
    """Slopes taken so widely that curvature shows in them lead along the valley, never into it."""
    asked, = stated([truth(3)])
    residuals, found = fitted(asked)
    home = refine_to_prior(found, residuals)
    far = Member(TORQUE_GAIN_ERROR, (0,), {"error": np.array([error])}, {"error": np.array([0.3])})
    tried = fit(build_hypothesis(asked, (far,)), residuals, 8)
    assert tried.cost < home.cost + 0.01 * tried.samples.sum()


def test_a_fit_beside_what_no_model_explains_does_not_end_beyond_the_datasheet():
    """What is left and curvature make a slope to one side that outweighs the datasheet."""
    asked, = stated([truth(3)], late=0.05)
    _, found = fitted(asked)
    assert found.cost > 10.0 * found.samples[0].sum()
    assert found.penalty < 1.0
