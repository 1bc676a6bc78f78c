"""Signals on their path through a plant or a controller, and the blocks inserted into them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from clie_blocks.effects.body import plant_with_inertia, refuse_heavy_motor
from clie_blocks.errors import nearest
from clie_blocks.signals import Diagram, DiagramError, interconnect, ports, summing

if TYPE_CHECKING:
    import control as ct

_SUMMED = ("tau", "inertia")


class Bus:
    """Signals by name and the block port that gives each of them at the moment.

    Parameters
    ----------
    external : list of str
        Signals that come from outside, the inputs of the diagram to be.
    n : int
        Number of joints.

    """

    def __init__(self, external: Sequence[str], n: int) -> None:
        self.n = n
        self.blocks: list[ct.NonlinearIOSystem] = []
        self.connections: list[tuple[str, ...]] = []
        self.external: dict[str, list[str]] = {signal: [] for signal in external}
        self.source: dict[str, str | None] = dict.fromkeys(external)
        self.sums: dict[str, list[str]] = {"tau_motor": [], "tau_link": [], "inertia": []}
        self.transmission: str | None = None
        self.read_ports: set[str] = set()

    def insert(self, block: ct.NonlinearIOSystem, *, reading: Mapping[str, str] | None = None,
               side: str = "motor", replaces: bool = False) -> None:
        """Add a block: it reads the bus, then gives the bus its outputs."""
        given = list(ports(block.output_labels))
        wanted = list(ports(block.input_labels))
        for signal in given:
            if signal in self.source and signal not in wanted and not replaces:
                raise DiagramError(f"{block.name}: it replaces {signal!r} and must read it too, "
                                   "so that its neutral value can pass it on untouched")
        self.blocks.append(block)
        for signal in wanted:
            self.read(f"{block.name}.{signal}", (reading or {}).get(signal, signal))
        for signal in given:
            if signal in _SUMMED:
                key = f"tau_{side}" if signal == "tau" else signal
                self.sums[key].append(f"{block.name}.{signal}")
            else:
                self.source[signal] = f"{block.name}.{signal}"

    def insert_transmission(self, block: ct.NonlinearIOSystem,
                            plant: ct.NonlinearIOSystem) -> None:
        """Add a transmission: a function of the link's motion, or a motor with its own motion.

        The latter gets its torque in `close_sums`, when all loads of the motor are known.
        """
        self.blocks.append(block)
        moving = "q_motor" in ports(block.output_labels)
        if moving and self.transmission:
            raise DiagramError(f"{plant.name}: {self.transmission} and {block.name} each give the "
                               "motor a motion of its own; one transmission can")
        for signal in ("q", "dq"):
            self.read(f"{block.name}.{signal}", f"{signal}_{'plant' if moving else 'link'}")
            end = "_motor" if moving else ""
            self.source[f"{signal}{end or '_link'}"] = f"{block.name}.{signal}{end}"
        if moving:
            refuse_heavy_motor(plant, block)
            self.transmission = block.name
            self.sums["inertia"].append(f"{block.name}.inertia")

    def read(self, target: str, signal: str) -> None:
        """Wire an input port to the present source of a signal."""
        if signal not in self.source:
            raise DiagramError(f"{target}: there is no signal {signal!r} here; "
                               f"{nearest(signal, self.source)}")
        source = self.source[signal]
        if source is None:
            self.external[signal].append(target)
        else:
            self.connections.append((target, source))
            self.read_ports.add(source)

    def close_sums(self, plant: ct.NonlinearIOSystem) -> None:
        """Lead the torque that the loads leave to the motor, and on to the plant."""
        if self.transmission:
            self._subtract(self.sums["tau_motor"], "motor_torque")
            self.read(f"{self.transmission}.u", "u")
            self.source["u"] = f"{self.transmission}.u"
            self._subtract(self.sums["tau_link"], "link_torque")
        else:
            self._subtract(self.sums["tau_motor"] + self.sums["tau_link"], "torque_sum")
        inertias = self.sums["inertia"]
        self.blocks.append(plant_with_inertia(plant) if inertias else plant)
        if inertias:
            self.connections.append((f"{plant.name}.inertia", *inertias))
            self.read_ports |= set(inertias)
        self.read(f"{plant.name}.u", "u")

    def _subtract(self, loads: Sequence[str], name: str) -> None:
        if not loads:
            return
        terms = [load.partition(".")[0] for load in loads]
        self.blocks.append(summing("u", *(f"-{term}" for term in terms), output="u", n=self.n,
                                   name=name))
        self.read(f"{name}.u", "u")
        self.connections += [(f"{name}.{term}", load) for term, load in zip(terms, loads)]
        self.read_ports |= set(loads)
        self.source["u"] = f"{name}.u"

    def diagram(self, name: str, outputs: Sequence[str]) -> Diagram:
        """Return the diagram whose outputs are the present sources."""
        shown = {signal: self.source[signal] or signal for signal in outputs}
        every = {f"{block.name}.{port}" for block in self.blocks
                 for port in ports(block.output_labels)}
        return interconnect(self.blocks, self.connections, inputs=self.external, outputs=shown,
                            name=name, unused=sorted(every - self.read_ports - {*shown.values()}))
