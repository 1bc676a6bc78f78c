"""The ways in which logs and robot files are damaged, by name.

``damage(name, folder, out, seed)`` copies a folder of one robot with one of them.
"""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from clie_blocks.analysis.blind.imperfect import clock_damages as of_clock
from clie_blocks.analysis.blind.imperfect import file_damages as in_file
from clie_blocks.analysis.blind.imperfect import log_damages as in_log
from clie_blocks.analysis.blind.imperfect.export import Export
from clie_blocks.analysis.blind.imperfect.log_damages import Change, Choice

HARMLESS, POORER, DESCRIPTION = "harmless", "poorer", "description"
KINDS = {
    HARMLESS: "nothing that counts is lost: the right class must still come first",
    POORER: "the log tells less: right, or honestly uncertain",
    DESCRIPTION: "files contradict themselves: the fault must be named or corrected"}
# The vocabulary's own words for a wrong description of the law.
CONTROLLER = "velocity_filter_mismatch", "gain_error"
NUMBERS = ("parametric",)  # a number of the file that is off may be reported so


@dataclass(frozen=True)
class Damage:
    """One way in which logs or a robot file are damaged.

    Parameters
    ----------
    name, sentence : str
        What it is.
    kind : str
        One of `KINDS`.
    change : callable
        Damages an `Export` and returns what it chose; raises `DoesNotApplyError` where the files
        cannot have it.
    words : str
        Regular expression: a sentence that it is found in names the damage.
    keys : tuple of str
        Keys of ``robot.toml`` whose correction names it.
    also_right : tuple of str
        Names of a diagnosis that describe the damage, beside the robot's own effect.

    """

    name: str
    sentence: str
    kind: str
    change: Change
    words: str = ""
    keys: tuple[str, ...] = ()
    also_right: tuple[str, ...] = ()


