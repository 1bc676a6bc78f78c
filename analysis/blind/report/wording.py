"""Words and figures of the scoreboard, for page and terminal alike."""

HEADLINES = {
    "top_1": "single effect named right", "top_1_medium_strong": "the same, medium and strong",
    "top_1_mild": "the same, mild", "top_3": "single effect among the first three",
    "family": "right family", "joint": "right joint, effect found",
    "effect_and_joint": "effect and joint right",
    "all_decisions": "all decided right but pairs and triples",
    "false_alarm": "false alarm on a healthy robot",
    "false_structure": "effect claimed where only numbers are off",
    "parametric_named": "numbers beyond the datasheet called so",
    "unknown_detected": "effect outside the library called unknown",
    "unknown_called_none": "effect outside the library missed",
    "false_unknown": "known or nothing called unknown",
    "pair_recall": "members of pairs found", "pair_all_in_top_2": "both of a pair lead",
    "pair_top_1_is_one": "leader of a pair is one of the two",
    "pair_all_in_set_90": "90 % set holds both of a pair",
    "triple_recall": "members of triples found", "triple_all_in_top_3": "all of a triple lead",
    "triple_top_1_is_one": "leader of a triple is one of the three",
    "triple_all_in_set_90": "90 % set holds all of a triple",
    "set_coverage": "90 % set holds the truth",
    "set_coverage_all": "the same, pairs and triples included",
    "left_out_unknown": "effect taken out of the library called unknown",
    "left_out_unknown_medium_strong": "the same, medium and strong",
    "left_out_family": "effect taken out of the library taken for its family",
    "left_out_none": "effect taken out of the library missed"}
OUTCOMES = {
    "named": "named right", "unknown": "called unknown, no more said",
    "missed": "taken for a sound robot with a true file",
    "accused": "a robot effect accused that is not there",
    "accused_surely": "the same, stated with one half or more",
    "failed": "no diagnosis"}
FAMILIES = {"controllers": "controllers described wrong",
            "spatial": "arms that no planar chain describes"}
SLICES = {"by_size": "size (ratio to the noise floor 1.5, 4, 10)", "by_robot": "robot",
          "by_gear": "gear ratio", "by_excitation": "excitation of the fitted logs",
          "by_effect": "effect"}
TO = "\u2013\u2060"  # between two numbers, never at the end of a line
SHARE = ("%", "95 %", "of")  # heads of `cells`
REACHED_WORDS = (
    "\"Yes\": the measured figure is as good as the target. \"Not shown\": it is worse, but the "
    "target lies within its interval. \"No\": even the interval does not reach the target.")


def percent(share):
    """A rate as text, with its interval."""
    if not share["of"]:
        return "-"
    low, high = share["interval"]
    return (f"{100 * share['rate']:.0f} % ({share['hits']} of {share['of']}; "
            f"95 %: {100 * low:.0f} to {100 * high:.0f})")


def cells(share):
    """A rate as three cells, see `SHARE`."""
    if not share["of"]:
        return "-", "-", "0"
    low, high = share["interval"]
    return (f"{100 * share['rate']:.0f}", f"{100 * low:.0f}{TO}{100 * high:.0f}",
            f"{share['hits']}/{share['of']}")


def short(share):
    """A rate in percent as short text, with its interval."""
    return "-" if not share["of"] else "{} ({})".format(*cells(share)[:2])


def number(value):
    """A figure as text; a dash where there is none."""
    return "-" if value is None else f"{value:.3g}"


def with_interval(held):
    """A figure as text, with its interval; a dash where there is none."""
    value = held["median"] if "median" in held else held["value"]
    if value is None:
        return "-"
    low, high = held["interval"]
    return f"{value:.2f} ({low:.2f} to {high:.2f})"
