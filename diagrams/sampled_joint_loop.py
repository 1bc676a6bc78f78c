"""Fig. 1 as a robot runs it: continuous joints, a PD law and a velocity filter in a computer."""

from collections.abc import Sequence

import control as ct
from numpy.typing import ArrayLike

from clie_blocks import paper
from clie_blocks.compiled import SampledProgram, sampled
from clie_blocks.controllers import pd_controller
from clie_blocks.diagrams.scripts.figure_script import draw_script
from clie_blocks.filters import velocity_filter
from clie_blocks.output import run_main
from clie_blocks.signals import Diagram, interconnect


def sampled_controller(kp: ArrayLike, kd: ArrayLike, period: float, *,
                       name: str = "controller") -> Diagram:
    """PD law (11) on the velocity of G1 (47), both sampled; G1 by Tustin's rule.

    Inputs: q_d, q [rad], pe [N m].  Outputs: u [N m].  State: 2 per joint, of G1.

    Parameters
    ----------
    kp, kd : array_like, shape (n,)
        PD gains [N m/rad], [N m s/rad].
    period : float
        Sample time [s].
    name : str
        Name of the diagram.

    Returns
    -------
    clie_blocks.signals.Diagram
        A discrete-time diagram.

    """
    law = pd_controller(kp, kd, name="pd")
    g_1 = ct.sample_system(velocity_filter(law.noutputs), period, "tustin", copy_names=True,
                           name="velocity_filter")
    return interconnect(
        [g_1, law], [("pd.dq", "velocity_filter.dq")],
        inputs={"q_d": "pd.q_d", "q": ["pd.q", "velocity_filter.q"], "pe": "pd.pe"},
        outputs={"u": "pd.u"}, name=name)


def sampled_joint_loop(plant: ct.NonlinearIOSystem, kp: ArrayLike, kd: ArrayLike, period: float, *,
                       name: str = "sampled_joint_loop") -> SampledProgram:
    """Joints under a sampled PD law with sample and hold, Fig. 1.

    Inputs: q_d [rad], pe [N m].  Outputs: q [rad], dq [rad/s], u [N m], held.

    Parameters
    ----------
    plant : control.NonlinearIOSystem
        Any plant in continuous time with ports ``u -> q, dq``.
    kp, kd : array_like, shape (n,)
        PD gains [N m/rad], [N m s/rad].
    period : float
        Sample time of the law [s].
    name : str
        Name of the loop.

    Returns
    -------
    clie_blocks.compiled.SampledProgram
        Compiled, for python-control cannot hold both time bases in one diagram.

    Notes
    -----
    The law acts with an average delay of half a period.  G1 starts at rest at position zero: away
    from it the first samples see a spurious velocity.

    """
    return sampled(plant, sampled_controller(kp, kd, period), name=name, wires=[
        (f"{plant.name}.u", "controller.u"), ("controller.q", f"{plant.name}.q")])


def main(argv: Sequence[str] | None = None) -> None:
    """Draw the sampled controller, the part that is a diagram of its own."""
    draw_script(
        lambda: sampled_controller(paper.KP, paper.KD, paper.STEP),
        "sampled_joint_loop",
        "Draw the sampled controller of Fig. 1: PD law and velocity filter.", argv,
        names={"pd": "PD law"})


if __name__ == "__main__":
    run_main(main)
