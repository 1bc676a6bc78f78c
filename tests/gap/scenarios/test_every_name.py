"""Every name of the catalogue: inserted, simulated, named, put back, and named again.

The settings are strong enough to be seen at a joint that is known well.  Effects that need two
joints are not among them, nor a fluid's drag, which on one link is quadratic drag.
"""

import dataclasses

import numpy as np
import pytest
from catalogue_robot import CatalogueRobot

from clie_blocks.analysis.gap import diagnose, read
from clie_blocks.analysis.gap.causes.vocabulary import class_of
from clie_blocks.analysis.gap.fitting.prediction_error import validation_logs
from clie_blocks.effects import LIBRARY
from clie_blocks.effects.joint_elasticity import is_elastic
from clie_blocks.effects.two_bodies import TwoBodies

SMOOTH = {"width": 5e-3}  # rad/s, over which dry friction changes its sign
GEAR = {"damping": 0.4, "motor_inertia": 0.05, "motor_damping": 0.5}
SOFT = CatalogueRobot(kp=6.0, kd=0.6, size=0.3)  # a law that a soft gear stands
FINE = CatalogueRobot(noise=1e-5, resolution=2e-6)
# An interval holds what the sensor's noise leaves open.  The plant that moves in continuous time,
# with a smoothed sign, differs from the model in steps of a period by more than that noise.
SAME = 0.15  # of a number, that the second one may lie beyond its interval
NAMES = {
    "coulomb": {"level": 2.0, **SMOOTH},
    "stribeck": {"level": 1.5, "excess": 1.5, "velocity": 0.08, **SMOOTH},
    "asymmetric_coulomb": {"forward": 2.5, "backward": 1.0, **SMOOTH},
    "quadratic_drag": {"drag": 0.5},
    "load_dependent_friction": {"level": 0.3, "share": 0.25, **SMOOTH},
    "presliding": {"level": 2.0, "reach": 0.01, "static_ratio": 1.0, "bristle_damping": 4.0,
                   "velocity": 10.0},
    "dahl": {"level": 2.0, "reach": 0.02, "exponent": 1.7},
    "maxwell_slip": {"level": 2.0, "reach": 0.03},
    "position_dependent_friction": {"level": 1.5, "sine": 0.8, "cosine": 0.3, "order": 12.0,
                                    **SMOOTH},
    "friction_drift": {"level": 2.0, "coulomb_change": -1.2, "time_constant": 5.0, **SMOOTH},
    "rest_time_breakaway": {"rise": 3.0, "half_time": 0.3, "velocity": 0.05, **SMOOTH},
    "directional_efficiency": {"driving": 0.15, "backdriving": 0.3, **SMOOTH},
    "gravity": {"weight": 3.0},
    "spring": {"stiffness": 4.0, "hardening": 0.0},
    "counterbalance": {"moment": 4.0, "slack": 0.4, "angle": 1.0},
    "soft_stop": {"stiffness": 15.0, "lower": -0.6, "upper": 0.55, "damping": 0.5},
    "joint_elasticity": {"compliance": 0.01, **GEAR},
    "stiffening_elasticity": {"compliance": 1 / 60.0, "stiffening": 2.0, "knee": 0.8, **GEAR},
    "torsional_hysteresis": {"level": 0.8, "reach": 0.01, "stiffness": 100.0, **GEAR},
    "kinematic_error": {"sine": 2e-3, "cosine": 1e-3, "order": 50.0},
    "gear_mesh_ripple": {"sine": 0.2, "cosine": 0.1, "order": 100.0},
    "actuator_saturation": {"limit": 5.0},
    "torque_speed_limit": {"peak": 8.0, "droop": 0.5},
    "actuator_lag": {"lag": 5e-3},
    "torque_ripple": {"sine": 0.8, "cosine": 0.5, "order": 50.0},
    "commutation_ripple": {"sine": 0.15, "cosine": 0.1, "order": 50.0},
    "torque_gain_error": {"error": 0.15},
    "torque_gain": {"error": 0.15},
    "back_emf": {"damping": 0.3},
    "inertia": {"extra": 0.05},
    "viscous": {"extra": 0.4},
    "ratio_error": {"error": 0.05},
    "time_delay": {"delay": 5e-3},
    "tick_jitter": {"spread": 8e-3, "beat": 3.7},
    "packet_hold": {"hold": 0.015, "interval": 0.6, "phase": 0.4, "settle": 2e-4},
    "setpoint_slew": {"speed": 1.2},
    "setpoint_delay": {"delay": 0.02},
    "in_loop_delay": {"delay": 3.4e-3},
    "gain_error": {"kp_error": 0.12, "kd_error": -0.1},
    "control_law_form": {"share": 0.8, "corner": 80.0},
    "hidden_integral": {"ki": 20.0, "clamp": 1e4},
    "hidden_compensation": {"weight": 0.8, "friction": 0.3, "width": 0.05},
    "velocity_estimate_lag": {"lag": 4e-3},
    "channel_skew": {"skew": 2.4e-3},
    "sensor_gain": {"error": 0.08, "bias": 0.2},
    "encoder_eccentricity": {"sine": 5e-3, "cosine": 2e-3, "order": 1.0},
    "periodic_disturbance": {"sine": 0.8, "cosine": 0.4, "frequency": 2.7},
    "step_fault": {"offset": 1.5, "time": 5.0},
}
ROBOTS = {"joint_elasticity": SOFT, "stiffening_elasticity": SOFT, "torsional_hysteresis": SOFT,
          "packet_hold": FINE,
          # slow enough to rest: else only how fast the excess grows shows, and nothing renews it
          "rest_time_breakaway": CatalogueRobot(size=0.4, noise=4e-4)}


