"""Thresholds of the search: screening, racing, alternatives, events."""

import dataclasses

from clie_blocks.analysis.gap.method.calibration import Calibration
from clie_blocks.analysis.gap.method.threshold import threshold


@dataclasses.dataclass(frozen=True)
class SearchMethod:
    """Thresholds of the search: screening, racing, alternatives, events."""

    negligible_share: float = threshold(
        Calibration.misfit, "share of the whole excess",
        "a hypothesis that leaves less is not extended: no further cause could outweigh its cost")

    joint_gain: float = threshold(
        10.0, "chi^2", "a further joint of a cause, or the second cause of a pair, must add more")
    joint_share: float = threshold(
        0.03, "share of the gain at the best joint", "a further joint of a cause must add more")
    probes_per_cause: int = threshold(2, "probes", "of each cause at each joint, in pairs")
    leaders: int = threshold(14, "causes", "alone, that are fitted")
    leading_pairs: int = threshold(4, "pairs", "that may be fitted")
    extended_fits: int = threshold(3, "fits", "for which a second cause is sought")
    screened_extensions: int = threshold(
        8, "causes", "that explain most of what a fit leaves: they are tried as its extensions")
    extensions: int = threshold(5, "causes", "that may be fitted together with those of a fit")
    described_fits: int = threshold(
        2, "fits", "of causes that are fitted together with each number of the robot file")
    most_causes: int = threshold(6, "causes", "at once")
    joint_candidates: int = threshold(
        5, "causes", "of each joint, that are fitted side by side with those of other joints")
    joint_by_joint_share: float = threshold(
        0.02, "share of the whole excess",
        "that a fit may leave for its joints to hold no further causes that need each other")
    hopeless_share: float = threshold(
        0.3, "share of the excess without it",
        "that a set may leave, or one more cause may be predicted to leave, for larger sets to be "
        "fitted; a fit that leaves more of the whole excess is not pruned")
    pruned_leaders: int = threshold(2, "fits", "the best, that lose their idle joints")
    neighbour_rounds: int = threshold(
        4, "rounds", "of sets with one cause more, or exchanged, around the leading one")
    alternative_rounds: int = threshold(
        3, "rounds", "of alternatives of the best fit, which may be one of them")

    alike_alone: float = threshold(
        1.25, "times its excess alone",
        "that another cause may leave alone, or leave it, to be tried in its place in a set")
    most_alike_alone: int = threshold(6, "causes", "that are tried in the place of one for that")
    least_alike_alone: int = threshold(3, "causes", "that are tried so where little is left")
    competing_score: float = threshold(
        0.5, "of the best",
        "gain that a single cause must promise, to be fitted beside one that leaves only noise")
    searched_share: float = threshold(
        0.02, "share of what all joints leave",
        "that a joint must leave for ripples and faults of its drive to be sought there")
    settled_share: float = threshold(
        0.01, "share of what a joint leaves",
        "that the best gridded cause may leave there for faults of its drive not to be sought: "
        "they could not explain more")
    refined_share: float = threshold(
        0.1, "of what is left", "that a fault of a drive must explain at a joint to be refined")
    single_finalists: int = threshold(6, "fits", "of single causes that are continued to the end")
    pair_finalists: int = threshold(3, "fits", "of pairs that are continued to the end")
    larger_finalists: int = threshold(
        2, "fits", "of sets of three or more that are continued to the end")
    alternative_finalists: int = threshold(
        4, "fits", "of alternatives that are continued to the end")
    favourites: int = threshold(
        2, "fits",
        "of the best of the screening that are continued while much is left, however slow")
    first_steps: int = threshold(2, "steps", "of each candidate that competes")
    finalist_steps: int = threshold(8, "steps", "of a fit that is continued")
    leader_steps: int = threshold(24, "steps", "more, of the leader that still moves")
    leader_rounds: int = threshold(3, "times", "so many, if it still moves after them")
    far_behind: float = threshold(
        10.0, "times the excess of the best", "a fit that leaves more is not continued")
    unresolved_share: float = threshold(
        0.05, "share of an excess", "that linear predictions do not resolve")
    fair_share: float = threshold(
        0.8, "share of the excess without it",
        "a cause that leaves more explains too little to be there: many that are not there "
        "explain a little")
    several_causes_share: float = threshold(
        0.5, "share of the whole excess",
        "that two causes or more may be predicted to leave: something unknown leaves less")
    absorbed_ratio: float = threshold(
        0.5, "times the best prediction for a cause alone",
        "a fit below it shows that the refitted nominal model has absorbed much of the effect, so "
        "that linear predictions are unreliable")

    false_minimum_gain: float = threshold(
        1.0, "chi^2", "by which a start must beat a fit for that to be a false minimum")

    following_stiffness: float = threshold(
        4.0, "times kp", "feedback that holds a model near the measured motion")
    following_damping: float = threshold(
        2.0, "times kd", "the same of the rate: the loop is twice as fast, and damped alike")
    following_share: float = threshold(
        0.1, "share of the whole excess",
        "that the best single cause leaves, for sets to be sought along the measured motion")
    following_time: float = threshold(
        0.5, "share of the time left", "that the search along the measured motion may take")
    following_left: float = threshold(
        0.02, "share of the excess along the measured motion",
        "that a set found there may leave to be fitted in the stated loop")
    following_sets: int = threshold(
        3, "sets", "found along the measured motion that are fitted in the stated loop")

    fault_margin: float = threshold(
        1.0, "s", "at both ends of a log, where no onset of a fault is sought")
    onset_spacing: float = threshold(1.0, "s", "between the onsets that are tried first")
    onset_refinements: tuple[float, ...] = threshold(
        (0.04, 4e-3), "s", "between those that are tried next, for the kinds that do best")
    leading_fault_share: float = threshold(
        0.3, "share of the best kind's gain", "a kind of fault that gains less is not refined")
    refit_onset_spacing: float = threshold(
        0.2, "s", "between the onsets of a fitted fault that are tried in the whole log")
    refit_onset_refinements: tuple[float, ...] = threshold(
        (0.02, 4e-3), "s", "between those that are tried next, around the best")
    simulated_onset_reaches: tuple[float, ...] = threshold(
        (0.5, 0.07, 0.01), "s",
        "around an onset, where it is simulated, as friction that sticks needs")
    onset_gain: float = threshold(
        20.0, "chi^2", "that the best of a thousand onsets may gain in a log without the fault")
    event_iterations: int = threshold(4, "steps", "of a fit with new phases and onsets")
    event_rounds: int = threshold(3, "rounds", "of new phases and onsets")
    event_round_gain: float = threshold(
        0.01, "share of chi^2", "a round that removes less is the last")

    ripple_least_waves: float = threshold(
        1.0, "waves over the travel", "of a ripple: less of a wave is a spring")
    ripple_most_per_motor_turn: float = threshold(
        24.0, "waves per motor turn",
        "of a ripple: two per electrical turn of twelve pairs of poles")
    ripple_most_per_turn: float = threshold(
        48.0, "waves per joint turn", "of a ripple, for joints with little gear")
    ripple_most_teeth: float = threshold(
        300.0, "waves per joint turn",
        "of a gear's teeth: a last wheel of 150 mm with a module of half a millimetre")
    ripple_most_behind_gear: float = threshold(
        1600.0, "waves per joint turn",
        "of a ripple where the motor's turns are not known: ten per motor turn behind a gear of "
        "160, the largest of harmonic drives")
    ripple_lines: int = threshold(
        3, "orders", "that are tried, with the strongest of each octave")
    ripple_lines_of_log: int = threshold(
        2, "orders", "of each log that are tried as well")

    budget_share: float = threshold(
        0.8, "share of the budget of a diagnosis",
        "after which the search ends: the rest is for reading, unseen data and the next run")
    long_budget_share: float = threshold(
        0.7, "share of the budget of a diagnosis",
        "the same for arms of many joints, of which the rest takes longer")
    idle_seconds: float = threshold(
        8.0, "s", "that a search takes to leave idle causes out, after it had to stop as well")
    other_delay_seconds: float = threshold(
        6.0, "s", "that it takes to exchange the delays of its leader, likewise")
