"""Words and figures of the scoreboard, for page and terminal alike."""

from typing import Any

HEADLINES = {
    "top_1": "single effect named right", "top_1_medium_strong": "the same, medium and strong",
    "top_1_mild": "the same, mild", "top_3": "single effect among the first three",
    "family": "right family", "joint": "right joint, where the effect is right",
    "effect_and_joint": "effect and joint right",
    "all_decisions": "all decisions right, without pairs and triples",
    "false_alarm": "false alarm on a healthy robot",
    "false_structure": "effect reported where only parameters are off",
    "parametric_named": "parameters outside tolerance reported as such",
    "unknown_detected": "effect outside the library reported as unknown",
    "unknown_called_none": "effect outside the library missed",
    "false_unknown": "known effect or none reported as unknown",
    "newcomer_named": "effect of the standard study called by another study's name",
    "pair_recall": "effects of pairs found",
    "pair_all_in_top_2": "both effects of a pair ranked first",
    "pair_top_1_is_one": "effect ranked first is one of the pair",
    "pair_all_in_set_90": "90 % set contains both effects of a pair",
    "triple_recall": "effects of triples found",
    "triple_all_in_top_3": "all effects of a triple ranked first",
    "triple_top_1_is_one": "effect ranked first is one of the triple",
    "triple_all_in_set_90": "90 % set contains all effects of a triple",
    "set_coverage": "90 % set contains the truth",
    "set_coverage_all": "the same, including pairs and triples",
    "left_out_unknown": "effect removed from the library reported as unknown",
    "left_out_unknown_medium_strong": "the same, medium and strong",
    "left_out_family": "effect removed from the library taken for another of its family",
    "left_out_none": "effect removed from the library missed"}
OUTCOMES = {
    "named": "named right", "unknown": "reported as unknown",
    "missed": "effect missed (reported healthy)",
    "accused": "false attribution to the robot",
    "accused_surely": "the same, with a probability of 50 % or more",
    "failed": "no diagnosis"}
POPULATIONS = {"controllers": "wrong description of the controller",
               "spatial": "arms that no planar chain describes"}
SLICES = {"by_size": "size (ratio to the noise floor 1.5, 4, 10)", "by_robot": "robot",
          "by_gear": "gear ratio", "by_excitation": "excitation of the fitted logs",
          "by_effect": "effect"}
TO = "\u2013\u2060"  # between two numbers, never at the end of a line
SHARE = ("%", "95 %", "of")  # heads of `rate_cells`
REACHED_WORDS = (
    "\"Yes\": the measured figure is as good as the target. \"Not shown\": it is worse, but the "
    "target lies within its interval. \"No\": even the interval does not reach the target.")


def percent(share: dict[str, Any]) -> str:
    """A rate as text, with its interval."""
    if not share["of"]:
        return "-"
    low, high = share["interval"]
    return (f"{100 * share['rate']:.0f} % ({share['hits']} of {share['of']}; "
            f"95 %: {100 * low:.0f} to {100 * high:.0f})")


def rate_cells(share: dict[str, Any]) -> tuple[str, str, str]:
    """A rate as three cells, see `SHARE`."""
    if not share["of"]:
        return "-", "-", "0"
    low, high = share["interval"]
    return (f"{100 * share['rate']:.0f}", f"{100 * low:.0f}{TO}{100 * high:.0f}",
            f"{share['hits']}/{share['of']}")


def short_rate(share: dict[str, Any]) -> str:
    """A rate in percent as short text, with its interval."""
    return "-" if not share["of"] else "{} ({})".format(*rate_cells(share)[:2])


def format_number(value: float | None) -> str:
    """A figure as text; a dash where there is none."""
    return "-" if value is None else f"{value:.3g}"


def value_with_interval(held: dict[str, Any]) -> str:
    """A figure as text, with its interval; a dash where there is none."""
    value = held["median"] if "median" in held else held["value"]
    if value is None:
        return "-"
    low, high = held["interval"]
    return f"{value:.2f} ({low:.2f} to {high:.2f})"
