"""Where the gap lies: by block, joint, time, frequency and operating range."""

from __future__ import annotations

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
    import control as ct
    from matplotlib.figure import Figure

TITLE = "Where in the loop"
RANKED = 12
LEAST = 0.1  # of the gap that has a block
EVEN = 0.25  # share of a quarter if the gap were spread evenly


def loop_picture(shares: Sequence[Row]) -> Figure:
    """Draw the loop of Fig. 1, the joint opened into its parts, coloured by `block_shares`.

    What no hypothesis removes is drawn as an unassigned torque, so that the colours add up.
    """
    from clie_blocks.diagrams.picture import draw

    values = {row["block"]: 100.0 * row["share"] for row in shares}
    return draw(_loop(), values=values, value_label="share of the gap [%]",
                columns=[[name] for name in ("controller", "drive", "joint", "gear", "links",
                                             "encoder")])


def _loop() -> ct.InterconnectedSystem:
    from clie_blocks.signals import interconnect

    blocks = [_block("controller", ("q_d", "pe", "q_seen"), "u"), _block("drive", ("u",), "tau"),
              _block("joint", ("tau", "tau_gear", "tau_else"), "q_motor"),
              _block("unassigned", (), "tau_else"),
              _block("gear", ("q_motor", "q"), "tau_gear"), _block("links", ("tau_gear",), "q"),
              _block("encoder", ("q",), "q_seen")]
    wires = (("drive.u", "controller.u"), ("joint.tau", "drive.tau"),
             ("joint.tau_else", "unassigned.tau_else"),
             ("joint.tau_gear", "gear.tau_gear"), ("gear.q_motor", "joint.q_motor"),
             ("gear.q", "links.q"), ("links.tau_gear", "gear.tau_gear"),
             ("encoder.q", "links.q"), ("controller.q_seen", "encoder.q_seen"))
    return interconnect(blocks, name="robot", connections=list(wires),
                        inputs={"q_d": "controller.q_d", "pe": "controller.pe"},
                        outputs={"q": "encoder.q_seen"})


def _block(name: str, inputs: tuple[str, ...], output: str) -> ct.NonlinearIOSystem:
    """Block of the drawing: it shows where signals go, and is never run."""
    import control as ct

    from clie_blocks.signals import signals

    return ct.nlsys(lambda t, x, u, params: -x, lambda t, x, u, params: x, states=1, name=name,
                    inputs=signals(*inputs, n=1), outputs=signals(output, n=1))


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