_ALL = (
    Damage("gap", "50 ms are missing in each log", HARMLESS, of_clock.cut_gap),
    Damage("lost_rows", "20 rows of each log were dropped", HARMLESS, of_clock.lose_rows),
    Damage("nan_samples", "10 positions of each log are NaN", HARMLESS, in_log.lose_values),
    Damage("clock_jitter", "stamps are off by 3 % of a step", HARMLESS, of_clock.jitter),
    Damage("clock_reset", "the clock of each log starts again from zero", HARMLESS,
           of_clock.reset_clock),
    Damage("repeated_rows", "1 % of the rows are written twice", HARMLESS, of_clock.repeat_rows),
    Damage("coarse_clock", "the clock ticks 64 times per second", HARMLESS, of_clock.coarse_clock),
    Damage("few_clock_digits", "stamps since power-on have too few digits", HARMLESS,
           of_clock.few_digits),
    Damage("two_rates", "one log at half the rate of the others", HARMLESS, of_clock.two_rates),
    Damage("logged_at_500_hz", "logged at 500 Hz", HARMLESS, of_clock.log_at(500.0)),
    Damage("logged_at_200_hz", "logged at 200 Hz", HARMLESS, of_clock.log_at(200.0)),
    Damage("logged_at_100_hz", "logged at 100 Hz", POORER, of_clock.log_at(100.0)),
    Damage("logged_at_50_hz", "logged at 50 Hz", POORER, of_clock.log_at(50.0)),
    Damage("noise_x5", "five times the noise in the logged position", POORER,
           in_log.add_noise(5.0)),
    Damage("noise_x20", "twenty times the noise in the logged position", POORER,
           in_log.add_noise(20.0)),
    Damage("encoder_noise_x5", "encoders with five times the noise", POORER,
           in_log.sense_with_noise(5.0)),
    Damage("encoder_noise_x20", "encoders with twenty times the noise", POORER,
           in_log.sense_with_noise(20.0)),
    Damage("one_log", "a single experiment", POORER, of_clock.one_log),
    Damage("short_logs", "logs of 5 s", POORER, of_clock.short_logs),
    Damage("positions_in_degrees", "q and qd are in degrees, the header is silent", DESCRIPTION,
           in_log.scale(180 / np.pi, "q", "qd"), r"\bdeg|°"),
    Damage("clock_in_ms", "time is in ms, the header is silent", DESCRIPTION, of_clock.clock_in_ms,
           r"(clock|time|stamp).*(\bms\b|millisec)"),
    Damage("torque_in_mnm", "u and pe are in mN m, the header is silent", DESCRIPTION,
           in_log.scale(1e3, "u", "pe"), r"\bmN ?m|1000|0\.001|1e-0?3"),
    Damage("torque_in_percent", "u and pe are in % of the rated torque, the header is silent",
           DESCRIPTION, in_log.percent_of_rated,
           r"\bKp\b|(\bu\b|torque|command).*(unit|factor|times|scale|%)",
           also_right=("gain_error",)),  # the gains are off alike
    Damage("torque_on_joint_side", "u and pe are on the joint side", DESCRIPTION,
           in_log.joint_side, r"joint side|gear ratio"),
    Damage("command_sign", "the sign of one command is turned", DESCRIPTION,
           in_log.turn_sign("u"), r"\bsign\b|opposite|inverted"),
    Damage("position_sign", "the sign of one position is turned", DESCRIPTION,
           in_log.turn_sign("q"), r"\bsign\b|opposite|inverted"),
    Damage("commands_swapped", "the commands of two joints are swapped", DESCRIPTION,
           in_log.swap("u"), r"swap|exchanged|another joint|order"),
    Damage("positions_swapped", "the positions of two joints are swapped", DESCRIPTION,
           in_log.swap("q"), r"swap|exchanged|another joint|order"),
    Damage("late_command", "commands arrive 3 to 10 samples late in the log", DESCRIPTION,
           in_log.late_command, r"\blate\b|later|trails|delay|shifted|lags|samples? behind",
           also_right=("channel_skew",)),  # the catalogue's name for it
    Damage("late_position", "one position arrives 3 to 10 samples late in the log", DESCRIPTION,
           in_log.late_position, r"\blate\b|later|trails|delay|shifted|lags|samples? behind"),
    Damage("lost_pe", "the injected torque is not logged", DESCRIPTION, in_log.lose("pe"),
           r"\bpe\b|injected|excitation"),
    Damage("lost_reference", "the reference is not logged", DESCRIPTION, in_log.lose("qd"),
           r"\bqd\b|reference"),
    Damage("resolution_12_bit", "the logged position has 12 bit per turn", DESCRIPTION,
           in_log.coarse_position, r"steps? of|resolution|coarse|quanti[sz]",
           ("encoder.resolution_rad",), ("encoder_quantization",)),
    Damage("dead_position", "one position does not change", DESCRIPTION, in_log.hold("q"),
           r"\bdead|moves by only|does not (move|change)|stands? still|stuck|constant|hangs?\b"),
    Damage("dead_command", "one command does not change", DESCRIPTION, in_log.hold("u"),
           r"\bdead|does not (move|change)|never changes|stuck|constant|always|zero"),
    Damage("wrong_kp", "the file states Kp of one joint 25 % off", DESCRIPTION,
           in_file.misstate("controller", "Kp", 1.25), r"\bKp\b", ("controller.Kp",),
           CONTROLLER),
    Damage("wrong_kd", "the file states Kd of one joint 25 % off", DESCRIPTION,
           in_file.misstate("controller", "Kd", 1.25), r"\bKd\b", ("controller.Kd",),
           CONTROLLER),
    Damage("wrong_motor_inertia", "the file states one rotor inertia 25 % off", DESCRIPTION,
           in_file.misstate("motor", "inertia_kgm2", 1.25), r"inertia",
           ("motor.inertia_kgm2",), NUMBERS),
    Damage("wrong_motor_friction", "the file states one motor's viscous friction 60 % off",
           DESCRIPTION, in_file.misstate("motor", "viscous_friction_nms", 1.6),
           r"viscous|damping", ("motor.viscous_friction_nms",), NUMBERS),
    Damage("wrong_gear_ratio", "the file states one gear ratio 25 % off", DESCRIPTION,
           in_file.misstate("motor", "gear_ratio", 1.25), r"gear ratio",
           ("motor.gear_ratio",), NUMBERS),
    Damage("wrong_link_mass", "the file states one link mass 25 % off", DESCRIPTION,
           in_file.misstate("links", "mass_kg", 1.25), r"\bmass\b", ("links.mass_kg",), NUMBERS),
    Damage("wrong_com", "the file states one centre of mass from the far end of its link",
           DESCRIPTION, in_file.com_from_far_end, r"\bcom\b|com_m|centre of mass",
           ("links.com_m",), NUMBERS),
    Damage("joint_order", "the file lists the joints in reverse", DESCRIPTION,
           in_file.other_joint_order, r"swap|order|another joint"),
    Damage("zero_offset", "another zero of one joint in q and qd, under gravity", DESCRIPTION,
           in_log.shift_position("q", "qd"), r"\bzero|offset of (the )?position|start"),
    Damage("position_offset", "another zero of one joint in q alone", DESCRIPTION,
           in_log.shift_position("q"), r"\bzero|offset|shifted"),
)
DAMAGES: dict[str, Damage] = {one.name: one for one in _ALL}


def damage(name: str, folder: str | os.PathLike[str], out: str | os.PathLike[str],
           seed: int = 0) -> Choice:
    """Copy the folder of one robot with a damage; return what was chosen, such as the joint.

    Parameters
    ----------
    name : str
        Of `DAMAGES`.
    folder, out : path-like
        Holds ``robot.toml`` and logs ``*.csv`` or ``*.csv.gz``, as blind trials are written; where
        the copy goes, whose earlier contents are removed.
    seed : int
        Of all chance.

    Raises
    ------
    DoesNotApplyError
        If these files cannot have the damage, as with a swap of two joints on a robot of one.

    """
    export = Export.read(Path(folder))
    chosen = DAMAGES[name].change(export, np.random.default_rng(seed))
    export.write(Path(out))
    return chosen
