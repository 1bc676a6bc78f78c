"""Every compiled program is compared with the diagram itself at random points."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from clie_blocks.errors import ClieError

if TYPE_CHECKING:
    import control as ct

POINTS = 32
TOLERANCE = 1e-9


class CompiledDifferenceError(ClieError, AssertionError):
    """A compiled program does not compute what its diagram computes."""


class Comparable(Protocol):
    """What is compared of a compiled program."""

    states: list[tuple[str, str]]
    outputs: list[str]

    @property
    def params(self) -> dict[str, Any]:
        """Default value by key."""

    def dynamics(self, t: float, x: ArrayLike, u: ArrayLike,
                 params: Mapping[str, ArrayLike] | None = None) -> np.ndarray:
        """Derivatives of the states."""

    def output(self, t: float, x: ArrayLike, u: ArrayLike,
               params: Mapping[str, ArrayLike] | None = None) -> np.ndarray:
        """Outputs."""


def check(program: Comparable, diagram: ct.NonlinearIOSystem, points: int = POINTS) -> None:
    """Compare dynamics and outputs of a program and its diagram.

    Half of the points have other parameters than the default ones.

    Raises
    ------
    CompiledDifferenceError
        Names the first state or output that differs, with both values.

    """
    generator, compared = np.random.default_rng(2026), 0
    for k in range(points):
        t, x = generator.uniform(0.0, 10.0), generator.standard_normal(diagram.nstates)
        u = generator.standard_normal(diagram.ninputs)
        params = vary_parameters(program, diagram, generator) if k % 2 else {}
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            for name, labels in (("dynamics", [f"{b}.{s}" for b, s in program.states]),
                                 ("output", program.outputs)):
                expected = reference(getattr(diagram, name), t, x, u, params)
                if expected is not None and labels:
                    compared += 1
                    compare(name, labels, expected, getattr(program, name)(t, x, u, params), t)
    if not compared and (diagram.nstates or diagram.noutputs):
        raise CompiledDifferenceError(
            f"{diagram.name}: python-control could evaluate the diagram at none of {points} "
            "random points, so the compiled program cannot be checked. It calls NaN an algebraic "
            "loop, and a path through more outputs than it has blocks as well; call "
            "diagram.output(0, x, u) to see its answer")


def vary_parameters(program: Comparable, diagram: ct.NonlinearIOSystem,
           generator: np.random.Generator) -> dict[str, np.ndarray]:
    """Return the parameters of a diagram, each changed by up to a tenth."""
    return {key: np.asarray(value) * (1 + 0.1 * generator.uniform(-1, 1))
            for key, value in program.params.items() if key in diagram.params}


def reference(function: Callable[..., Any], t: float, x: np.ndarray, u: np.ndarray,
              params: Mapping[str, Any]) -> np.ndarray | None:
    """Return what python-control computes, or None where it cannot."""
    try:
        return np.asarray(function(t, x, u, params=params), float).reshape(-1)
    except Exception:  # a NaN is called an algebraic loop, a random matrix may be singular, ...
        return None


def compare(name: str, labels: Sequence[str], expected: np.ndarray, got: np.ndarray,
            t: float) -> None:
    """Refuse a difference.

    Raises
    ------
    CompiledDifferenceError
        Names the first entry that differs, with both values.

    """
    scale = 1.0 + np.max(np.abs(expected[np.isfinite(expected)]), initial=0.0)
    close = np.isclose(got, expected, rtol=TOLERANCE, atol=TOLERANCE * scale, equal_nan=True)
    if not np.all(close):
        k = int(np.argmin(close))
        raise CompiledDifferenceError(
            f"the compiled {name} of {labels[k]} is {got[k]!r} where python-control gives "
            f"{expected[k]!r} (t = {t:.3g} s); a block reads something that is neither t, x, u "
            "nor params, or changes its own arrays")
