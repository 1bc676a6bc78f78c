"""A control law of any form in the sampled loop: a block of python-control in discrete time."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.errors import nearest
from clie_blocks.labels import DiagramError, ports, signals

if TYPE_CHECKING:
    from control import InputOutputSystem, NonlinearIOSystem, StateSpace, TransferFunction

    from clie_blocks.compiled.ir.parameters import Parameters

REFERENCE, POSITION, EXCITATION, COMMAND = "q_d", "q", "pe", "u"
VELOCITY, TORQUE = "dq", "tau"
OF_DRIVE = (VELOCITY, TORQUE)  # what a drive measures, and a law may read beside the position
LawFunction = Callable[[float | np.ndarray, np.ndarray, np.ndarray, np.ndarray],
                       tuple[np.ndarray, np.ndarray]]
NONE = np.zeros(0)
PARAMETERS = "law"  # key of the parameters of a law among those of its loop
SAME_PERIOD = 0.01  # relative, between the rates of a law and of logs with clocks of their own
MOST_STATES = 1000  # of a law: a buffer of one second at 1 kHz


@dataclasses.dataclass(frozen=True)
class SampledLaw:
    """A law as a function, alike for arrays and for the symbols that become machine code.

    Laws with equal equations are equal whatever their parameters, so that a compiled loop serves
    both.

    Parameters
    ----------
    name : str
        Of its block.
    n : int
        Joints.
    period : float
        Sample time [s].
    digest : str
        What tells its equations from those of every other law.
    states : int
        Number of states.
    order : tuple of (str, int)
        Port and joint of each input of `function`.
    scale : tuple of float
        Torque of each joint per unit of its command.
    parameters : tuple of (str, int)
        Key and place of each parameter in its array.
    values : tuple of float
        The parameters.
    function : callable
        ``function(t, x, inputs, parameters) -> (next state, command)``.
    has_clock : bool
        A state of it counts samples, of a part that runs at a slower rate.

    """

    name: str = dataclasses.field(compare=False)
    n: int
    period: float
    digest: str
    states: int
    order: tuple[tuple[str, int], ...]
    scale: tuple[float, ...]
    parameters: tuple[tuple[str, int], ...]
    values: tuple[float, ...] = dataclasses.field(compare=False, repr=False)
    function: LawFunction = dataclasses.field(compare=False, repr=False)
    has_clock: bool = dataclasses.field(default=False, compare=False, repr=False)

    @property
    def takes_excitation(self) -> bool:
        """Whether the excitation is an input; else it is added to the command."""
        return any(port == EXCITATION for port, _ in self.order)

    @property
    def reads(self) -> tuple[str, ...]:
        """What it reads of the drive, some of `OF_DRIVE`."""
        ports_of_law = {port for port, _ in self.order}
        return tuple(port for port in OF_DRIVE if port in ports_of_law)

    def step(self, t: float | np.ndarray, x: np.ndarray, q_d: np.ndarray, q: np.ndarray,
             pe: np.ndarray, p: np.ndarray, *of_drive: np.ndarray,
             ) -> tuple[np.ndarray, np.ndarray]:
        """Next state, and command with the excitation, of one sample.

        What the drive measured comes last, in the order of `reads`: a torque in the unit of the
        block's command.
        """
        from clie_blocks.compiled.frontend.symbol_arrays import array_of

        scale = np.array(self.scale)
        given = {REFERENCE: q_d, POSITION: q, EXCITATION: pe / scale,
                 **dict(zip(self.reads, of_drive, strict=True))}
        after, u = self.function(t, x, array_of([given[port][k] for port, k in self.order]), p)
        return after, scale * u + (0.0 if self.takes_excitation else pe)

    @functools.cached_property
    def system(self) -> NonlinearIOSystem:
        """The law as a block with the inputs q_d, q, pe and what it `reads`, and the output u."""
        import control as ct

        n = self.n

        def step(t: float, x: np.ndarray, u: np.ndarray, params: Mapping[str, np.ndarray],
                 ) -> tuple[np.ndarray, np.ndarray]:
            q_d, q, pe, *of_drive = (u[k:k + n] for k in range(0, len(u), n))
            return self.step(t, x, q_d, q, pe, params.get(PARAMETERS, NONE), *of_drive)

        def update(t: float, x: np.ndarray, u: np.ndarray,
                   params: Mapping[str, np.ndarray]) -> np.ndarray:
            return step(t, x, u, params)[0]

        def output(t: float, x: np.ndarray, u: np.ndarray,
                   params: Mapping[str, np.ndarray]) -> np.ndarray:
            return step(t, x, u, params)[1]

        return ct.nlsys(update, output, name="law", dt=self.period, states=self.states,
                        params={PARAMETERS: np.array(self.values)} if self.values else {},
                        inputs=signals(REFERENCE, POSITION, EXCITATION, *self.reads, n=n),
                        outputs=signals(COMMAND, n=n))


def read_of_drive(block: InputOutputSystem | None) -> tuple[str, ...]:
    """What a block reads of the drives, some of `OF_DRIVE`."""
    given = ports(block.input_labels) if block is not None else {}
    return tuple(port for port in OF_DRIVE if port in given)


def sampled_law(block: InputOutputSystem, period: float,
                scale: Sequence[float] | np.ndarray | None = None) -> SampledLaw:
    """Return a block of python-control as a law of the sampled loop.

    Ports: inputs q_d[k], q[k] [rad] and optionally pe[k] [N m] and, as the drive measures them,
    dq[k] [rad/s] and tau[k] [as u]; outputs u[k].

    Parameters
    ----------
    block : control.InputOutputSystem
        In discrete time, or without states; a transfer function is realised.
    period : float
        Sample time of the controller [s].
    scale : array_like, shape (n,), optional
        Torque of each joint per unit of its command; by default 1.

    Returns
    -------
    SampledLaw
        The law.

    Raises
    ------
    DiagramError
        If a port is missing or unknown, or the block is in continuous time or of another rate.
    TraceError
        If the block cannot become machine code; names the block and the remedy.

    """
    import control as ct

    from clie_blocks.compiled.frontend.step_function import step_function

    if isinstance(block, ct.TransferFunction):
        block = _realised(block)
    if not isinstance(block, (ct.NonlinearIOSystem, ct.StateSpace)):
        raise DiagramError(f"a control law is a python-control system, not "
                           f"{type(block).__name__}; build it with nlsys, ss or interconnect")
    n = _check_ports(block)
    _check_rate(block, period)
    if block.nstates > MOST_STATES:
        raise DiagramError(f"{block.name}: the law has {block.nstates} states, and the loop takes "
                           f"{MOST_STATES}; keep what it needs of the past, not all of it")
    function = step_function(block)
    place = {at: (name, k) for name, group in ports(block.input_labels).items()
             for k, at in enumerate(group)}
    order = tuple(place[at] for at in range(block.ninputs))
    return SampledLaw(block.name, n, period, function.digest,
                      block.nstates, order, tuple(np.broadcast_to(
                          1.0 if scale is None else np.asarray(scale, float), n).tolist()),
                      _names(function.parameters), tuple(function.parameters.defaults.tolist()),
                      function, any("count[" in label for label in block.state_labels))


def _realised(block: TransferFunction) -> StateSpace:
    """Transfer function as a block with states, refused where it needs samples to come."""
    import control as ct

    orders = zip(np.ravel(block.num_array), np.ravel(block.den_array))
    if any(len(np.trim_zeros(num, "f")) > len(np.trim_zeros(den, "f")) for num, den in orders):
        raise DiagramError(
            f"{block.name}: a numerator has a higher order than its denominator, so that the law "
            "would need samples that are still to come; divide it by z as often as it is ahead")
    return ct.ss(block, inputs=block.input_labels, outputs=block.output_labels, name=block.name)


def _names(parameters: Parameters) -> tuple[tuple[str, int], ...]:
    """Key and place of each parameter, in the order of their slots."""
    keys = sorted(parameters.offset, key=lambda key: parameters.offset[key])
    return tuple((key, place) for key in keys
                 for place in range(int(np.prod(parameters.shape[key]))))


def _check_ports(block: InputOutputSystem) -> int:
    """Number of joints of a law with the right ports."""
    inputs, outputs = ports(block.input_labels), ports(block.output_labels)
    known = (REFERENCE, POSITION, EXCITATION, *OF_DRIVE)
    for name in inputs:
        if name not in known:
            raise DiagramError(f"{block.name}: a law has no input {name!r}; "
                               f"{nearest(name, known)}. What else it needs it forms itself")
    for name, kind, given in ((POSITION, "input", inputs), (COMMAND, "output", outputs)):
        if name not in given:
            raise DiagramError(f"{block.name}: the law has no {kind} {name!r}; its ports are the "
                               "inputs q_d[k], q[k] and, if it takes them, pe[k], dq[k] and "
                               "tau[k], and the outputs u[k], one per joint; it has "
                               f"{', '.join([*inputs, *outputs])}")
    n = len(outputs[COMMAND])
    for name, labels in [*inputs.items(), *outputs.items()]:
        if name != COMMAND and name in outputs:
            raise DiagramError(f"{block.name}: the law has an output {name!r}; its only output is "
                               "the command u[k]: leave the others out")
        if len(labels) != n:
            raise DiagramError(f"{block.name}: {name} has {len(labels)} signals and u has {n}; "
                               "every joint needs one of each")
    return n


def _check_rate(block: InputOutputSystem, period: float) -> None:
    if block.dt == 0:
        raise DiagramError(
            f"{block.name} is in continuous time, and a controller runs in samples: build it with "
            f"dt={period:g}, or sample it as the controller does, control.sample_system")
    if block.dt not in (None, True) and abs(block.dt - period) > SAME_PERIOD * period:
        raise DiagramError(f"{block.name} runs every {block.dt:g} s and the controller of the "
                           f"robot every {period:g} s; state one of them as the other")
    if block.dt is None and block.nstates:
        raise DiagramError(f"{block.name} has states but no sample time; build it with "
                           f"dt={period:g}")
