"""What the notebooks of the course share: pictures in one scale, sliders, exercises."""

import inspect
import os
from collections.abc import Callable
from typing import Any

import control as ct
import matplotlib
import numpy as np
from matplotlib.figure import Figure

from clie_blocks.diagrams.picture import draw

STATIC = "CLIE_STATIC"  # of the environment: pictures in the place of sliders
_DECADES = 20.0  # a slider over a larger ratio counts in powers of ten


def set_style() -> None:
    """Set size, resolution and grid of all pictures that follow."""
    matplotlib.rcParams.update({
        "figure.figsize": (8.5, 3.2), "figure.dpi": 110, "savefig.dpi": 110, "axes.grid": True,
        "grid.alpha": 0.3})


def picture(diagram: ct.InputOutputSystem, **options: Any) -> Figure:
    """Draw a diagram, in one scale for the whole course; options are those of `draw`."""
    figure = draw(diagram, **options)
    figure.set_dpi(100)
    return figure


def explore(show: Callable[..., None], **ranges: tuple[float, float]) -> None:
    """Call a function with sliders for its arguments, or once with their defaults.

    Without a kernel, or without ipywidgets, a page then still shows the picture of the defaults.

    Parameters
    ----------
    show : callable
        Draws a picture; its arguments have defaults.
    ranges : tuple of float
        Least and largest value of each argument.

    """
    defaults = {name: argument.default
                for name, argument in inspect.signature(show).parameters.items()}
    widgets = None if os.environ.get(STATIC) else _widgets()
    if widgets is None:
        show(**defaults)
        return
    widgets.interact(show, **{
        name: _slider(widgets, name, float(defaults[name]), *ends)
        for name, ends in ranges.items()})


def _widgets() -> Any:
    try:
        import ipywidgets
    except ImportError:
        return None
    return ipywidgets


def _slider(widgets: Any, name: str, value: float, low: float, high: float) -> Any:
    shown = {"description": name.replace("_", " "), "continuous_update": False}
    if low > 0 and high / low > _DECADES:
        return widgets.FloatLogSlider(value, min=np.log10(low), max=np.log10(high), **shown)
    return widgets.FloatSlider(value, min=low, max=high, step=(high - low) / 100, **shown)


def exercise(check: Callable[[Any], None]) -> Callable[[Any], None]:
    """Turn a check into one that says open, or correct, or fails with a hint."""
    def run(answer: Any) -> None:
        if answer is ...:
            print(f"{check.__name__}: still open")
        else:
            check(answer)
            print(f"{check.__name__}: correct")
    return run
