"""Plant and sampled parts joined by name, and the time base of each."""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import control as ct
import numpy as np

from clie_blocks.errors import nearest
from clie_blocks.signals import Diagram, DiagramError, interconnect, ports


@dataclass(frozen=True)
class Part:
    """A part of a loop that runs at its ticks.

    Parameters
    ----------
    name : str
        Name of the block or diagram.
    period : float
        Time between ticks [s].
    delayed : bool
        Its ticks are delayed by an input of the loop.

    """

    name: str
    period: float
    delayed: bool


def join(plant: ct.NonlinearIOSystem, controllers: Sequence[ct.NonlinearIOSystem],
         period: float | Mapping[str, float] | None, wires: Sequence[tuple[str, ...]],
         inputs: Mapping[str, str | Sequence[str]] | None, jitter: tuple[str, ...],
         name: str) -> tuple[Diagram, list[Part]]:
    """Join a continuous plant and sampled parts by their port names."""
    plant, *controllers = (ct.ss(part, name=part.name) if isinstance(part, ct.TransferFunction)
                           else part for part in (plant, *controllers))
    if plant.dt not in (0, None):
        raise DiagramError(f"{name}: the plant {plant.name!r} is in discrete time; a loop that is "
                           "sampled everywhere needs no hold: interconnect it, compile_diagram it")
    names = [part.name for part in controllers]
    for key in [*jitter, *(period if isinstance(period, Mapping) else ())]:
        if key not in names:
            raise DiagramError(f"{name}: no sampled part {key!r}; {nearest(key, names)}")
    parts = [Part(part.name, _period(part, period, name), part.name in jitter)
             for part in controllers]
    blocks = [_without_time_base(part) for part in (plant, *controllers)]
    inputs = _free_ports(blocks, {wire[0] for wire in wires}) if inputs is None else inputs
    shown = _by_name([(block.name, base) for block in blocks
                      for base in ports(block.output_labels)])
    return interconnect(blocks, wires, inputs=inputs, outputs=shown, name=name), parts


def _period(part: ct.NonlinearIOSystem, period: float | Mapping[str, float] | None,
            name: str) -> float:
    wanted = period.get(part.name) if isinstance(period, Mapping) else period
    if part.dt == 0 and part.nstates > 0:
        raise DiagramError(f"{name}: {part.name!r} has states in continuous time; sample it, such "
                           "as control.sample_system(block, period, 'tustin', copy_names=True)")
    own = None if part.dt is True or not part.dt else part.dt
    if own is None and wanted is None:
        raise DiagramError(f"{name}: {part.name!r} has no sample time of its own; "
                           "give period= [s]")
    if own is not None and wanted is not None and not np.isclose(own, wanted, rtol=1e-9, atol=0):
        raise DiagramError(f"{name}: {part.name!r} has the sample time {own:g} s, not "
                           f"{wanted:g} s; leave period out, or build the part for that period")
    value = float(own or wanted or 0.0)
    if not (np.isfinite(value) and value > 0):
        raise DiagramError(f"{name}: the period of {part.name!r} must be positive, got {value}")
    return value


def _without_time_base(part: ct.NonlinearIOSystem) -> ct.NonlinearIOSystem:
    """Return a part without its time base, which python-control would not join."""
    part = copy.copy(part)
    part.dt = None
    return part


def _free_ports(blocks: Sequence[ct.NonlinearIOSystem], driven: set[str]) -> dict[str, str]:
    free = []
    for block in blocks:
        for base, where in ports(block.input_labels).items():
            labels = [block.input_labels[k] for k in where]
            open_ = [label for label in labels if f"{block.name}.{label}" not in driven]
            if f"{block.name}.{base}" not in driven:
                free += [(block.name, port) for port in ([base] if open_ == labels else open_)]
    return _by_name(free)


def _by_name(free: Sequence[tuple[str, str]]) -> dict[str, str]:
    """Return 'block.port' by port name, or by 'block_port' where two blocks have the port."""
    names = [port for _, port in free]
    return {port if names.count(port) == 1 else f"{block}_{port}": f"{block}.{port}"
            for block, port in free}
