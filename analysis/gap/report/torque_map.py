"""What the model leaves and every lap repeats: the table of torque, drawn."""

from clie_blocks.analysis.gap.report.plots import AFTER, BEFORE, PANELS, plain
from clie_blocks.analysis.gap.report.wording import effect_title, join_words, number, with_prefix
from clie_blocks.analysis.report.document import Picture, Section

BAND = 0.25  # opacity


def torque_map_section(diagnosis, answer, units):
    """The table over place and speed; None where it does not pay."""
    told = answer.get("repeatable")
    if told is None:
        return None
    interval = "" if told["interval"] is None else (
        f" ({number(told['interval'][0])} .. {number(told['interval'][1])})")
    beside = join_words(map(effect_title, told["beside"])) or "the refitted model without any cause"
    text = (f"A table of torque over place and speed, one for each direction, removes "
            f"{number(told['percent'])} %{interval} of the reducible gap that {beside} leaves on "
            f"unseen data, down to {with_prefix(told['gap'], units['q'])}: what is left comes back along "
            "the travel. The table names no cause and changes no verdict; a simulator can hold it "
            "beside that model. Its numbers are in the JSON answer.")
    picture = Picture("torque-table", curves(diagnosis, units),
                      "Torque against the motion, beside that of the model. Left over place, "
                      "with mean zero; right over speed, with the level. Bands: 95 %, from "
                      "tables that leave parts of the logs out.")
    return Section("What is left repeats", (text,), pictures=(picture,))


def curves(diagnosis, units):
    """Torque over place and over speed at each joint, in both directions."""
    from matplotlib.figure import Figure

    tables = diagnosis.repeatable.joints[:PANELS]
    figure = Figure(figsize=(9, 3.2 * len(tables)), layout="constrained")
    axes = figure.subplots(len(tables), 2, squeeze=False)
    for table, (over_place, over_speed) in zip(tables, axes):
        name = plain(diagnosis.problem.joints[table.joint])
        _draw(over_place, table.places, table.over_place, table.place_spread)
        _draw(over_speed, table.speeds, table.over_speed, table.speed_spread)
        over_place.set(xlabel=f"{name}: position [{units['q']}]", ylabel=f"[{units['u']}]")
        over_speed.set(xlabel=f"{name}: speed [{units['q']}/s]")
    axes[0, 0].legend(frameon=False, fontsize=8)
    return figure


def _draw(ax, knots, torques, spreads):
    for torque, spread, color, label in zip(torques, spreads, (AFTER, BEFORE),
                                            ("forward", "backward")):
        ax.plot(knots, torque, color=color, lw=1.4, label=label)
        ax.fill_between(knots, torque - spread, torque + spread, color=color, alpha=BAND, lw=0)
    ax.axhline(0.0, color="#8a94a0", lw=0.7)
    ax.grid(alpha=0.3)
