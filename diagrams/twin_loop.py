"""Fig. 2 without its identifier: the robot and its model under the same PD law, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from clie_blocks import paper
from clie_blocks.controllers import pd_controller
from clie_blocks.diagrams.scripts.figure_script import draw_script
from clie_blocks.filters import velocity_filter
from clie_blocks.identification import regressor
from clie_blocks.joints import estimated_model
from clie_blocks.measurement import noisy_measurement
from clie_blocks.output import run_main
from clie_blocks.signals import Diagram, DiagramError, interconnect, nearest, summing

if TYPE_CHECKING:
    import control as ct

# Where the velocity filter G1 (47) acts; the paper does not say.
READINGS = {
    "exact": "both PD laws see exact positions and velocities",
    "measured": "the robot's PD sees the noisy position, and its velocity through G1",
    "filtered-both": "as 'measured', and the model's PD sees its velocity through G1 too",
    "input-error": "both PD laws are exact, but the input error uses the robot's input as it "
                   "follows from the noisy position and G1",
}


@dataclass(frozen=True)
class TwinLoop:
    """Blocks, connections and diagram ports, to which an identifier is added."""

    blocks: list[ct.NonlinearIOSystem]
    connections: list[tuple[str, ...]]
    inputs: dict[str, list[str]]
    outputs: dict[str, str]


def twin_loop(plant: ct.NonlinearIOSystem, kp: ArrayLike, kd: ArrayLike, *,
              velocity: str = "exact", sensed: bool = False) -> TwinLoop:
    """Robot and model under the same PD law, eqs. (9)-(11), (19)-(22), (26).

    Parameters
    ----------
    plant : control.NonlinearIOSystem
        Any plant with ports ``u -> q, dq``.
    kp, kd : array_like, shape (n,)
        PD gains of both loops [N m/rad], [N m s/rad].
    velocity : str
        A key of `READINGS`.
    sensed : bool
        Include the measured position and its velocity through G1 even if no PD law uses them.

    Returns
    -------
    TwinLoop
        Its port ``model.theta_hat`` waits for an identifier.

    Raises
    ------
    DiagramError
        If there is no such reading.

    """
    if velocity not in READINGS:
        raise DiagramError(f"no velocity reading {velocity!r}; {nearest(velocity, READINGS)}")
    n, robot = plant.ninputs, plant.name
    core = TwinLoop(
        blocks=[
            pd_controller(kp, kd, name="pd"), plant,
            pd_controller(kp, kd, name="pd_model"), estimated_model(n, name="model"),
            summing("u_model", "-u", output="e_u", n=n, name="input_error"),
            regressor(n, name="regressor")],
        connections=[
            # the robot, eqs. (9), (11)
            (f"{robot}.u", "pd.u"),
            # the estimated model under the same law, eqs. (19), (20)
            ("model.u", "pd_model.u"),
            ("pd_model.q", "model.q"),
            # the input error, eq. (26), and the noise-free regressor, eq. (22)
            ("input_error.u_model", "pd_model.u"),
            ("regressor.dq", "model.dq"), ("regressor.u", "pd_model.u")],
        inputs={"q_d": ["pd.q_d", "pd_model.q_d"], "pe": ["pd.pe", "pd_model.pe"]},
        outputs={"q": f"{robot}.q", "dq": f"{robot}.dq", "u": "pd.u", "q_model": "model.q",
                 "dq_model": "model.dq", "u_model": "pd_model.u", "e_u": "input_error.e_u"})
    if sensed or velocity != "exact":
        _sense_position(core, robot, n)
    _close_robot(core, robot, velocity)
    _close_model(core, velocity, n)
    _compare_inputs(core, velocity, kp, kd)
    return core


def _sense_position(core: TwinLoop, robot: str, n: int) -> None:
    """Noisy position, and its velocity through G1 (47)."""
    core.blocks.extend([noisy_measurement(n, name="measured"),
                        velocity_filter(n, name="velocity_filter")])
    core.connections.extend([("measured.q", f"{robot}.q"),
                             ("velocity_filter.q", "measured.q_measured")])
    core.inputs["noise"] = ["measured.noise"]


def _close_robot(core: TwinLoop, robot: str, velocity: str) -> None:
    if velocity in ("measured", "filtered-both"):
        core.connections.extend([("pd.q", "measured.q_measured"), ("pd.dq", "velocity_filter.dq")])
    else:
        core.connections.extend([("pd.q", f"{robot}.q"), ("pd.dq", f"{robot}.dq")])


def _close_model(core: TwinLoop, velocity: str, n: int) -> None:
    if velocity == "filtered-both":
        core.blocks.append(velocity_filter(n, name="velocity_filter_model"))
        core.connections.extend([("velocity_filter_model.q", "model.q"),
                                 ("pd_model.dq", "velocity_filter_model.dq")])
    else:
        core.connections.append(("pd_model.dq", "model.dq"))


def _compare_inputs(core: TwinLoop, velocity: str, kp: ArrayLike, kd: ArrayLike) -> None:
    if velocity == "input-error":
        core.blocks.append(pd_controller(kp, kd, name="pd_measured"))
        core.connections.extend([("pd_measured.q", "measured.q_measured"),
                                 ("pd_measured.dq", "velocity_filter.dq"),
                                 ("input_error.u", "pd_measured.u")])
        core.inputs["q_d"].append("pd_measured.q_d")
        core.inputs["pe"].append("pd_measured.pe")
    else:
        core.connections.append(("input_error.u", "pd.u"))


def main(argv: Sequence[str] | None = None) -> None:
    """Draw both loops of the paper's arm."""
    draw_script(_paper_loops, "twin_loop", "Draw Fig. 2 without its identifier: the robot and its "
                "model under the same PD law.", argv,
                names={"pd": "PD controller", "plant": "robot", "pd_model": "PD controller",
                       "model": "estimated model"})


def _paper_loops() -> Diagram:
    loops = twin_loop(paper.paper_arm(), paper.KP, paper.KD)
    return interconnect(loops.blocks, loops.connections, name="twin_loop",
                        inputs={**loops.inputs, "theta_hat": "model.theta_hat"},
                        outputs={**loops.outputs, "phi": "regressor.phi"})


if __name__ == "__main__":
    run_main(main)
