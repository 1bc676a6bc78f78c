"""Where the gap lies: by block, joint, time, frequency and operating range."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from clie_blocks.analysis.gap.report.plots import where_map
from clie_blocks.analysis.gap.report.wording import (
    Row,
    Units,
    effort,
    number,
    percent,
    with_prefix,
)
from clie_blocks.analysis.report.document import Picture, Section, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from clie_blocks.diagrams.drawing.plan import Layout

TITLE = "Where in the loop"
RANKED = 12
LEAST = 0.1  # of the gap that has a block
EVEN = 0.25  # share of a quarter if the gap were spread evenly
# What each block of the picture takes and gives; a wire joins equal names.
PARTS = {"controller": (("q_d", "pe", "q_seen"), "u"), "drive": (("u",), "tau"),
         "joint": (("tau", "tau_gear", "tau_else"), "q_motor"), "unassigned": ((), "tau_else"),
         "gear": (("q_motor", "q"), "tau_gear"), "links": (("tau_gear",), "q"),
         "encoder": (("q",), "q_seen")}


def loop_picture(shares: Sequence[Row]) -> Figure:
    """Draw the loop of Fig. 1, the joint opened into its parts, coloured by `block_shares`.

    What no hypothesis removes is drawn as an unassigned torque, so that the colours add up.
    """
    from clie_blocks.diagrams.picture import picture_of

    values = {row["block"]: 100.0 * row["share"] for row in shares}
    return picture_of(_plan(), "robot", values=values, value_label="share of the gap [%]")


@functools.cache
def _plan() -> Layout:
    """Plan of the picture, which only the colours change."""
    from clie_blocks.diagrams.drawing.graph import Block, Graph, Wire
    from clie_blocks.diagrams.drawing.hints import hints_of
    from clie_blocks.diagrams.drawing.layout import plan_of

    blocks = [*(Block(f">{name}", name, "input", outputs=(name,)) for name in ("q_d", "pe")),
              *(Block(name, name, "block", inputs, (output,))
                for name, (inputs, output) in PARTS.items()),
              Block("q>", "q", "output", inputs=("q_seen",))]
    source = {port: (block.key, port) for block in blocks for port in block.outputs}
    wires = [Wire(source[port], (block.key, port), 1) for block in blocks for port in block.inputs]
    columns = [[name] for name in PARTS if name != "unassigned"]
    return plan_of(Graph("robot", {block.key: block for block in blocks}, wires),
                   hints_of(None, columns, ()))


def block_section(blocks: Sequence[Row]) -> Section:
    """The loop, each block coloured by its share of the gap."""
    if sum(row["share"] for row in blocks) < LEAST:
        return Section(TITLE, ("There is no gap to assign: the model agrees with the robot down "
                               "to the sensor noise.",))
    table = Table(("share of the gap", "block"), tuple(
        (percent(row["share"]), row["block"]) for row in blocks if row["share"] > 0.0))
    picture = Picture("diagram", loop_picture(blocks),
                      "The loop of one joint, coloured by the share of the gap that each block "
                      "is expected to cause.")
    return Section(TITLE, (
        "The share of the gap that a cause removes is assigned to its block, weighted with the "
        "probability of the cause; parameter errors are attributed to the joint. Blocks without a "
        "share are not listed.",),
        tables=(table,), pictures=(picture,))


def map_section(where: Mapping[str, Any], joints: Sequence[str], units: Units) -> Section:
    """The map by joint, time, frequency and operating range."""
    per_joint = Table(
        ("joint", "share", "RMS error", "noise floor", "chi^2 per sample (1 is noise)"),
        tuple((row["name"], percent(row["share"]), with_prefix(row["rms"], units["q"]),
               with_prefix(row["floor"], units["q"]), number(row["chi2_per_sample"]))
              for row in where["joint"]),
        "By joint, over all logs.")
    ranked = Table(("share", "where"), tuple(
        (percent(share), name) for name, share in ranked_shares(where, joints, units)[:RANKED]),
        "Where most of it lies; each kind of range adds up to 100 %.")
    picture = Picture("where", where_map(where, joints, units),
                      "Shares by joint, by time in each log, by frequency, and by quarter of "
                      "position, velocity, speed and torque (an even spread gives "
                      f"{percent(EVEN)} to each quarter).")
    return Section("Where by joint, time, frequency and operating range", (
        "Shares of the squared prediction error of the refitted nominal model, less what sensor "
        "noise alone leaves.",), tables=(per_joint, ranked), pictures=(picture,))


def ranked_shares(where: Mapping[str, Any], joints: Sequence[str], units: Units
                  ) -> list[tuple[str, float]]:
    """Return (range, share) pairs, largest share first."""
    shares = [(f"all of {row['name']}", row["share"]) for row in where["joint"]
              if len(where["joint"]) > 1]
    for log in where["time"]:
        step = log["seconds_per_part"]
        shares += [(f"log {log['log']}, {i * step:.3g} to {(i + 1) * step:.3g} s", share)
                   for i, share in enumerate(log["share"])]
    shares += [(f"{row['band_hz'][0]:g} to {row['band_hz'][1]:g} Hz", row["share"])
              for row in where["frequency"]]
    for row in where["region"]:
        for kind in ("position", "velocity", "speed", "torque"):
            name = joints[row["joint"] - 1]
            shares += [(f"{name}, {_quarter(kind, row[kind], i, units)}", share)
                       for i, share in enumerate(row[kind]["share"])]
    return sorted(shares, key=lambda pair: -pair[1])


def _quarter(kind: str, quarters: Mapping[str, Any], i: int, units: Units) -> str:
    unit = {"position": units["q"], "torque": units["u"]}.get(kind, f"{units['q']}/s")
    kind = effort(units) if kind == "torque" else kind
    edges = [number(edge) for edge in quarters["edges"]]
    if i == 0:
        return f"{kind} below {edges[0]} {unit}"
    if i == len(edges):
        return f"{kind} above {edges[-1]} {unit}"
    return f"{kind} {edges[i - 1]} to {edges[i]} {unit}"
