"""Where the gap lies: the coloured diagram, the map, and the same ranked as a table."""

from clie_blocks.analysis.gap.report.blocks import coloured_loop
from clie_blocks.analysis.gap.report.plots import where_map
from clie_blocks.analysis.gap.report.words import number, percent, size
from clie_blocks.analysis.report.document import Picture, Section, Table

TITLE = "Where in the diagram"
RANKED = 12
LEAST = 0.1  # of the gap that has a block
EVEN = 0.25  # share of a quarter if the gap were spread evenly


def block_section(blocks):
    """The loop, each block coloured by its share of the gap."""
    if sum(row["share"] for row in blocks) < LEAST:
        return Section(TITLE, ("There is no gap to be shared out: the model agrees with the robot "
                               "down to the noise.",))
    table = Table(("share of the gap", "block"),
                  tuple((percent(row["share"]), row["block"]) for row in blocks))
    picture = Picture("diagram", coloured_loop(blocks),
                      "The loop of one joint, coloured by the share of the gap that each block "
                      "is expected to cause.")
    return Section(TITLE, (
        "Each cause gives the share of the gap that it removes to its block, weighted with its "
        "probability; wrong numbers are the joint's.",), tables=(table,), pictures=(picture,))


def map_section(where, joints, units):
    """The map by joint, time, frequency and region of operation."""
    per_joint = Table(
        ("joint", "share", "RMS error", "noise floor", "chi^2 per sample (1 is noise)"),
        tuple((row["name"], percent(row["share"]), size(row["rms"], units["q"]),
               size(row["floor"], units["q"]), number(row["chi2_per_sample"]))
              for row in where["joint"]), "By joint, all logs, refitted model without a cause.")
    ranked = Table(("share", "where"), tuple(
        (percent(share), name) for name, share in ranking(where, joints, units)[:RANKED]),
        "Where most of it lies, one kind of place at a time.")
    picture = Picture("where", where_map(where, joints, units),
                      "Share of the squared error by joint, by time in each log, by frequency, "
                      "and by quarter of position, velocity, speed and torque (an even spread "
                      f"gives {percent(EVEN)} to each quarter).")
    return Section("Where in joint, time, frequency and operation", (),
                   tables=(per_joint, ranked), pictures=(picture,))


def ranking(where, joints, units):
    """Return (place, share) pairs, largest share first."""
    found = [(f"all of {row['name']}", row["share"]) for row in where["joint"]]
    for log in where["time"]:
        step = log["seconds_per_part"]
        found += [(f"log {log['log']}, {i * step:.3g} to {(i + 1) * step:.3g} s", share)
                  for i, share in enumerate(log["share"])]
    found += [(f"{row['band_hz'][0]:g} to {row['band_hz'][1]:g} Hz", row["share"])
              for row in where["frequency"]]
    for row in where["region"]:
        for kind in ("position", "velocity", "speed", "torque"):
            found += [(f"{joints[row['joint'] - 1]}, {_quarter(kind, row[kind], i, units)}", share)
                      for i, share in enumerate(row[kind]["share"])]
    return sorted(found, key=lambda pair: -pair[1])


def _quarter(kind, quarters, i, units):
    unit = {"position": units["q"], "torque": units["u"]}.get(kind, f"{units['q']}/s")
    edges = [number(edge) for edge in quarters["edges"]]
    if i == 0:
        return f"{kind} below {edges[0]} {unit}"
    if i == len(edges):
        return f"{kind} above {edges[-1]} {unit}"
    return f"{kind} {edges[i - 1]} to {edges[i]} {unit}"
