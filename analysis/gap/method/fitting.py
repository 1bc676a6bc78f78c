"""Thresholds of residuals and fits."""

import dataclasses

import numpy as np

from clie_blocks.analysis.gap.method.threshold import threshold


@dataclasses.dataclass(frozen=True)
class FittingMethod:
    """Thresholds of residuals and fits."""

    noise_corner: float = threshold(
        20.0, "Hz", "above it, the error of a nearly right model is noise of the position")
    noise_rounds: int = threshold(
        4, "times", "most times that the noise is measured, each with a better nominal model")
    noise_round_gain: float = threshold(
        0.05, "share of the cost",
        "a refit that gains more shows that errors of the model before it were taken for noise")
    loop_peak: float = threshold(
        1.5, "times the noise of the sensor",
        "above the corner, from which the closed loop amplifies noise so that the error of a "
        "model is not that noise")
    prior_softness: float = threshold(
        0.25, "tolerances",
        "how far a parameter may lie beyond its datasheet at one standard deviation")
    observer_rate: float = threshold(
        20.0, "rad/s", "three times as fast as an arm of 0.3 m swings, and far below the noise")

    torque_lag_steps: tuple[float, ...] = threshold(
        (4e-3, 1e-3, 2.5e-4), "s",
        "of a measured torque's lag, to both sides of the best one so far")
    torque_lag_left: float = threshold(
        0.1, "share of what is left as logged",
        "that a lag of the measured torque may leave: what leaves more may be a soft gear")
    torque_lag_sought: float = threshold(
        0.5, "share of what the best hypothesis leaves",
        "that it may leave with a lag of the measured torque, to search again with it")
    torque_lag_rounds: int = threshold(
        2, "searches", "at most, with a lag of the measured torque")
    low_pass_starts: tuple[float, ...] = threshold(
        (4e-3, 7e-3), "s", "low-passes of a measured torque behind which backlash is sought")
    low_pass_left: float = threshold(
        0.9, "share of what a late torque leaves",
        "that one behind a low-pass may leave: it has one number more")

    many_joints: int = threshold(
        3, "joints", "at most, of a robot whose fits are short: on more, first steps borrow all "
        "slopes of the joint model, and fewer single causes are fitted to the end")

    difference_step: float = threshold(
        5e-3, "share of a parameter's size",
        "wider, curvature hides the slope of a flat valley and a fit crawls; narrower, the "
        "instants at which friction sticks and teeth meet hide it")
    iterations: int = threshold(6, "steps", "most steps of a fit, where nothing else is stated")
    nominal_iterations: int = threshold(
        40, "steps",
        "of the nominal model: a coupled arm takes many, and an effect must not be credited with "
        "what the refit left undone")
    least_damping: float = threshold(
        1e-6, "share of the squared columns",
        "more damping crawls where a cause and the joint model are alike")
    cautious_damping: float = threshold(
        1e-4, "share of the squared columns",
        "of a step of the joint model alone, and the least after a step that failed")
    retry_factors: tuple[float, ...] = threshold(
        tuple(map(float, 10.0 ** np.arange(1.0, 7.0, 0.75))), "times the damping that failed",
        "dampings of the steps that are tried side by side")
    step_reach: float = threshold(
        3.0, "times the parameter, or its size if that is larger",
        "most that one step may change a parameter: slopes say nothing of what is farther away")
    scale_step_factor: float = threshold(
        2.5, "factor",
        "by which one step may change a time or a range: what these do goes with their logarithm")
    converged_gain: float = threshold(
        1e-3, "chi^2 per residual", "a step that gains less ends a fit, with `converged_share`")
    converged_share: float = threshold(
        1e-4, "share of the cost", "a step that gains less ends a fit, with `converged_gain`")
    skipped_gain: float = threshold(
        0.1, "share of the gain that ends a fit",
        "a step that is predicted to gain less is not simulated")
    two_sided_violation: float = threshold(
        1.0, "squared standard deviations beyond the datasheet",
        "a fit that ends farther away continues with central differences: along a flat valley "
        "the curvature in a one-sided slope outweighs the datasheet")

    shrink_tries: int = threshold(
        4, "times", "amplitudes that start worse than without their cause are reduced")
    shrink_factor: float = threshold(0.3, "factor", "of one such reduction")
    joint_model_steps: int = threshold(
        2, "steps", "of the parameters that were fitted before, to make room for a new cause")

    pooling_ratio: float = threshold(
        3.0, "times the excess of the fit logs",
        "a hold-out log that is worse shows something that the others do not: fit it, too")
    pooling_excess: float = threshold(
        1.0, "excess per sample of a log and joint", "less says nothing about a log")

    refinement_rounds: int = threshold(3, "steps", "most steps towards the datasheet")
    refinement_gain: float = threshold(
        10.0, "chi^2 beyond chance", "a step towards the datasheet that gains less is the last")
    idle_joint_excess: float = threshold(
        0.05, "excess per sample",
        "a joint may be left out of a cause if the excess rises by less, with `idle_joint_share`")
    idle_joint_share: float = threshold(
        0.002, "share of the whole excess", "as `idle_joint_excess`; the two are added")
    slopes_valid_share: float = threshold(
        0.01, "share of the whole excess",
        "a fit that leaves less is so near that its slopes predict what a joint does")
    needed_joint_factor: float = threshold(
        10.0, "times the tolerated rise",
        "predicted by the slopes of the fit: no refit without the joint need confirm it")
    refit_rise_factor: float = threshold(
        3.0, "times the tolerated rise",
        "predicted by the slopes without the joint: no refit need confirm it either")
    pruning_iterations: int = threshold(3, "steps", "of a refit without a joint")

    shrunk_share: float = threshold(
        0.02, "share of a parameter's size",
        "a parameter that is smaller does nothing, so its cause is the simpler one without it")
    shrunk_deviations: float = threshold(
        10.0, "standard deviations",
        "a small parameter that is this far from zero does something after all")

    def is_long(self, joints: int) -> bool:
        """Whether a robot has so many joints that its fits take long."""
        return joints > self.many_joints
