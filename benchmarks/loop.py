"""The diagram that every runner is compared on: the CASE 2 loop of the paper with held noise."""

from typing import Any

import control as ct
import numpy as np

from clie_blocks import paper
from clie_blocks.compiled import Program
from clie_blocks.diagrams.clie_loop import CASES
from clie_blocks.diagrams.scripts.paper_experiment import Experiment
from clie_blocks.excitation import paper_excitation
from clie_blocks.signals import Diagram

Q_D = np.array(paper.SET_POINT)
STEP = paper.STEP
EVERY = 100


def diagram() -> Diagram:
    """Return the 22-state loop: linear plant, PD on measured signals, composite law."""
    return Experiment(CASES, case=2, plant="linear", velocity="measured").diagram()


def noise_rows(steps: int) -> np.ndarray:
    """Return one row of position noise per step."""
    return np.random.default_rng(0).normal(0, np.sqrt(paper.NOISE_VARIANCE), (steps, 2))


def inputs(noise: np.ndarray) -> dict[str, Any]:
    """Return the inputs of a compiled run."""
    return {"q_d": Q_D, "pe": paper_excitation, "noise": noise}


def run(program: Program, noise: np.ndarray) -> ct.TimeResponseData:
    """Run the compiled diagram over all rows of noise."""
    return program.run(len(noise) * STEP, step=STEP, every=EVERY, inputs=inputs(noise))


def constants() -> dict[str, Any]:
    """Return the numbers of the loop by name, for the runners written by hand."""
    a, b, d = paper.THETA.reshape(3, 2)
    return {"a": a, "b": b, "d": d, "kp": np.array(paper.KP, float),
            "kd": np.array(paper.KD, float), "q_d": Q_D, "gamma": paper.GAMMA,
            "alpha": paper.ALPHA[2], "highpass": paper.OMEGA_HIGHPASS,
            "lowpass": paper.OMEGA_LOWPASS, "omega_f": paper.OMEGA_F}


def still(label: str, t: float) -> float:
    """Return the value of one loop input at a time, without noise."""
    if label.startswith("pe"):
        return float(paper_excitation(t))
    return Q_D[int(label[-2])] if label.startswith("q_d") else 0.0
