"""Effects against robots of an independent engine: recorded torques in, recorded motion out.

The practice trials come with the true numbers of robot and effect.  The command that was logged
drives our plant with our effect, with no feedback and nothing fitted, for 20 s to 30 s: the motion
differs from the logged one by the noise of the sensor, and by far more without the effect.  An arm
that would fall over without its controller runs under the sampled controller of its data sheet.
"""

import json

import control as ct
import numpy as np
import pytest

from clie_blocks.analysis.records import read_trial
from clie_blocks.compiled import compile_diagram, sampled
from clie_blocks.controllers import pd_controller
from clie_blocks.effects import LIBRARY, with_effects
from clie_blocks.joints import inertial_joints
from clie_blocks.manipulator import two_link_arm
from clie_blocks.signals import interconnect, signals

G = 9.81


def coulomb(robot, truth, numbers):
    return LIBRARY["coulomb"](joints=0, level=numbers["level_nm"]["1"], width=1e-4)


def stribeck(robot, truth, numbers):
    return LIBRARY["stribeck"](
        joints=1, level=numbers["coulomb_nm"]["2"], width=1e-4,
        excess=(numbers["static_over_coulomb"] - 1.0) * numbers["coulomb_nm"]["2"],
        velocity=numbers["stribeck_velocity_rad_s"])


def quadratic_drag(robot, truth, numbers):
    return LIBRARY["quadratic_drag"](drag=numbers["drag_nm_s2"]["1"])


def gravity(robot, truth, numbers):
    mass, length, com = robot.links.mass, robot.links.length, robot.links.com
    moment = np.array([mass[0] * com[0] + mass[1] * length[0], mass[1] * com[1]])
    tilt = np.deg2rad(numbers["mount_tilt_deg"])  # of a base whose joint axes were upright
    return LIBRARY["gravity"](weight=moment * G * np.sin(tilt), gear_ratio=robot.motor.gear_ratio)


def spring(robot, truth, numbers):
    return LIBRARY["spring"](joints=1, hardening=0.0, rest=numbers["rest_rad"]["2"],
                             stiffness=numbers["stiffness_nm_rad"]["2"] / robot.motor.gear_ratio)


def time_delay(robot, truth, numbers):
    return LIBRARY["time_delay"](delay=list(numbers["delay_s"].values()))


def torque_gain_error(robot, truth, numbers):
    return LIBRARY["torque_gain_error"](error=numbers["gain"]["1"] - 1.0)


def backlash(robot, truth, numbers):
    ratio = robot.motor.gear_ratio
    return LIBRARY["backlash"](
        joints=1, half_gap=numbers["half_gap_rad"]["2"], stiffness=500.0, damping=2.0,
        motor_inertia=ratio * truth["J"], motor_damping=ratio * truth["R"])


TRIALS = {
    "trial-000": (spring, time_delay), "trial-001": (backlash,), "trial-002": (gravity,),
    "trial-004": (torque_gain_error,), "trial-007": (coulomb,), "trial-009": (stribeck,),
    "trial-011": (quadratic_drag,),
}


def true_plant(robot, truth):
    """Return the plant with the true numbers, and what it needs beside: its weight, the offset."""
    links, ratio = robot.links, robot.motor.gear_ratio
    beside = [LIBRARY["offset"](torque=-np.array(truth["torque_offset"]))]
    if robot.n == 2:
        return two_link_arm(links.mass, links.length, ratio, truth["J"], truth["R"],
                            com=links.com, j_link=links.inertia, h=links.joint_viscous_friction,
                            g=G * robot.nominal.gravity), beside
    if robot.nominal.gravity:
        beside.append(LIBRARY["gravity"](weight=links.mass * links.com * G, gear_ratio=ratio,
                                         name="own_weight"))
    return inertial_joints(
        ratio * truth["J"] + (links.mass * links.com**2 + links.inertia) / ratio,
        ratio * truth["R"] + links.joint_viscous_friction / ratio, [0.0]), beside


def distance(plant, robot, record, parts):
    """Root mean square difference of the motion under the recorded torques, per joint [rad]."""
    steps = len(record) - 1
    start = robot.experiments[record.source.rpartition("/")[2].partition(".")[0]].start
    state = np.zeros(plant.nstates)
    state[[plant.state_labels.index(f"plant_q[{k}]") for k in range(robot.n)]] = start
    run = compile_diagram(plant).run(
        steps * record.sample_time, record.sample_time / parts, "ode4", log="q", every=parts,
        inputs={"u": np.repeat(record.u[:-1], parts, axis=0)}, initial_state=state)
    q = np.asarray(run.outputs).reshape(robot.n, -1).T
    return np.sqrt(np.mean((q - record.q) ** 2, axis=0))


