"""Fig. 2 with the update law (27): robot and model under one PD law, compared by their inputs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from clie_blocks.diagrams.clie_composite import clie_composite
from clie_blocks.diagrams.scripts.paper_experiment import Builder, run_cases
from clie_blocks.diagrams.twin_loop import twin_loop
from clie_blocks.identification import gradient_update
from clie_blocks.output import run_main
from clie_blocks.signals import Diagram, interconnect

if TYPE_CHECKING:
    import control as ct


def clie_loop(plant: ct.NonlinearIOSystem, kp: ArrayLike, kd: ArrayLike, gamma: ArrayLike, *,
              velocity: str = "exact", name: str = "clie_loop") -> Diagram:
    """CLIE identification of a plant with the update law (27), Fig. 2.

    Inputs: q_d [rad], pe [N m]; and noise [rad] unless `velocity` is ``'exact'``.
    Outputs: q, q_model [rad], dq, dq_model [rad/s], u, u_model, e_u [N m], theta_hat
    ``[a_hat, b_hat, d_hat]``.

    Parameters
    ----------
    plant : control.NonlinearIOSystem
        Any plant with ports ``u -> q, dq``.
    kp, kd : array_like, shape (n,)
        PD gains of both loops [N m/rad], [N m s/rad].
    gamma : array_like, shape (), (3n,) or (3n, 3n)
        Adaptation gain of (27), positive definite.
    velocity : {'exact', 'measured', 'filtered-both', 'input-error'}
        Where the velocity filter G1 (47) acts; the paper leaves it open.
    name : str
        Name of the diagram.

    Returns
    -------
    clie_blocks.signals.Diagram
        The closed loop.

    Notes
    -----
    G1 in only one of the two loops (``'measured'``, ``'input-error'``) biases A by 16 % through
    its delay alone, without any noise.

    """
    loops = twin_loop(plant, kp, kd, velocity=velocity)
    return interconnect(
        [*loops.blocks, gradient_update(gamma, kp, kd, name="update")],
        connections=[
            *loops.connections,
            # the update law, eq. (27), closes Fig. 2
            ("update.e_u", "input_error.e_u"),
            ("update.phi", "regressor.phi"),
            ("model.theta_hat", "update.theta_hat")],
        inputs=loops.inputs, outputs={**loops.outputs, "theta_hat": "update.theta_hat"}, name=name)


CASES: dict[int, Builder] = {1: clie_loop, 2: clie_composite, 3: clie_composite}  # Table 1


def main(argv: Sequence[str] | None = None) -> int:
    """Run the paper's identification; see ``--help``."""
    return run_cases(CASES, argv, "clie_loop.py")


if __name__ == "__main__":
    run_main(main)
