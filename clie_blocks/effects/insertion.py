"""Insertion of effects: the result has the ports of what it was made from.

Order along the signals, whatever the order of the list::

    controller: q_d, q, dq -> [effects] -> law -> [effects] -> u
    alone:      q, dq -> sensor -> controller, as above -> drive -> u
    plant:      u -> drive -> (+) -> transmission -> (+) -> joints -> sensor -> q, dq
                              (-) motor's loads      (-) link's loads, body
    loop:       q, dq, u -> log -> the outputs

Within one port the order is that of the list.  One sign convention: a load returns the torque that
opposes, ``tau`` [N m] on the motor side, and the sum subtracts it.  A transmission that gives the
motor a motion of its own (an output ``q_motor``) leaves the plant to the link; drive and loads of
side ``'motor'`` then see the motor, loads of side ``'link'`` the link.  What the sensors see,
`measured` says.

A controller that stands alone, such as the sampled half of a hybrid loop, takes the effects of its
wires as well; in a sampled one delays are exact shift registers and lags hold over each sample.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from clie_blocks.effects.bus import Bus
from clie_blocks.effects.effect import Setting
from clie_blocks.effects.rewiring import controller_of, with_blocks
from clie_blocks.errors import nearest
from clie_blocks.signals import Diagram, DiagramError, ports

if TYPE_CHECKING:
    import control as ct

_LOAD_PORTS = ("load", "environment", "body")
_PLANT_PORTS = ("drive", "transmission", "sensor", *_LOAD_PORTS)
_LAW_PORTS = ("sensor", "controller", "drive")
_SIDES = ("link", "motor")


def with_effects(system: ct.NonlinearIOSystem, effects: Iterable[Setting], *, plant: str = "plant",
                 measured: str = "link") -> ct.NonlinearIOSystem:
    """Insert effects into a plant, a controller or a closed loop; its ports stay the same.

    Parameters
    ----------
    system : control.NonlinearIOSystem
        A plant with ports ``u -> q, dq``, a controller with the output u alone, continuous or
        sampled, or a diagram that has a plant.
    effects : list of Setting
        Effects with their parameters, such as ``[LIBRARY['coulomb'](level=0.3)]``.
    plant : str
        Name of the plant block inside a diagram.
    measured : str
        Where the sensors sit, ``'link'`` or ``'motor'``; it matters behind a transmission.

    Returns
    -------
    clie_blocks.signals.Diagram
        A system of the same name and ports; parameters are ``'<effect>.<parameter>'``.  Without
        effects, `system` itself.

    Raises
    ------
    DiagramError
        If `system` has no port for an effect, or two effects have the same name.

    """
    effects = list(effects)
    _check_effects(effects)
    if measured not in _SIDES:
        raise DiagramError(f"measured={measured!r}: sensors sit at the link or at the motor; "
                           f"{nearest(measured, _SIDES)}")
    if not effects:
        return system
    if _is_plant(system):
        misplaced = [s for s in effects if s.effect.port not in _PLANT_PORTS]
        if misplaced:
            raise DiagramError(
                f"{misplaced[0].name} enters at the {misplaced[0].effect.port}, which a plant "
                "does not have; insert it into a loop, such as joint_loop(plant, kp, kd)")
        return _effective_plant(system, effects, measured)
    if list(ports(system.output_labels)) == ["u"]:
        return _lone_controller(system, effects)
    return _effective_loop(system, effects, plant, measured)


def of_law(setting: Setting) -> bool:
    """Whether an effect belongs to the law: of the others, those of the plant and the recorder."""
    outputs = getattr(setting.effect.build, "outputs", ())
    return setting.effect.port == "controller" or tuple(outputs) == ("dq",)


def _effective_loop(loop: Diagram, effects: Sequence[Setting], plant_name: str,
                    measured: str) -> Diagram:
    blocks = {block.name: block for block in getattr(loop, "syslist", ())}
    if plant_name not in blocks:
        raise DiagramError(f"{loop.name}: no block {plant_name!r} to put effects into; "
                           f"{nearest(plant_name, blocks)}")
    replaced = {}
    in_plant = [s for s in effects if s.effect.port in _PLANT_PORTS]
    if in_plant:
        replaced[plant_name] = _effective_plant(blocks[plant_name], in_plant, measured)
    in_law = [s for s in effects if s.effect.port == "controller"]
    if in_law:
        law = controller_of(loop, plant_name)
        replaced[law] = _effective_controller(blocks[law], in_law, loop.dt)
    changed = with_blocks(loop, replaced) if replaced else loop
    in_log = [s for s in effects if s.effect.port == "log"]
    return _recorded_loop(changed, in_log) if in_log else changed


def _effective_plant(plant: ct.NonlinearIOSystem, settings: Sequence[Setting],
                     measured: str) -> Diagram:
    if not _is_plant(plant):
        raise DiagramError(f"{plant.name}: a plant has the ports u -> q, dq, not "
                           f"{list(ports(plant.input_labels))} -> "
                           f"{list(ports(plant.output_labels))}")
    n = plant.ninputs
    bus = Bus(external=["u"], n=n)
    bus.source.update({signal + end: f"{plant.name}.{signal}" for signal in ("q", "dq")
                       for end in ("", "_plant", "_motor", "_link")})
    for setting in _at(settings, "transmission"):
        bus.insert_transmission(setting.block(n, plant.dt), plant)
    bus.source.update({signal: bus.source[f"{signal}_{measured}"] for signal in ("q", "dq")})
    for setting in _at(settings, "drive"):
        bus.insert(setting.block(n, plant.dt), reading=_seen_from("motor"))
    for setting in _at(settings, "sensor"):
        bus.insert(setting.block(n, plant.dt))
    for setting in (s for port in _LOAD_PORTS for s in _at(settings, port)):
        side = setting.effect.side
        bus.insert(setting.block(n, plant.dt), reading=_seen_from(side), side=side)
    bus.close_sums(plant)
    return bus.diagram(plant.name, outputs=("q", "dq"))


def _seen_from(side: str) -> dict[str, str]:
    return {"q": f"q_{side}", "dq": f"dq_{side}"}


def _lone_controller(law: ct.NonlinearIOSystem, settings: Sequence[Setting]) -> Diagram:
    misplaced = [s for s in settings if s.effect.port not in _LAW_PORTS]
    if misplaced:
        raise DiagramError(f"{misplaced[0].name} enters at the {misplaced[0].effect.port}, which "
                           "a controller does not have; insert it into the plant")
    inserted = [s for port in _LAW_PORTS for s in _at(settings, port)]
    return _effective_controller(law, inserted, law.dt)


def _effective_controller(law: ct.NonlinearIOSystem, settings: Sequence[Setting],
                          period: float) -> Diagram:
    n = law.noutputs
    bus = Bus(external=list(ports(law.input_labels)), n=n)
    blocks = [setting.block(n, period) for setting in settings]
    for block in (b for b in blocks if "u" not in ports(b.output_labels)):
        bus.insert(block)
    bus.insert(law, replaces=True)
    for block in (b for b in blocks if "u" in ports(b.output_labels)):
        bus.insert(block)
    return bus.diagram(law.name, outputs=("u",))


def _recorded_loop(loop: Diagram, settings: Sequence[Setting]) -> Diagram:
    shown = list(ports(loop.output_labels))
    n = len(ports(loop.output_labels)[shown[0]])
    bus = Bus(external=list(ports(loop.input_labels)), n=n)
    bus.insert(loop, replaces=True)
    for setting in settings:
        bus.insert(setting.block(n, loop.dt))
    return bus.diagram(loop.name, outputs=shown)


def _at(settings: Sequence[Setting], port: str) -> list[Setting]:
    return [setting for setting in settings if setting.effect.port == port]


def _is_plant(system: ct.NonlinearIOSystem) -> bool:
    return (list(ports(system.input_labels)) == ["u"]
            and list(ports(system.output_labels)) == ["q", "dq"])


def _check_effects(effects: Sequence[Setting]) -> None:
    names = set()
    for setting in effects:
        if not hasattr(setting, "effect"):
            raise DiagramError(f"not an effect with its parameters: {setting!r}; write "
                               "LIBRARY['coulomb'](level=0.3)")
        if setting.name in names:
            raise DiagramError(f"two effects are called {setting.name!r}; "
                               "give each its own name=")
        names.add(setting.name)