@pytest.mark.parametrize("trial", TRIALS)
def test_our_effect_moves_as_the_recorded_robot(shared, trial):
    folder = shared / "blind" / "practice"
    label = json.loads((folder / "labels.json").read_text())[trial]
    truth = {key: np.array(value) for key, value in label["true_robot"].items()}
    numbers = {effect["effect"]: effect["parameters"] for effect in label["effects"]}
    robot, records = read_trial(folder / trial)
    plant, beside = true_plant(robot, truth)
    effects = [make(robot, truth, numbers[make.__name__]) for make in TRIALS[trial]]
    floor = np.array(label["noise"]["floor_rad"])
    parts = 20 if trial == "trial-001" else 4  # of a sample; tooth contact is stiff
    for record in records:
        without = distance(with_effects(plant, beside), robot, record, parts)
        affected = distance(with_effects(plant, [*effects, *beside]), robot, record, parts)
        assert np.all(affected < 1.06 * floor), (record.source, affected / floor)
        assert np.max(without / floor) > 3.0, (record.source, without / floor)


def sampled_controller(controller, n):
    """PD law on the position and its velocity through G1, discretised by Tustin's rule."""
    corners = (controller.highpass, controller.lowpass)
    g1 = ct.ss(ct.sample_system(
        ct.tf([np.prod(corners), 0.0], np.polymul([1.0, corners[0]], [1.0, corners[1]])),
        controller.sample_time, "bilinear"))
    stacked = [np.kron(np.eye(n), matrix) for matrix in (g1.A, g1.B, g1.C, g1.D)]
    velocity = ct.ss(*stacked, controller.sample_time, name="g1", inputs=signals("q", n=n),
                     outputs=signals("dq", n=n))
    law = interconnect(
        [pd_controller(controller.kp, controller.kd, name="pd"), velocity],
        [("pd.dq", "g1.dq")], name="controller",
        inputs={"q_d": "pd.q_d", "q": ["pd.q", "g1.q"], "pe": "pd.pe"}, outputs={"u": "pd.u"})
    at_rest = np.linalg.solve(np.eye(2) - g1.A, g1.B).ravel()  # the filter's state at q = 1
    return law, at_rest


def closed_loop_distance(plant, robot, record, parts=4):
    """As `distance`, with the sampled controller in the place of the recorded command."""
    law, at_rest = sampled_controller(robot.controller, robot.n)
    loop = sampled(plant, law, wires=[("plant.u", "controller.u"), ("controller.q", "plant.q")])
    start = robot.experiments[record.source.rpartition("/")[2].partition(".")[0]].start
    steps = len(record) - 1
    run = loop.run(
        steps * record.sample_time, record.sample_time / parts, "ode4", log="q", every=parts,
        inputs={"q_d": np.repeat(record.qd[:-1], parts, axis=0),
                "pe": np.repeat(record.pe[:-1], parts, axis=0)},
        initial_state={"plant.plant": np.concatenate((start, np.zeros(robot.n))),
                       "controller.g1": np.kron(start, at_rest)})
    q = np.asarray(run.outputs).reshape(robot.n, -1).T
    return np.sqrt(np.mean((q - record.q) ** 2, axis=0))


def test_a_payload_put_on_moves_the_closed_loop_as_recorded(shared):
    folder = shared / "blind" / "practice"
    label = json.loads((folder / "labels.json").read_text())["trial-006"]
    truth = {key: np.array(value) for key, value in label["true_robot"].items()}
    (hidden,) = label["effects"]
    robot, records = read_trial(folder / "trial-006")
    plant, beside = true_plant(robot, truth)
    floor = np.array(label["noise"]["floor_rad"])
    for record, onset in zip(records, hidden["onset_s"].values()):
        fault = LIBRARY["step_fault"](
            weight=hidden["parameters"]["mass_kg"] * G * robot.links.length, time=onset,
            gear_ratio=robot.motor.gear_ratio)  # 1.5 g: its inertia does not show
        without = closed_loop_distance(with_effects(plant, beside), robot, record)
        affected = closed_loop_distance(with_effects(plant, [fault, *beside]), robot, record)
        assert np.all(affected < 1.06 * floor), (record.source, affected / floor)
        assert np.max(without / floor) > 1.7, (record.source, without / floor)
