"""Fig. 2 with a recorded robot and the composite update law (40)."""

from collections.abc import Sequence

import control as ct
from numpy.typing import ArrayLike

from clie_blocks.diagrams.clie_composite import IDENTIFIER
from clie_blocks.diagrams.recorded_loop import NAMES, model_half
from clie_blocks.diagrams.scripts.figure_script import draw_script
from clie_blocks.filters import (
    difference_filter,
    lowpass,
    lowpass_with_rate,
    velocity_filter,
)
from clie_blocks.identification import composite_update, filtered_regressor, identification_error
from clie_blocks.output import run_main
from clie_blocks.signals import Diagram, interconnect


def recorded_composite(kp: ArrayLike, kd: ArrayLike, gamma: ArrayLike, alpha: float,
                       velocity: ct.StateSpace, *, omega_f: float = 300.0,
                       name: str = "recorded_composite") -> Diagram:
    """Model half of Fig. 2 against a recorded robot, with the composite law (40).

    Inputs: u, pe [N m], q_d, q [rad], one recorded row per sample.
    Outputs: as `clie_blocks.diagrams.recorded_loop.recorded_loop`, and e_f [rad/s^2].

    Parameters
    ----------
    kp, kd : array_like, shape (n,)
        PD gains of the recorded controller [N m/rad], [N m s/rad].
    gamma : array_like, shape (), (3n,) or (3n, 3n)
        Adaptation gain of (40), positive definite.
    alpha : float
        Gain of the gradient method, not negative.
    velocity : control.StateSpace
        The recorded controller's velocity estimate, discrete-time, with ports ``q -> dq``.
    omega_f : float
        Corner frequency of G2 (34) [rad/s]; the filters are sampled by Tustin's rule.
    name : str
        Name of the diagram.

    Returns
    -------
    clie_blocks.signals.Diagram
        A discrete-time diagram.

    Notes
    -----
    u passes G2 but q passes G1 and G2, as in the paper: the delay of G1 biases the estimates.

    """
    half = model_half(kp, kd, velocity)
    n, period = velocity.ninputs, velocity.dt

    def sampled(block: ct.StateSpace) -> ct.StateSpace:
        return ct.sample_system(block, period, "tustin", name=block.name)

    return interconnect(
        [
            *half["blocks"], sampled(velocity_filter(n, name="measured_velocity")),
            sampled(lowpass_with_rate(n, omega_f=omega_f, name="lowpass_dq")),
            sampled(lowpass(n, omega_f=omega_f, port="u", name="lowpass_u")),
            filtered_regressor(n, omega_f=omega_f), identification_error(n),
            composite_update(gamma, alpha, kp, kd, period=period, name="update")],
        connections=[
            *half["connections"],
            # the recorded robot filtered by G1 and G2, eqs. (34)-(36)
            ("lowpass_dq.dq", "measured_velocity.dq"),
            *IDENTIFIER],
        inputs={**half["inputs"], "u": ["input_error.u", "lowpass_u.u"],
                "q": "measured_velocity.q"},
        outputs={**half["outputs"], "theta_hat": "update.theta_hat",
                 "e_f": "identification_error.e_f"},
        name=name)


def main(argv: Sequence[str] | None = None) -> None:
    """Draw the diagram for one joint."""
    draw_script(
        lambda: recorded_composite(40.0, 5.0, 20.0, 1e-3,
                                   difference_filter(1, 1e-3, name="velocity")),
        "recorded_composite",
        "Draw Fig. 2 with a recorded robot and the composite law (40).", argv,
        names=NAMES)


if __name__ == "__main__":
    run_main(main)
