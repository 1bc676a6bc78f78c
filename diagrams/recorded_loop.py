"""Fig. 2 with a recorded robot in place of plant and PD: CLIE on a log of a real machine.

A recorded controller is sampled: it computes its command from samples and holds it.  The model's
half of the figure is therefore sampled at the same period, with the same velocity estimate.  (A
continuous PD law on held samples sees a sawtooth of ``Kp dq period``, on the EMPS machine
three times the signal itself.)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from clie_blocks.controllers import pd_controller
from clie_blocks.diagrams.scripts.figure_script import draw_script
from clie_blocks.filters import difference_filter
from clie_blocks.identification import gradient_update, regressor
from clie_blocks.joints import estimated_model
from clie_blocks.output import run_main
from clie_blocks.signals import Diagram, interconnect, summing

if TYPE_CHECKING:
    import control as ct

NAMES = {"pd_model": "PD controller", "model": "estimated model", "update": "update law"}


def recorded_loop(kp: ArrayLike, kd: ArrayLike, gamma: ArrayLike, velocity: ct.StateSpace, *,
                  name: str = "recorded_loop") -> Diagram:
    """Model half of Fig. 2 against a recorded robot, with the update law (27).

    Inputs: u, pe [N m], q_d [rad], one recorded row per sample.
    Outputs: q_model [rad], dq_model [rad/s], u_model, e_u [N m], theta_hat.

    Parameters
    ----------
    kp, kd : array_like, shape (n,)
        PD gains of the recorded controller [N m/rad], [N m s/rad].
    gamma : array_like, shape (), (3n,) or (3n, 3n)
        Adaptation gain of (27), positive definite; see
        `clie_blocks.identification.scaled_gain`.
    velocity : control.StateSpace
        The recorded controller's velocity estimate, discrete-time, with ports ``q -> dq``; its
        sample time is that of the diagram.
    name : str
        Name of the diagram.

    Returns
    -------
    clie_blocks.signals.Diagram
        A discrete-time diagram; start ``model`` and ``velocity`` at the first recorded position.

    """
    half = model_half(kp, kd, velocity)
    update = gradient_update(gamma, kp, kd, period=velocity.dt, name="update")
    return interconnect(
        [*half["blocks"], update],
        connections=[
            *half["connections"],
            # the update law, eq. (27)
            ("update.e_u", "input_error.e_u"),
            ("update.phi", "regressor.phi"),
            ("model.theta_hat", "update.theta_hat")],
        inputs=half["inputs"], outputs={**half["outputs"], "theta_hat": "update.theta_hat"},
        name=name)


def model_half(kp: ArrayLike, kd: ArrayLike, velocity: ct.StateSpace) -> dict[str, Any]:
    """Sampled model under its PD law, and its input error against the recorded input.

    Returns ``blocks``, ``connections``, ``inputs``, ``outputs``, to which an identifier is added.
    """
    n = velocity.ninputs
    return {
        "blocks": [
            pd_controller(kp, kd, name="pd_model"), velocity,
            estimated_model(n, period=velocity.dt, name="model"),
            summing("u_model", "-u", output="e_u", n=n, name="input_error"),
            regressor(n, name="regressor")],
        "connections": [
            # the estimated model under the recorded PD law, eqs. (19), (20)
            ("model.u", "pd_model.u"),
            ("pd_model.q", "model.q"),
            (f"{velocity.name}.q", "model.q"), ("pd_model.dq", f"{velocity.name}.dq"),
            # the input error, eq. (26), and the noise-free regressor, eq. (22)
            ("input_error.u_model", "pd_model.u"),
            ("regressor.dq", "model.dq"), ("regressor.u", "pd_model.u")],
        "inputs": {"u": "input_error.u", "q_d": "pd_model.q_d", "pe": "pd_model.pe"},
        "outputs": {"q_model": "model.q", "dq_model": "model.dq", "u_model": "pd_model.u",
                    "e_u": "input_error.e_u"}}


def main(argv: Sequence[str] | None = None) -> None:
    """Draw the diagram for one joint; ``clie identify`` runs it on a log."""
    draw_script(
        lambda: recorded_loop(40.0, 5.0, 20.0, difference_filter(1, 1e-3, name="velocity")),
        "recorded_loop", "Draw Fig. 2 with a recorded robot in place of plant and PD.", argv,
        names=NAMES, epilog="'clie identify LOG' runs it on the log of a real machine.")


if __name__ == "__main__":
    run_main(main)
