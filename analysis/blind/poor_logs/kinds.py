"""What a log of the study holds, what is poor about it, and which of both a trial gets."""

import dataclasses
import math

MOTOR, JOINT = "q_motor", "q"  # the position on which a law acts


@dataclasses.dataclass(frozen=True)
class Content:
    """Signals of a log, and what the robot file says of them.

    Parameters
    ----------
    signals : tuple of str
        Beside time and position: `u` and `tau` may hold the command or the torque of the motor.
    states_law : bool
        Whether the file states the law; it is else unknown.
    measured : str
        Signal that holds the torque of the motor; empty for none.
    acts_on : str
        Position on which the law acts.

    """

    signals: tuple[str, ...]
    states_law: bool = True
    measured: str = ""
    acts_on: str = JOINT

    @property
    def has_torque(self) -> bool:
        """Whether a command or a torque is logged."""
        return bool({"u", "tau"} & {*self.signals})

    @property
    def shows_drive(self) -> bool:
        """Whether what a drive does to a command can be told."""
        return not self.measured or "u" in self.signals and "tau" in self.signals


COMMAND, SERVO, CURRENT, TWO_SIDES = "command", "servo", "current", "two_sides"
CONTENTS = {
    COMMAND: Content(("u", "qd")),
    "measured": Content(("u", "qd"), measured="u"),
    "measured_without_law": Content(("tau", "qd"), states_law=False, measured="tau"),
    "both": Content(("u", "tau", "qd"), measured="tau"),
    "neither": Content(("qd",)),
    SERVO: Content(("qd",), states_law=False),
    "torque_alone": Content(("tau",), states_law=False, measured="tau"),
    CURRENT: Content(("tau",), states_law=False, measured="tau"),
    TWO_SIDES: Content(("u", "q_motor", "qd"), acts_on=MOTOR)}


@dataclasses.dataclass(frozen=True)
class Condition:
    """What is poor about a log.

    Parameters
    ----------
    period : float
        Of the controller [s].
    every : int
        Samples of the controller per row of the log.
    logs : int
        Experiments.
    seconds : float
        Length of each [s].
    stands_still : bool
        Whether the motion is pick-and-place with long standstills.
    noise : tuple of float
        Least and largest factor on the noise of the encoder, which the controller reads, too.
    encoder_steps : float
        Steps of the encoder per turn; the file states them.
    is_coarse : bool
        Whether the logger rounds torques to a fiftieth of the largest, and positions to 0.1
        degrees where no torque is logged.
    is_filtered : bool
        Whether the measured torque passed a low-pass, or all channels where there is none.
    is_jittered : bool
        Whether the logger takes samples at uneven times, which its stamps say, and drops some.

    """

    period: float = 2e-3
    every: int = 1
    logs: int = 3
    seconds: float = 8.0
    stands_still: bool = False
    noise: tuple[float, float] = (1.0, 1.0)
    encoder_steps: float = 2.0 * math.pi / 2e-5
    is_coarse: bool = False
    is_filtered: bool = False
    is_jittered: bool = False


CONDITIONS = {
    "100_hz": Condition(every=5),
    "50_hz": Condition(every=10),
    "5_khz": Condition(period=2e-4, seconds=5.0),
    "standstills": Condition(stands_still=True, seconds=12.0),
    "short": Condition(seconds=5.0),
    "one_log": Condition(logs=1),
    "noise": Condition(noise=(5.0, 20.0)),
    "12_bit": Condition(encoder_steps=4096.0),
    "coarse": Condition(is_coarse=True),
    "filtered": Condition(is_filtered=True),
    "jittered": Condition(is_jittered=True)}
SERVO_PERIOD = 0.02  # s, at which a hobby servo is polled, on average


def turn(index: int) -> tuple[str, str, bool]:
    """Content and condition of a trial, and whether its robot is sound.

    The contents come in turn, the conditions too, so that 99 trials hold each pair once; of each
    content and of all trials a third is sound.
    """
    content, condition = index % len(CONTENTS), index % len(CONDITIONS)
    sound = (index + index // len(CONTENTS)) % 3 == 0
    return list(CONTENTS)[content], list(CONDITIONS)[condition], sound


def conditions_of(name: str, content: str) -> Condition:
    """Return a condition as it is for a content: a servo is polled slowly, and twice as long."""
    condition = CONDITIONS[name]
    if content != SERVO:
        return condition
    slow = round(SERVO_PERIOD / condition.period) // (2 if condition.is_jittered else 1)
    return dataclasses.replace(condition, every=slow, seconds=2.0 * condition.seconds)
