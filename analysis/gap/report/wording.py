"""Words and numbers of the report."""

import numpy as np

from clie_blocks.analysis.gap.verdict.confounders import CONTACT, SOFT_STOP

CALLED = {"none": "no effect", "unknown": "something outside the library",
          "parametric": "wrong numbers in a right model"}
OF_FAMILY = {"friction": "friction of some kind", "load": "a load of some kind",
             "environment": "something from outside"}
FOREIGN = {CONTACT: "something in the robot's way", SOFT_STOP: "a soft stop"}
TOLD = 0.02  # probability of a cause whose foreign rival is told
MOST_TOLD = 3  # wrong numbers in a sentence
SURE = 0.9  # probability from which on no more is said


def effect_title(name):
    """Name of an effect for a reader: ``actuator_lag`` is 'actuator lag'."""
    return CALLED.get(name, name.replace("_", " "))


def confounded(answer):
    """Rows of the causes that something foreign would stand for as well."""
    return [row for row in answer["effects"]
            if row.get("rival") and row["probability"] >= TOLD]


def family_of(family):
    """A family of effects for a reader, where it is not known which of them it is."""
    return OF_FAMILY.get(family, f"something in the {family}")


def likely_family(answer, least):
    """Likeliest family of effects with its probability and the row of its likeliest effect.

    Parameters
    ----------
    answer : dict
        The JSON answer.
    least : float
        Probability that it must have.

    Returns
    -------
    tuple or None
        Family, probability, row; None where no family is likely, or an effect of another family
        is as likely.

    """
    found, rows = _first_family(answer, least), _of_library(answer)
    return found if found and found[2] is rows[0] else None


def _first_family(answer, least):
    from clie_blocks.effects import LIBRARY

    family, probability = next(iter(answer.get("families", {}).items()), (None, 0.0))
    if probability < least:
        return None
    return family, probability, next(row for row in _of_library(answer)
                                     if LIBRARY[row["effect"]].family == family)


def _of_library(answer):
    from clie_blocks.effects import LIBRARY

    return [row for row in answer["effects"] if row["effect"] in LIBRARY]


def family_probability(answer, row):
    """Family of an effect that is not sure, and its probability, where the family is sure.

    Parameters
    ----------
    answer : dict
        The JSON answer.
    row : dict
        The effect's, from the answer.

    Returns
    -------
    tuple or None
        What the family is called, probability.

    """
    likely = _first_family(answer, SURE)
    if likely is None or likely[2] is not row or row["probability"] >= SURE:
        return None
    return family_of(likely[0]), likely[1]


def parameter_deviations(answer, joints):
    """Numbers of the joint model beyond what the datasheet allows, in words, worst first.

    Parameters
    ----------
    answer : dict
        The JSON answer.
    joints : sequence of str
        Names.

    """
    found = []
    for name, entry in answer.get("joint_model", {}).items():
        rows = zip(joints, *(entry[key] for key in ("value", "stated", "tolerance")))
        found += [(abs(value - stated) / tolerance,
                   f"{name} at {joint} {number(value)} {entry['unit']}, stated {number(stated)}")
                  for joint, value, stated, tolerance in rows
                  if abs(value - stated) > tolerance > 0.0]
    worst = [text for _, text in sorted(found, reverse=True)]
    return worst[:MOST_TOLD] + [f"{len(worst) - MOST_TOLD} more"] * (len(worst) > MOST_TOLD)


def number(value, digits=3):
    """A number with as many digits as carry meaning; a dash where there is none."""
    if value is None or not np.isfinite(value):
        return "-"
    return f"{value:.{digits}g}"


def percent(share):
    """A share in percent, never '0' or '100' for what is neither."""
    if 0.0 < share < 0.01:
        return "< 1 %"
    if 0.99 < share < 1.0:
        return "> 99 %"
    return f"{100.0 * share:.0f} %"


def with_prefix(value, unit):
    """A small length or angle with the prefix that it is read in."""
    factor, prefixed = display_scale(value, unit)
    return f"{value * factor:.3g} {prefixed}"


def display_scale(value, unit):
    """Factor and unit, with its prefix, in which values of a size are read."""
    for factor, prefix in ((1.0, ""), (1e3, "m")):
        if abs(value) * factor >= 1.0:
            return factor, prefix + unit
    return 1e6, f"u{unit}"


def join_words(words, last="and"):
    """Join words: 'a', 'a and b', 'a, b and c'."""
    words = list(words)
    return f" {last} ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def at_joints(joints, names):
    """Say at which joints: ' at shoulder and elbow'; empty for the robot as a whole."""
    return f" at {join_words(names[k - 1] for k in joints)}" if joints else ""


def local_unit(unit, units):
    """Unit of a number for a machine that is not in rad and N m."""
    if units["u"] != "N m":
        unit = unit.replace("kg m^2", f"{units['u']} s^2/{units['q']}")
    return unit.replace("N m", units["u"]).replace("rad", units["q"])


def simulator_units(units):
    """Units of forces and inertias in a simulator: those of an axis that slides, or turns."""
    return {"force": "N", "inertia": "kg"} if units["q"] == "m" else {
        "force": "N m", "inertia": "kg m^2"}


def units_of(records):
    """Units of positions and commands; rad and N m without records."""
    if not records:
        return {"q": "rad", "u": "N m"}
    return {name: np.atleast_1d(records[0].units[name])[0] for name in ("q", "u")}
