"""Picture of one effect: its characteristic, and the loop of Fig. 1 with and without it."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.catalogue.answer import ANSWERS, answer
from clie_blocks.compiled import compile_diagram
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.effects import LIBRARY, with_effects
from clie_blocks.effects.effect import Effect
from clie_blocks.joints import decoupled_joints

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DURATION, STEP, EVERY = 12.0, 5e-4, 40
UNITS = {"q": "rad", "q_d": "rad", "dq": "rad/s", "u": "N m", "tau": "N m", "t": "s",
         "twist": "rad"}
WITHOUT, WITH, GAP = "#888888", "#0b5fa5", "#b3261e"


def responses(name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return time, and a signal of both joints without the effect and at its typical parameters.

    Parameters
    ----------
    name : str
        Name in the catalogue.

    Returns
    -------
    tuple of ndarray
        Time [s], shape (k,); shape (2, k) each: position [rad], or command [N m] for an effect
        that sits in the log.

    """
    signal = _signal(name)
    return (*_run(signal), _run(signal, name)[1])


def _signal(name: str) -> str:
    return "u" if LIBRARY[name].port == "log" else "q"


@lru_cache
def _run(signal: str, name: str | None = None) -> tuple[np.ndarray, np.ndarray]:
    """One excitation for all: slow reversals of the set-point and a faster torque."""
    loop = joint_loop(decoupled_joints([2.0, 2.4], [0.5, 0.6], [0.0, 0.0]), [10, 10], [5, 5])
    program = compile_diagram(
        with_effects(loop, [LIBRARY[name].typical()] if name else []))
    phase = np.array([0.0, 1.0])
    run = program.run(DURATION, STEP, "ode4", log=signal, every=EVERY, inputs={
        "q_d": lambda t: 1.4 * np.sin(0.9 * t + phase) - 1.4 * np.sin(phase),
        "pe": lambda t: 2.0 * np.sin(5.1 * t + phase)})
    return np.asarray(run.time), np.asarray(run.outputs).reshape(2, -1)


def effect_figure(name: str) -> Figure:
    """Draw an effect: characteristic, response of the joint that changes most, and the change."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 2.6), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    _draw_characteristic(left, name)
    t, without, with_it = responses(name)
    change = with_it - without
    joint = int(np.argmax(np.max(np.abs(change), axis=1)))
    middle.plot(t, without[joint], color=WITHOUT, lw=2.6, alpha=0.6, label="without")
    middle.plot(t, with_it[joint], color=WITH, lw=1.0, label="with")
    shown = _labelled(_signal(name))
    middle.set(title=f"loop, joint {joint + 1}", xlabel="t [s]", ylabel=shown)
    middle.margins(y=0.2)
    middle.legend(frameon=False, fontsize=8, loc="upper right", ncols=2)
    right.plot(t, 1e3 * change[joint], color=GAP, lw=1.0)
    right.set(title="with minus without", xlabel="t [s]",
              ylabel=f"change of {shown.replace('[', '[m')}")
    for axes in (left, middle, right):
        axes.title.set_size(10)
        axes.tick_params(labelsize=8)
        axes.locator_params(axis="x", nbins=6)
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def _draw_characteristic(axes: Axes, name: str) -> None:
    effect = LIBRARY[name]
    axes.set_title("characteristic")
    if effect.curve is not None:
        swept, _ = effect.curve
        path = effect.typical().characteristic()
        axes.plot(*path, color=WITH, lw=1.2)
        axes.set(xlabel=_labelled(swept), ylabel=_result(effect, swept, *path))
    elif name in ANSWERS:
        t, y, shown = answer(name)
        output = effect.build.outputs[0]
        signal = output if output in shown else next(iter(shown))
        axes.plot(t, shown[signal], color=WITHOUT, lw=1.0, label=f"{signal} in")
        axes.plot(t, y, color=WITH, lw=1.2, label=f"{output} out")
        axes.set(xlabel="t [s]", title="answer in time")
        axes.legend(frameon=False, fontsize=8)
    else:
        axes.set_axis_off()
        through = "acts through the inertia" if "inertia" in effect.build.outputs else "a constant"
        axes.text(0.5, 0.5, through if effect.per_joint else "acts between the joints",
                  ha="center", va="center", transform=axes.transAxes)


def _labelled(signal: str) -> str:
    return f"{signal} [{UNITS.get(signal, '1')}]"


def _result(effect: Effect, swept: str, x: np.ndarray, y: np.ndarray) -> str:
    if swept == "twist":
        return "torque [N m]"
    name = effect.build.outputs[0]
    kept = name == swept and np.max(np.abs(y)) < 0.1 * np.max(np.abs(x))
    return f"change of {_labelled(name)}" if kept else _labelled(name)
