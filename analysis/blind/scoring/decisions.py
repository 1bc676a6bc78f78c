"""A diagnosis and the truth in the same words, so that they can be compared."""

from typing import Any

FAMILIES = {
    "friction": ("coulomb", "stribeck", "asymmetric_coulomb", "quadratic_drag",
                 "load_dependent_friction", "presliding", "friction_drift", "dahl",
                 "maxwell_slip", "position_dependent_friction", "rest_time_breakaway",
                 "directional_efficiency"),
    "load": ("gravity", "payload", "coupling", "spring", "base_tilt", "counterbalance",
             "soft_stop", "fluid_drag"),
    "transmission": ("joint_elasticity", "backlash", "stiffening_elasticity",
                     "torsional_hysteresis", "kinematic_error", "gear_mesh_ripple",
                     "coupled_joints", "ratio_error"),
    "timing": ("actuator_lag", "time_delay", "velocity_filter_mismatch", "setpoint_delay",
               "in_loop_delay", "tick_jitter", "packet_hold"),
    "actuator": ("actuator_saturation", "dead_zone", "torque_ripple", "torque_gain_error",
                 "torque_speed_limit", "commutation_ripple", "back_emf", "supply_sag",
                 "motor_heating", "torque_quantization", "torque_slew",
                 "setpoint_slew"),
    "controller": ("gain_error", "control_law_form", "hidden_integral", "hidden_compensation"),
    "sensor": ("encoder_quantization", "encoder_eccentricity", "encoder_offset",
               "velocity_estimate_lag", "channel_skew", "sensor_gain"),
    "external": ("periodic_disturbance",), "step_fault": ("step_fault",)}
FAMILY = {name: family for family, names in FAMILIES.items() for name in names}
NO_EFFECTS = ("none", "unknown", "parametric")  # answers that are no effects
SEVERAL = ("pair", "triple")  # kinds of trial with more than one effect
IN_LIBRARY = ("single", *SEVERAL)  # kinds of trial whose effects the library contains
EFFECT_OF_NUMBER = {"torque_gain": "torque_gain_error"}  # a number of the robot file, and the
# effect that is the same: a motor constant beyond its stated value is an error of the drive's gain


class Answer:
    """One diagnosis, made comparable.

    Parameters
    ----------
    diagnosis : dict
        JSON object of ``clie diagnose``.

    """

    def __init__(self, diagnosis: dict[str, Any]) -> None:
        self.failed = "error" in diagnosis
        rows: list[dict[str, Any]] = diagnosis.get("effects", [])
        self.probability: dict[str, float] = {
            row["effect"]: min(max(row["probability"], 0.0), 1.0) for row in rows}
        self.joints: dict[str, set[int]] = {
            row["effect"]: set(row["joint"] or ()) for row in rows}
        self.alike: dict[str, set[str]] = {
            row["effect"]: {row["effect"], *row.get("alike", ())} for row in rows}
        self.rank = sorted(self.probability, key=lambda name: -self.probability[name])
        self.known = [name for name in self.rank if name not in NO_EFFECTS]
        self.set_90: list[str] = diagnosis.get("set_90", [])
        self.before: float | None = diagnosis.get("gap_before")
        self.after: float | None = diagnosis.get("gap_after")
        self.seconds: float | None = diagnosis.get("seconds")
        self.decision = "failed" if self.failed else self._decision(diagnosis)
        self.confidence = self.probability.get(self.decision, 0.0)

    def _decision(self, diagnosis: dict[str, Any]) -> str:
        top = self.probability.get(self.known[0], 0.0) if self.known else 0.0
        if diagnosis["unexplained"] and top < 0.5:
            return "unknown"
        return max(self.rank, key=lambda name: self.probability[name])

    def names(self, name: str) -> set[str]:
        """A name with those that the logs do not tell from it."""
        return self.alike.get(name, {name})

    def leading(self, count: int) -> list[str]:
        """First effects of the answer, of names that are alike the most probable one."""
        first: list[str] = []
        for name in self.known:
            if not any(name in self.names(other) for other in first):
                first.append(name)
        return first[:count]

    @property
    def set_size(self) -> int:
        """Answers in the 90 % set: names that the logs do not tell apart are one."""
        return len({min(self.names(name)) for name in self.set_90})

    @property
    def order(self) -> list[str]:
        """Names in the order in which they are put forward: the decision, then the effects."""
        return [self.decision, *(name for name in self.known if name != self.decision)]


def truth_of(label: dict[str, Any]) -> set[str]:
    """Right decision on a trial: an effect, a word for its kind, or all effects of several."""
    return set(label["labels"]) if label["kind"] in IN_LIBRARY else {label["kind"]}


def effect_of_number(label: dict[str, Any]) -> set[str]:
    """The effect that is the same as a number of the robot file that is wrong, where one is."""
    if label["kind"] != "parametric":
        return set()
    return {EFFECT_OF_NUMBER[name] for name in label.get("names", label["labels"])
            if name in EFFECT_OF_NUMBER}


def is_right(label: dict[str, Any], answer: Answer) -> bool:
    """Whether the decision, or what the logs do not tell from it, is the truth or a part of it."""
    right = truth_of(label) | effect_of_number(label)
    return bool(answer.names(answer.decision) & right)


def leads(label: dict[str, Any], answer: Answer) -> bool:
    """Whether the whole truth is ranked first: the decision, or all effects of several."""
    truth = truth_of(label)
    if label["kind"] not in SEVERAL:
        return is_right(label, answer)
    return truth == {next(iter(answer.names(name) & truth), name)
                     for name in answer.leading(len(truth))}


def joints_right(label: dict[str, Any], answer: Answer) -> bool:
    """Whether the joints of the effect decided for are among those that have it.

    The words that name no effect name no joint either.
    """
    if answer.decision in NO_EFFECTS:
        return True
    true = {joint for one in label["effects"] if one["effect"] in answer.names(answer.decision)
            for joint in one["joints"]}
    named = answer.joints.get(answer.decision, set())
    return not true or (bool(named) and named <= true)
