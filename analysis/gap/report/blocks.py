"""The gap by block of the loop, and the loop drawn with each block coloured by its share."""

import numpy as np

from clie_blocks.analysis.gap.evidence import excess
from clie_blocks.analysis.gap.paths import CERTAIN
from clie_blocks.analysis.gap.verdict import NONE, PARAMETRIC, marginals

OF_PORT = {"drive": "drive", "load": "joint", "friction": "joint", "body": "links",
           "transmission": "gear", "sensor": "encoder"}
BLOCKS = ("controller", "drive", "gear", "joint", "links", "encoder")


def block_shares(diagnosis):
    """Share of the gap that each block of the loop is expected to cause.

    Each hypothesis gives the share of chi^2 beyond the noise that it removes to the blocks where
    its causes act, weighted with its probability; what no hypothesis removes has no block.  Wrong
    numbers are the joint's, and where there is no gap nothing is shared out.  Goals are late
    before the controller has them.

    Parameters
    ----------
    diagnosis : Diagnosis
        From `diagnose`.

    Returns
    -------
    list of dict
        ``block`` and ``share``, largest first; ``unassigned`` last.

    """
    shares = dict.fromkeys(BLOCKS, 0.0)
    whole = max(excess(diagnosis.base), 1e-9)
    told = marginals(diagnosis.ranking)
    shares["joint"], sound = told.get(PARAMETRIC, 0.0), told.get(NONE, 0.0)
    for standing in diagnosis.ranking:
        members = standing.fit.hypothesis.members if standing.fit is not None else ()
        removed = np.clip(1.0 - max(standing.excess, 0.0) / whole, 0.0, 1.0)
        for member in members:
            block = OF_PORT[member.cause.pieces[0].port]
            shares[block] += standing.probability * removed / len(members)
    for cause in diagnosis.paths:
        shares = {block: (1.0 - cause.share) * share for block, share in shares.items()}
        shares["controller"] += cause.share
    if diagnosis.check.misdescribed or diagnosis.check.coarse:
        guilty = "controller" if diagnosis.check.misdescribed else "encoder"
        shares = {block: (1.0 - CERTAIN) * share for block, share in shares.items()}
        shares[guilty] += CERTAIN
    left = {"block": "unassigned", "share": max(0.0, 1.0 - sound - sum(shares.values()))}
    rows = [{"block": block, "share": float(share)} for block, share in shares.items()]
    return [*sorted(rows, key=lambda row: -row["share"]), left]


def coloured_loop(shares):
    """Draw the loop of Fig. 1, the joint opened into its parts, coloured by share of the gap.

    What no hypothesis removes is drawn as a torque from elsewhere, so that the colours add up.

    Parameters
    ----------
    shares : list of dict
        From `block_shares`.

    """
    from clie_blocks.diagrams.picture import draw

    values = {row["block"]: 100.0 * row["share"] for row in shares}
    return draw(_loop(), values=values, value_label="share of the gap [%]")


def _loop():
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


def _block(name, inputs, output):
    """Block of the drawing: it shows where signals go, and is never run."""
    import control as ct

    from clie_blocks.signals import signals

    return ct.nlsys(lambda t, x, u, params: -x, lambda t, x, u, params: x, states=1, name=name,
                    inputs=signals(*inputs, n=1), outputs=signals(output, n=1))
