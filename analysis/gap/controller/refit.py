"""What ran instead of the stated law, put into the problem: gains, integral part, delay.

The diagnosis goes on with the law that ran, so that a wrong description is not mistaken for a
fault of the robot.
"""

import dataclasses
from collections.abc import Mapping

import numpy as np

from clie_blocks.analysis.gap.controller.law_residual import known_samples, law_residual
from clie_blocks.analysis.gap.problem.initial_state import with_initial_speed, with_initial_state
from clie_blocks.analysis.gap.problem.law import Law, StatedLaw
from clie_blocks.analysis.gap.problem.log import Log
from clie_blocks.analysis.gap.problem.own_law import BlockLaw, with_law_state
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.problem.sensor_noise import sensor_noise

COARSE_COMMAND = 0.015  # of the standard deviation of a command: smaller steps hardly show
LOUD_ROUNDING = 1.0  # of the encoder's noise: what moves a slow joint by less is lost in it
DELAYED_COMMANDS = (
    "every command follows from the sample before it: the controller sends it one period after "
    "it has measured; the robot file is wrong, and the model has this delay from here on")


def with_law_states(problem: Problem, law: Law) -> Problem:
    """Problem whose logs begin in the state that the commands show of a law that runs as a block.

    Of another law the velocity in the first sample was read from its commands.
    """
    if isinstance(law, BlockLaw) and not isinstance(problem.law, BlockLaw):
        problem = problem.with_logs(lambda log: with_initial_speed(log, law.period))
    return problem.with_logs(lambda log: with_law_state(log, law))


def without_recorded_excitation(problem: Problem) -> Problem:
    """Problem of a machine of unknown law, without its commands as the excitation."""
    return problem.with_logs(lambda log: dataclasses.replace(log, pe=0.0 * log.pe))


def with_gain_error(law: StatedLaw, k: int, kp_error: float = 0.0,
                    kd_error: float = 0.0) -> StatedLaw:
    """Return the law with gains of joint k that are off by relative errors."""
    kp, kd = law.kp.copy(), law.kd.copy()
    kp[k] *= 1.0 + kp_error
    kd[k] *= 1.0 + kd_error
    return dataclasses.replace(law, kp=kp, kd=kd)


def describe_gains(name: str, stated: StatedLaw, ran: StatedLaw, k: int) -> str:
    """Gains that ran at joint k, and the stated ones, as a sentence."""
    parts = [f"{key} {getattr(ran, key)[k]:.4g}, stated {getattr(stated, key)[k]:.4g}"
             for key in ("kp", "kd")]
    return (f"{name}: the gains that ran are not the stated ones ({'; '.join(parts)}); the robot "
            "file is wrong, or somebody changed the controller")


def describe_integral(name: str, gain: float) -> str:
    """Integral part that ran at a joint, as a sentence."""
    return (f"{name}: the command contains an integral part of {gain:.4g} N m/(rad s) that the "
            "robot file does not state; the file is wrong, or somebody changed the controller")


def delayed_replay_error(problem: Problem, law: StatedLaw) -> np.ndarray:
    """RMS of the logged command less that of the law one sample before it [N m], shape (n,)."""
    squares = [np.mean(law_residual(law, log, delay=1) ** 2, axis=0) for log in problem.logs]
    return np.sqrt(np.max(squares, axis=0))


def with_command_delay(problem: Problem) -> Problem:
    """Problem whose commands stand at the sample in which they were computed, and act later.

    A command that is computed in one period and sent in the next is a matter of the controller's
    description, and no lag of the drive.
    """
    earlier = problem.with_logs(lambda log: dataclasses.replace(
        log, u=np.concatenate([log.u[1:], log.u[-1:]])))
    return dataclasses.replace(earlier, command_delay=problem.period)


def with_commands_of_law(problem: Problem, late: Mapping[int, int]) -> Problem:
    """Problem with the law's own commands where their record is wrong.

    Parameters
    ----------
    problem : Problem
        With the law that ran.
    late : dict of int to int
        Joint -> rows by which its command is recorded late.  The first command of the law shows
        whether a log begins in motion.

    """
    if not late:
        return problem
    law, at, rows = problem.stated_law, list(late), list(late.values())

    def replayed(log: Log) -> Log:
        of_law, u = law.commands(log), log.u.copy()
        u[:, at], u[0, at] = of_law[:, at], log.u[rows, at]
        moving = with_initial_state(
            dataclasses.replace(log, u=u, speed=0.0, at_rest=True), law)
        if not moving.at_rest:
            return moving
        u[0, at] = of_law[0, at]
        return dataclasses.replace(moving, u=u)

    return problem.with_logs(replayed)


def with_command_rounding(problem: Problem) -> Problem:
    """Problem whose models get the rounding of coarse commands with the excitation.

    A command in steps is the law's and an error within half a step, which the logs show.  It moves
    the robot; a model that commands without steps would err by as much.  Steps are coarse beside
    the commands, or where their error moves a slow joint by more than its encoder's noise.
    """
    if not problem.law.is_replayable:
        return problem
    law, step = problem.stated_law, problem.law.resolution
    spread = np.concatenate([log.u for log in problem.logs]).std(axis=0)
    noise = np.array([sensor_noise(problem, k) for k in range(problem.n)])
    loud = step / np.sqrt(12.0) > LOUD_ROUNDING * problem.law.kp * noise
    largest = np.where(loud | (step > COARSE_COMMAND * spread), step / 2, 0.0)
    if law.measured_torque or not largest.any():
        return problem

    def rounded(log: Log) -> Log:
        if not log.shows_every_tick:  # the commands between its samples are not known
            return log
        error = np.clip(log.u - law.commands(log), -largest, largest)
        known = known_samples(log, law)[:, None] & (np.abs(log.u) < law.saturation)
        return log.following(np.where(known, error, 0.0))

    return problem.with_logs(rounded)