def heads(answer):
    """Classes of the first answer and of what the logs do not tell from it."""
    first = answer["effects"][0]
    return {class_of(name) for name in (first["effect"], *(first.get("alike") or ()))}


def put_back(found, robot, j):
    """Plant, law and effects of the corrected model in log j."""
    of_joints = {key: found.model.hypothesis.values[key] for key in ("inertia", "damping", "load")}
    return (found.corrected(robot.plant(**of_joints), j), found.corrected(robot.law(), j),
            found.effects(j))


def numbers(answer):
    """Interval of each parameter of the first answer: ends, of every joint."""
    parameters = answer["effects"][0].get("parameters") or {}
    return {name: [np.array(end, float).ravel() for end in entry["interval"]]
            for name, entry in parameters.items() if entry.get("interval")}


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_name_goes_into_a_plant_and_comes_back(name, tmp_path):
    robot = ROBOTS.get(name, CatalogueRobot())
    logs = robot.records([LIBRARY[name](**NAMES[name])])
    found = diagnose(read(robot.write(tmp_path, logs)))
    answer = found.to_dict()
    assert class_of(name) in heads(answer)

    j = validation_logs(found.model.hypothesis.problem)[0]
    plant, law, settings = put_back(found, robot, j)
    named = {setting.effect.name for setting in settings}
    assert heads(answer) & named or "parametric" in heads(answer)
    q, _ = robot.run(j, plant, law, noisy=False)
    reached = np.sqrt(np.mean((logs[j].q - q) ** 2))
    told = found.reduction  # without noise here: a law with a kink answers it a little otherwise
    assert reached <= 1.25 * told.after + 0.05 * max(told.before - told.after, 0.0)

    again_in = tmp_path / "again"
    again_in.mkdir()
    again = diagnose(read(robot.write(again_in, [
        robot.record(i, *put_back(found, robot, i)) for i in range(3)]))).to_dict()
    assert heads(again) & heads(answer)
    if again["effects"][0]["effect"] == answer["effects"][0]["effect"]:
        second = numbers(again)
        for key, (low, high) in numbers(answer).items():
            slack = SAME * np.maximum(np.abs(low), np.abs(high)) + 0.02 * (key == "phase")
            known = np.isfinite(low)  # not in a log that was held out
            assert np.all((low - slack <= second[key][1])[known]), key
            assert np.all((second[key][0] <= high + slack)[known]), key


@pytest.mark.slow
@pytest.mark.parametrize("robot", [CatalogueRobot(), CatalogueRobot(noise=1e-5, resolution=2e-6)])
def test_steps_of_the_torque_are_named_by_those_of_the_recorded_command(robot, tmp_path):
    logs = robot.records([LIBRARY["torque_quantization"](resolution=0.5)])
    found = diagnose(read(robot.write(tmp_path, logs)))
    answer = found.to_dict()
    assert answer["effects"][0]["effect"] == "torque_quantization"
    assert answer["effects"][0]["probability"] > 0.9
    assert answer["closed_percent"]["judged_by"] == "recorded command"
    assert found.reduction.percent > 90.0
    (setting,) = found.effects()
    assert setting.values["resolution"] == pytest.approx(0.5, rel=2e-3)


@pytest.mark.slow
def test_a_torque_of_limited_rate_is_named_by_what_the_recorded_command_shows(tmp_path):
    logs = FINE.records([LIBRARY["torque_slew"](rate=600.0, follow=2e-4)])
    answer = diagnose(read(FINE.write(tmp_path, logs))).to_dict()
    assert answer["effects"][0]["effect"] == "torque_slew"
    assert answer["effects"][0]["probability"] > 0.9
    assert answer["closed_percent"]["judged_by"] == "recorded command"


def kinked_torque(twist, twist_rate, compliance, stiffening, knee, damping):
    """Spring with a corner at the knee, as catalogues of gears state it."""
    soft = np.clip(twist, -knee * compliance, knee * compliance)
    return (soft + (1.0 + stiffening) * (twist - soft)) / compliance + damping * twist_rate


@pytest.mark.slow
@pytest.mark.parametrize("knee", [0.4, 0.8])
def test_a_gear_that_stiffens_at_a_corner_is_named(knee, tmp_path):
    gear = dataclasses.replace(LIBRARY["stiffening_elasticity"],
                               build=TwoBodies(kinked_torque, is_elastic))
    numbers = NAMES["stiffening_elasticity"] | {"knee": knee}
    found = diagnose(read(SOFT.write(tmp_path, SOFT.records([gear(**numbers)]))))
    first = found.to_dict()["effects"][0]
    assert first["effect"] == "stiffening_elasticity" and first["probability"] > 0.5
