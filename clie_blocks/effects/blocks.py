"""From a kernel to a block: the one place where effects become python-control systems.

A kernel takes its signals in order, then its parameters by keyword, all as arrays whose last
axis is the joint.  So one function serves the block, the tests and the regression of a
diagnosis.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from inspect import signature
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.labels import signals

if TYPE_CHECKING:
    import control as ct


@dataclass(frozen=True)
class Static:
    """Block without memory: ``outputs = kernel(*inputs, **parameters)``.

    Parameters
    ----------
    kernel : callable
        Returns one array per output, in a tuple if there are several.
    inputs : tuple of str
        Signals it reads: ``'q'``, ``'dq'``, ``'u'`` and ``'t'`` for the time.
    outputs : tuple of str
        Signals it gives; a load gives ``'tau'``, the torque that opposes [N m].

    """

    kernel: Callable
    inputs: tuple[str, ...]
    outputs: tuple[str, ...] = ("tau",)

    def __call__(self, values: dict[str, np.ndarray], n: int, name: str) -> ct.NonlinearIOSystem:
        """Return the block for n joints with the given parameter vectors."""
        import control as ct

        kernel, read = _with_parameters(self.kernel, values, name), _reader(self.inputs, n)

        def output(t: float, x: np.ndarray, u: np.ndarray,
                   params: dict[str, np.ndarray]) -> np.ndarray:
            return _stacked(kernel(params, *read(t, u)))

        return ct.nlsys(
            None, output, dt=None, name=name, params=_qualified(values, name),
            inputs=_labels(self.inputs, n), outputs=_labels(self.outputs, n))


@dataclass(frozen=True)
class Dynamic:
    """Block with a state per joint: ``x' = rate(x, *inputs)``, ``outputs = kernel(x, *inputs)``.

    Built with a period, it is sampled and `rate` gives the state one period later.

    Parameters
    ----------
    rate, kernel : callable
        Both take the state, then the signals, then the parameters by keyword, among them
        `period` in a sampled block.
    inputs, outputs : tuple of str
        As in `Static`.
    state : str
        Name of the state.
    size : int
        Values per joint; the state reaches the kernels as (n,) for one, (size, n) for more.

    """

    rate: Callable
    kernel: Callable
    inputs: tuple[str, ...]
    outputs: tuple[str, ...] = ("tau",)
    state: str = "z"
    size: int = 1

    def __call__(self, values: dict[str, np.ndarray], n: int, name: str,
                 period: float = 0) -> ct.NonlinearIOSystem:
        """Return the block for n joints with the given parameter vectors."""
        import control as ct

        rate, kernel = (_with_parameters(function, values, name, period)
                        for function in (self.rate, self.kernel))
        shape = (n,) if self.size == 1 else (self.size, n)
        read = _reader(self.inputs, n)

        def update(t: float, x: np.ndarray, u: np.ndarray,
                   params: dict[str, np.ndarray]) -> np.ndarray:
            return _stacked(rate(params, x.reshape(shape), *read(t, u)))

        def output(t: float, x: np.ndarray, u: np.ndarray,
                   params: dict[str, np.ndarray]) -> np.ndarray:
            return _stacked(kernel(params, x.reshape(shape), *read(t, u)))

        return ct.nlsys(
            update, output, dt=period, name=name, params=_qualified(values, name),
            states=signals(self.state, n=self.size * n),
            inputs=_labels(self.inputs, n), outputs=_labels(self.outputs, n))


def filled_in(function: Callable, parameters: Mapping[str, np.ndarray | float]) -> Callable:
    """Fill in the parameters that a function names."""
    named = signature(function).parameters
    chosen = {key: value for key, value in parameters.items() if key in named}
    return lambda *arguments: function(*arguments, **chosen)


def _qualified(values: dict[str, np.ndarray], name: str) -> dict[str, np.ndarray]:
    return {f"{name}.{key}": value for key, value in values.items()}


def _with_parameters(kernel: Callable, values: dict[str, np.ndarray], name: str,
              period: float = 0) -> Callable:
    """Let a kernel take its parameters, those that it names, from the block's `params`."""
    named = signature(kernel).parameters.values()
    every = any(p.kind is p.VAR_KEYWORD for p in named)
    fixed = {"period": period} if "period" in {p.name for p in named} else {}
    keys = {key: f"{name}.{key}" for key in values if every or key in {p.name for p in named}}

    def evaluated(params: dict[str, np.ndarray], *arguments: np.ndarray) -> np.ndarray:
        parameters = {key: params[qualified] for key, qualified in keys.items()}
        return kernel(*arguments, **parameters, **fixed)

    return evaluated


def _stacked(rows: np.ndarray | tuple[np.ndarray, ...]) -> np.ndarray:
    """One vector from an array, or from several, row by row."""
    parts = rows if isinstance(rows, tuple) else (rows,)
    return np.concatenate([part.reshape(-1) for part in parts])


def _reader(inputs: Sequence[str], n: int) -> Callable:
    """Split the input vector of a block into the arguments of its kernel."""
    wired = [name for name in inputs if name != "t"]

    def read(t: float, u: np.ndarray) -> list:
        rows = dict(zip(wired, u.reshape(len(wired), n)))
        return [t if name == "t" else rows[name] for name in inputs]

    return read


def _labels(names: Sequence[str], n: int) -> list[str]:
    return [label for name in names if name != "t"
            for label in signals(name, n=n * n if name == "inertia" else n)]
