"""Fig. 5: feedback linearisation with the estimated parameters, eq. (50)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks import paper
from clie_blocks.controllers import linearizing_controller
from clie_blocks.diagrams.scripts.figure_script import draw_script
from clie_blocks.output import run_main
from clie_blocks.signals import Diagram, interconnect

if TYPE_CHECKING:
    import control as ct


def feedback_linearization(plant: ct.NonlinearIOSystem, theta_hat: ArrayLike, kp: ArrayLike,
                           kd: ArrayLike, *, printed_sign: bool = False,
                           name: str = "feedback_linearization") -> Diagram:
    """Tracking with feedback linearisation, Fig. 5, eqs. (9) and (50).

    Inputs: q_d, dq_d, ddq_d [rad, rad/s, rad/s^2].  Outputs: q [rad], dq [rad/s], u [N m].

    Parameters
    ----------
    plant : control.NonlinearIOSystem
        Any plant with ports ``u -> q, dq``.
    theta_hat : array_like, shape (3n,)
        Estimates ``[a_hat, b_hat, d_hat]``.
    kp, kd : array_like, shape (n,)
        Gains of the error dynamics [1/s^2], [1/s].
    printed_sign : bool
        Use ``-d_hat`` as printed, which doubles D instead of cancelling it.
    name : str
        Name of the diagram.

    Returns
    -------
    clie_blocks.signals.Diagram
        The closed loop.

    """
    n = plant.ninputs
    a, b, d = (np.ravel(theta_hat)[k * n:(k + 1) * n] for k in range(3))
    controller = linearizing_controller(a, b, d, kp, kd, printed_sign=printed_sign)
    return interconnect(
        [controller, plant], name=name,
        connections=[
            (f"{plant.name}.u", "controller.u"),
            ("controller.q", f"{plant.name}.q"),
            ("controller.dq", f"{plant.name}.dq")],
        inputs={port: f"controller.{port}" for port in ("q_d", "dq_d", "ddq_d")},
        outputs={"q": f"{plant.name}.q", "dq": f"{plant.name}.dq", "u": "controller.u"})


def main(argv: Sequence[str] | None = None) -> None:
    """Draw the loop with the estimates of CASE 1."""
    draw_script(
        lambda: feedback_linearization(paper.paper_arm(), paper.THETA_HAT[1], paper.KP, paper.KD),
        "feedback_linearization",
        "Draw Fig. 5: feedback linearisation with the estimated parameters.", argv,
        names={"plant": "robot", "controller": "controller (50)"})


if __name__ == "__main__":
    run_main(main)
