"""Fig. 1: each robot joint in closed loop with a PD controller."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from clie_blocks import paper
from clie_blocks.controllers import pd_controller
from clie_blocks.diagrams.scripts.figure_script import draw_script
from clie_blocks.output import run_main
from clie_blocks.signals import Diagram, interconnect

if TYPE_CHECKING:
    import control as ct


def joint_loop(plant: ct.NonlinearIOSystem, kp: ArrayLike, kd: ArrayLike, *,
               name: str = "joint_loop") -> Diagram:
    """Joints under PD control with excitation, Fig. 1, eqs. (8) or (9) with (11).

    Inputs: q_d [rad], pe [N m].  Outputs: q [rad], dq [rad/s], u [N m].

    Parameters
    ----------
    plant : control.NonlinearIOSystem
        Any plant with ports ``u -> q, dq``.
    kp, kd : array_like, shape (n,)
        PD gains [N m/rad], [N m s/rad].
    name : str
        Name of the diagram.

    Returns
    -------
    clie_blocks.signals.Diagram
        The closed loop.

    """
    return interconnect(
        [pd_controller(kp, kd, name="pd"), plant], name=name,
        connections=[
            (f"{plant.name}.u", "pd.u"),
            ("pd.q", f"{plant.name}.q"),
            ("pd.dq", f"{plant.name}.dq")],
        inputs={"q_d": "pd.q_d", "pe": "pd.pe"},
        outputs={"q": f"{plant.name}.q", "dq": f"{plant.name}.dq", "u": "pd.u"})


def main(argv: Sequence[str] | None = None) -> None:
    """Draw the loop of the paper's arm."""
    draw_script(
        lambda: joint_loop(paper.paper_arm(), paper.KP, paper.KD),
        "joint_loop", "Draw Fig. 1: each joint in closed loop with a PD controller.", argv,
        names={"pd": "PD controller", "plant": "robot"})


if __name__ == "__main__":
    run_main(main)
