"""How the stiff effects of the catalogue converge with the step, and how far they creep.

``python analysis/catalogue/numerics.py`` prints the table of `docs/effects_numerics.md`; with
``-o FILE`` it writes it.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.compiled import compile_diagram
from clie_blocks.compiled.program import Program
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.effects import LIBRARY, sticking, with_effects
from clie_blocks.effects.effect import Setting
from clie_blocks.errors import DivergedError
from clie_blocks.joints import decoupled_joints
from clie_blocks.output import run_main, write

if TYPE_CHECKING:
    import control as ct

STEPS = (2e-3, 1e-3, 5e-4, 2.5e-4)
REFERENCE_STEP = 6.25e-5
ROUNDING = 1e-11  # rad
DURATION = 6.0


@dataclass(frozen=True)
class Convergence:
    """Error over step of one effect, at its typical parameters, in the loop of Fig. 1.

    Parameters
    ----------
    effect : str
        Name.
    errors : tuple of float
        Largest difference of q to the run at `REFERENCE_STEP`, for each of `STEPS` [rad].
    size : float
        Largest change of q that the effect makes [rad].

    """

    effect: str
    errors: tuple[float, ...]
    size: float

    @property
    def order(self) -> float:
        """Slope of log error over log step; NaN where no two steps are above rounding."""
        errors = np.array(self.errors)
        use = np.isfinite(errors) & (errors > ROUNDING)
        if np.sum(use) < 2:
            return np.nan
        return np.polyfit(np.log(np.array(STEPS)[use]), np.log(errors[use]), 1)[0]


def convergence(name: str, method: str = "ode4") -> Convergence:
    """Run one effect with each of `STEPS`, by a fixed-step method of the compiled runner."""
    loop = _loop([LIBRARY[name].typical()])
    program = compile_diagram(loop)
    reference = _positions(program, REFERENCE_STEP, method)
    errors = tuple(float(np.max(np.abs(_positions(program, step, method) - reference)))
                   for step in STEPS)
    return Convergence(name, errors, float(np.max(np.abs(reference - _plain(method)))))


def creep(setting: Setting, load: float, duration: float = 10.0, step: float = 1e-3) -> float:
    """Speed of a joint that a load below break-away should not move [rad/s].

    Parameters
    ----------
    setting : clie_blocks.effects.effect.Setting
        A friction effect with its parameters.
    load : float
        Torque, ramped up slowly and held [N m].
    duration, step : float
        How long it is held, and the step [s].

    Returns
    -------
    float
        Mean speed over the last half of the hold.

    """
    plant = compile_diagram(with_effects(decoupled_joints([2.0], [0.5], [0.0]), [setting]))
    run = plant.run(2 * duration, step, "ode4", inputs={
        "u": lambda t: np.array([load * np.minimum(t / duration, 1.0)])})
    q = np.asarray(run.outputs)[0].ravel()
    half = int(round(duration / 2 / step))
    return float((q[-1] - q[-1 - half]) / (duration / 2))


def table(names: Sequence[str] | None = None) -> str:
    """Return the Markdown table of the stiff effects, or of those named."""
    names = names or [name for name in LIBRARY if LIBRARY[name].stiff]
    heads = ["effect", "changes q by [rad]", *(f"error at {1e3 * step:g} ms" for step in STEPS),
             "order"]
    rows = [heads, ["---"] * len(heads)]
    for name in names:
        found = convergence(name)
        rows.append([f"`{name}`", f"{found.size:.1e}", *(_shown(e) for e in found.errors),
                     "rounding" if np.isnan(found.order) else f"{found.order:.1f}"])
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


def creep_table() -> str:
    """Return the Markdown table of the creep of each dry friction under 0.9 of its level."""
    rows = ["| effect | creep at 0.9 of the level [rad/s] |", "| --- | --- |"]
    laws = {f"`{name}`": LIBRARY[name]
            for name in ("coulomb", "stribeck", "presliding", "dahl", "maxwell_slip")}
    laws |= {f"`{name}`, sticking form": sticking(LIBRARY[name])
             for name in ("coulomb", "stribeck")}
    for label, law in laws.items():
        rows.append(f"| {label} | {abs(creep(law.typical(level=0.4), 0.36)):.1e} |")
    return "\n".join(rows)


@lru_cache
def _plain(method: str) -> np.ndarray:
    """Positions without any effect."""
    return _positions(compile_diagram(_loop([])), REFERENCE_STEP, method)


def _shown(error: float) -> str:
    return f"{error:.1e}" if np.isfinite(error) else "diverges"


def _loop(effects: Sequence[Setting]) -> ct.NonlinearIOSystem:
    return with_effects(joint_loop(decoupled_joints([2.0], [0.5], [0.0]), [10.0], [5.0]), effects)


def _positions(program: Program, step: float, method: str) -> np.ndarray:
    """Positions at every 2 ms of a run that reverses, rests and moves fast."""
    inputs = {"q_d": lambda t: np.array([1.4 * np.sin(0.9 * t) + 0.5 * np.sin(2.3 * t)]),
              "pe": lambda t: np.array([2.0 * np.sin(5.1 * t)])}
    try:
        run = program.run(DURATION, step, method, inputs, log="q", every=round(STEPS[0] / step))
    except DivergedError:
        return np.array([np.inf])
    return np.asarray(run.outputs).ravel()


_PAGE = """# Numerics of the stiff effects

Made by `python analysis/catalogue/numerics.py -o docs/effects_numerics.md`.

Each effect stands at its typical parameters in the loop of Fig. 1 (A = 2, B = 0.5, Kp = 10,
Kd = 5), driven for {duration:g} s through reversals and fast motion by `ode4`.  The error is the
largest difference of the position to a run at {reference:g} ms.  A method of order 4 keeps its
order where the law is smooth, and a smoothed law gains more once the step resolves its width.  At
a corner or a jump the order drops to between 1 and 2, because a fixed step does not look for the
moment of the event; a rounded reading differs by one step of the rounding wherever the value
falls on the other side, at any step.

{convergence}

Sticking.  A load of 0.9 of the friction level is ramped up and held for 10 s.  The smoothed laws
creep at `width atanh(0.9) = {creep:.2e}` rad/s and say so; the contacts with a state of their own
hold.

{sticking}

What is left is the spring of the contact coming to rest.  A smoothed law needs a step below about
`2 width / (B level)`, a contact with a state of its own one below `2 / fastest`,
`2 sqrt(reach / (B level))` and `2 reach / (B level relaxation)`.  Every dry friction has a form
that sticks, `sticking(LIBRARY["coulomb"])(level=0.4)`; with the torques of these joints it runs at
a step of 1 ms.
"""


def page() -> str:
    """Return the text of `docs/effects_numerics.md`."""
    return _PAGE.format(duration=DURATION, reference=1e3 * REFERENCE_STEP, convergence=table(),
                        creep=1e-3 * np.arctanh(0.9), sticking=creep_table())


def main(argv: Sequence[str] | None = None) -> int:
    """Print the page, or write it with ``-o FILE``."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", metavar="FILE", help="write the page to this file")
    options = parser.parse_args(argv)
    text = page()
    print(write(options.o, text) if options.o else text)
    return 0


if __name__ == "__main__":
    run_main(main)
