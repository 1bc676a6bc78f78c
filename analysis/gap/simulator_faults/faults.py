"""Faults of simulators: what each makes of the run that the files state, and what mends it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator

import numpy as np

from clie_blocks.analysis.export.xml_text import Element
from clie_blocks.analysis.gap.simulator_faults.stated_run import StatedRun
from clie_blocks.analysis.records import Robot

DEGREE = np.pi / 180.0
TICKS = 2, 3, 4, 5, 8, 10  # periods in which a command may be held
DELAYS = 1, 2, 3, 4  # periods that a sensor may be late, where no delay of a drive is stated

Runs = Callable[[StatedRun], Iterator[StatedRun]]
"""What a run would be with the fault, at the joints of the run; none where nothing differs."""
Place = Callable[[StatedRun, int], Element | None]
"""Element of the model file that holds what is wrong at joint k; None where it is not there."""


@dataclasses.dataclass(frozen=True)
class Fault:
    """One way in which a simulator does not run what its files state.

    Parameters
    ----------
    name : str
        Of the fault.
    says : str
        What the simulator does, as the end of a sentence that begins with "The simulator".
    mend : str
        What to change.
    runs : callable
        See `Runs`.
    place : callable
        See `Place`.
    attribute : str
        Of the element at that place.
    of_robot : bool
        It has no joint of its own.
    free : int
        Numbers that the logs choose, where the others take theirs from the files.
    source : str
        Report of users who met it.

    """

    name: str
    says: str
    mend: str
    runs: Runs
    place: Place
    attribute: str
    of_robot: bool = False
    free: int = 0
    source: str = ""


def _of_joint(run: StatedRun, k: int) -> Element | None:
    return run.model.joint(k)


def _of_drive(run: StatedRun, k: int) -> Element | None:
    return run.model.drive(k)


def _of_section(name: str) -> Place:
    return lambda run, k: run.model.section(name)


def _nowhere(run: StatedRun, k: int) -> Element | None:
    return None


def _without_armature(run: StatedRun) -> Iterator[StatedRun]:
    if run.model.armature[run.at].any():
        yield run.joint_model(inertia=run.problem.nominal.inertia - run.model.armature / run.gear)


def _without_damping(run: StatedRun) -> Iterator[StatedRun]:
    if run.model.damping[run.at].any():
        yield run.joint_model(damping=run.problem.nominal.damping - run.model.damping / run.gear)


def _without_friction(run: StatedRun) -> Iterator[StatedRun]:
    if run.model.friction[run.at].any():
        yield run.effect("coulomb", level=0.0 * run.gear)


def _damping_for_friction(run: StatedRun) -> Iterator[StatedRun]:
    """The number of the dry friction as damping, in the place of the stated one or besides it."""
    for frictionless in _without_friction(run):
        for kept in (0.0, 1.0):
            damping = run.problem.nominal.damping + (
                run.model.friction - (1.0 - kept) * run.model.damping) / run.gear
            yield frictionless.joint_model(damping=damping)


def _soft_friction(run: StatedRun) -> Iterator[StatedRun]:
    for frictionless in _without_friction(run):
        yield frictionless.effect("soft_friction", level=run.model.friction / run.gear)


def _gains(factor: float) -> Runs:
    def runs(run: StatedRun) -> Iterator[StatedRun]:
        yield run.gains(factor)

    return runs


def _gravity(factor: float) -> Runs:
    def runs(run: StatedRun) -> Iterator[StatedRun]:
        if run.whole and run.problem.links.has_gravity:
            yield run.gravity(factor)

    return runs


def _gear(power: int) -> Runs:
    """The gear ratio once more, or once less, on the way of the torque."""
    def runs(run: StatedRun) -> Iterator[StatedRun]:
        if (run.gear[run.at] != 1.0).any():
            yield run.effect("torque_gain_error", error=run.gear**power - 1.0)

    return runs


def _limit_behind_gear(run: StatedRun) -> Iterator[StatedRun]:
    if (np.isfinite(run.model.limit) & (run.gear != 1.0))[run.at].any():
        yield run.effect("actuator_saturation", limit=run.model.limit / run.gear)


def _late_sensor(run: StatedRun) -> Iterator[StatedRun]:
    """Positions late by what the file states as delay of the drive, or by some periods.

    A law that sees late positions gives, late, what it would give to earlier set-points.
    """
    period = run.problem.period
    stated = np.unique(np.round(run.model.delay[run.at] / period).astype(int))
    for count in stated if stated.any() else DELAYS:
        if count:
            yield run.effect("time_delay", delay=np.full(len(run.at), count * period)
                             ).earlier_references(int(count))


def _without_delay(run: StatedRun) -> Iterator[StatedRun]:
    if run.model.delay[run.at].any():
        yield run.effect("time_delay", delay=0.0 * run.model.delay)


def _slow_tick(run: StatedRun) -> Iterator[StatedRun]:
    """A command that is held for several periods, the first of them that of the first sample."""
    one, period = np.ones(len(run.at)), run.problem.period
    for ticks in TICKS:
        yield run.effect("packet_hold", hold=(ticks - 1) * period * one,
                         interval=ticks * period * one, phase=(ticks - 0.5) / ticks * one)


def _long_step(run: StatedRun) -> Iterator[StatedRun]:
    if run.whole:
        yield run.any_lead()


def _mass_of_geoms(run: StatedRun) -> Iterator[StatedRun]:
    tree, robot = run.model.tree_of_geoms, run.problem.robot
    if run.whole and tree is not None and robot is not None and run.problem.links.known:
        of_geoms: Robot = dataclasses.replace(robot, tree=tree)
        yield run.links_of(of_geoms)


FAULTS = (
    Fault("soft_friction", "holds dry friction softly, so that a joint under load creeps",
          'make the constraint stiff: solreffriction="0.004 1" solimpfriction="0.9999 0.9999 '
          '0.001", or another engine',
          _soft_friction, _of_joint, "solimpfriction",
          source="isaac-sim/IsaacLab#7412, google-deepmind/mujoco#2082"),
    Fault("gain_per_degree", "takes the gains per degree and not per radian, 57.3 times too small",
          "multiply both gains by 180/pi where they are handed over, or divide none",
          _gains(DEGREE), _of_drive, "kp",
          source="isaac-sim/IsaacLab#4918, isaac-sim/IsaacSim#842"),
    Fault("gain_per_radian", "takes gains per radian as per degree, 57.3 times too large",
          "divide both gains by 180/pi where they are handed over, or multiply none",
          _gains(1.0 / DEGREE), _of_drive, "kp", source="whats2000/isaacsim-mcp-server#46"),
    Fault("gains_twice", "applies the gains twice, in the engine and in the controller",
          "set the gains of one of the two to zero",
          _gains(2.0), _of_drive, "kp", source="isaac-sim/IsaacLab#6022"),
    Fault("gravity_twice", "applies the weight twice",
          "leave it to the engine, or set the gravity of the engine to zero",
          _gravity(2.0), _of_section("option"), "gravity", of_robot=True),
    Fault("gravity_missing", "leaves out the weight, or compensates it",
          "set gravity, and gravcomp of the bodies to zero",
          _gravity(0.0), _of_section("option"), "gravity", of_robot=True,
          source="RethinkRobotics/baxter_simulator#108"),
    Fault("delay_at_sensor", "delays what the controller sees, and not what it commands",
          "delay the command: the actuator's attribute delay, and none at the sensor",
          _late_sensor, _of_drive, "delay", source="HybridRobotics/whole_body_tracking#28"),
    Fault("delay_without_effect", "does not delay the command as the file says",
          "set nsample beside delay, and do not write ctrl past the engine",
          _without_delay, _of_drive, "delay"),
    Fault("long_step", "takes longer steps than its file says",
          "set the timestep of the file in the run",
          _long_step, _of_section("option"), "timestep", of_robot=True, free=1,
          source="google-deepmind/mujoco#954"),
    Fault("armature_without_effect", "runs without the rotor inertia of its file",
          "look for what sets dof_armature after loading, or for a default class",
          _without_armature, _of_joint, "armature",
          source="Improbable-AI/walk-these-ways#41"),
    Fault("damping_without_effect", "runs without the damping of its file",
          "look for what sets dof_damping after loading, or for a default class",
          _without_damping, _of_joint, "damping", source="isaac-sim/IsaacLab#3222"),
    Fault("friction_without_effect", "runs without the dry friction of its file",
          "look for what sets dof_frictionloss after loading, or for a default class",
          _without_friction, _of_joint, "frictionloss",
          source="isaac-sim/IsaacLab#3231, dartsim/dart#890"),
    Fault("damping_for_friction", "takes the dry friction of its file as damping",
          "write the number to frictionloss, and not to damping",
          _damping_for_friction, _of_joint, "frictionloss", source="isaac-sim/IsaacLab#3410"),
    Fault("gear_twice", "multiplies the torque by the gear ratio twice",
          "hand over the torque of the motor, or set gear to 1",
          _gear(1), _of_drive, "gear", source="google-deepmind/mujoco#1010"),
    Fault("gear_missing", "does not multiply the torque by the gear ratio",
          "set gear, or hand over the torque of the joint",
          _gear(-1), _of_drive, "gear", source="google-deepmind/mujoco#1010"),
    Fault("limit_behind_gear", "limits the torque of the joint to what the motor may give",
          "state the limit of the motor as ctrlrange, or that of the joint gear times as large",
          _limit_behind_gear, _of_drive, "ctrlrange",
          source="google-deepmind/mujoco_menagerie#34"),
    Fault("slow_tick", "holds each command for several periods of the controller",
          "run the controller in every period: steps of the engine per command times its step "
          "are the sample time",
          _slow_tick, _nowhere, "", source="robotology/gazebo-yarp-plugins#69"),
    Fault("mass_of_geoms", "takes the masses from the geoms, and not the stated ones",
          'take out inertiafromgeom="true", so that <inertial> counts',
          _mass_of_geoms, _of_section("compiler"), "inertiafromgeom", of_robot=True,
          source="google-deepmind/mujoco#2405"),
)
