"""Fig. 2 with the composite update law (40): the filtered robot corrects the estimates too."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from clie_blocks.diagrams.scripts.paper_experiment import run_cases
from clie_blocks.diagrams.twin_loop import twin_loop
from clie_blocks.filters import lowpass, lowpass_with_rate
from clie_blocks.identification import composite_update, filtered_regressor, identification_error
from clie_blocks.output import run_main
from clie_blocks.signals import Diagram, interconnect

if TYPE_CHECKING:
    import control as ct

# The identification error (37), (38) and the composite law (40): the same for a recorded robot.
IDENTIFIER = (
    ("filtered_regressor.dq_f", "lowpass_dq.dq_f"),
    ("filtered_regressor.u_f", "lowpass_u.u_f"),
    ("identification_error.phi_f", "filtered_regressor.phi_f"),
    ("identification_error.theta_hat", "update.theta_hat"),
    ("identification_error.y_f", "lowpass_dq.y_f"),
    ("update.e_u", "input_error.e_u"),
    ("update.phi", "regressor.phi"),
    ("update.e_f", "identification_error.e_f"),
    ("update.phi_f", "filtered_regressor.phi_f"),
    ("model.theta_hat", "update.theta_hat"))


def clie_composite(plant: ct.NonlinearIOSystem, kp: ArrayLike, kd: ArrayLike, gamma: ArrayLike,
                   alpha: float, *, omega_f: float = 300.0, velocity: str = "exact",
                   name: str = "clie_composite") -> Diagram:
    """CLIE identification of a plant with the composite update law (40).

    Inputs: q_d [rad], pe [N m], noise [rad] on the measured position.
    Outputs: those of `clie_blocks.diagrams.clie_loop.clie_loop`, and e_f [rad/s^2].

    Parameters
    ----------
    plant : control.NonlinearIOSystem
        Any plant with ports ``u -> q, dq``.
    kp, kd : array_like, shape (n,)
        PD gains of both loops [N m/rad], [N m s/rad].
    gamma : array_like, shape (), (3n,) or (3n, 3n)
        Adaptation gain of (40), positive definite.
    alpha : float
        Gain of the gradient method, not negative.
    omega_f : float
        Corner frequency of the filters G2 (34) [rad/s].
    velocity : {'exact', 'measured', 'filtered-both', 'input-error'}
        Where the velocity filter G1 (47) acts besides the filtered path, which always has it.
    name : str
        Name of the diagram.

    Returns
    -------
    clie_blocks.signals.Diagram
        The closed loop.

    """
    n = plant.ninputs
    loops = twin_loop(plant, kp, kd, velocity=velocity, sensed=True)
    return interconnect(
        [
            *loops.blocks,
            lowpass_with_rate(n, omega_f=omega_f, name="lowpass_dq"),
            lowpass(n, omega_f=omega_f, port="u", name="lowpass_u"),
            filtered_regressor(n, omega_f=omega_f, name="filtered_regressor"),
            identification_error(n, name="identification_error"),
            composite_update(gamma, alpha, kp, kd, name="update")],
        connections=[
            *loops.connections,
            # the robot filtered by G2, eqs. (34)-(36); no acceleration is measured
            ("lowpass_dq.dq", "velocity_filter.dq"),
            ("lowpass_u.u", "pd.u"),
            *IDENTIFIER],
        inputs=loops.inputs,
        outputs={**loops.outputs, "theta_hat": "update.theta_hat",
                 "e_f": "identification_error.e_f"},
        name=name)


def main(argv: Sequence[str] | None = None) -> int:
    """Run CASE 2 or 3 of the paper; see ``--help``."""
    return run_cases({2: clie_composite, 3: clie_composite}, argv, "clie_composite.py")


if __name__ == "__main__":
    run_main(main)
