"""Effects of the catalogue against MuJoCo's own implementation of them.

``python analysis/catalogue/against_mujoco.py`` prints the table of `docs/effects_mujoco.md`; with
``-o FILE`` it writes it.  Needs the extra `mujoco`.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.analysis.catalogue.mujoco_robots import ROBOTS, STEP, Robot
from clie_blocks.compiled import compile_diagram
from clie_blocks.errors import MissingExtraError, nearest
from clie_blocks.output import run_main, write
from clie_blocks.signals import DiagramError

if TYPE_CHECKING:
    import control as ct

DURATION = 3.0


@dataclass(frozen=True)
class Comparison:
    """Largest difference of q between the engines, and what the effect changes of q [rad]."""

    effect: str
    difference: float
    size: float
    why: str


def compare(name: str) -> Comparison:
    """Run one effect of `ROBOTS` in both engines from rest under the same held torques."""
    if name not in ROBOTS:
        raise DiagramError(f"no robot to compare {name!r} on; {nearest(name, ROBOTS)}")
    robot = ROBOTS[name]()
    rows = _torques(robot)
    theirs = _mujoco_angles(robot, rows)
    ours, without = (_our_angles(plant, rows) for plant in (robot.plant, robot.plain))
    return Comparison(name, float(np.max(np.abs(ours - theirs))),
                      float(np.max(np.abs(ours - without))), robot.why)


def _torques(robot: Robot) -> np.ndarray:
    t = STEP * np.arange(round(DURATION / STEP))[:, None]
    n = np.arange(len(robot.angles))
    return robot.torque * (np.cos((5.0 + 2.0 * n) * t) + 0.5 * np.cos(17.0 * t + n))


def _our_angles(plant: ct.NonlinearIOSystem, rows: np.ndarray) -> np.ndarray:
    run = compile_diagram(plant).run(DURATION, STEP, "ode4", {"u": rows}, log="q")
    return np.asarray(run.outputs).reshape(rows.shape[1], -1)[:, :-1].T


def _mujoco_angles(robot: Robot, rows: np.ndarray) -> np.ndarray:
    try:
        import mujoco
    except ImportError:
        raise MissingExtraError("the comparison of engines", "MuJoCo", "mujoco") from None
    model = mujoco.MjModel.from_xml_string(_XML.format(
        step=STEP, gravity=robot.gravity, world=robot.world, actuators=robot.actuators))
    data = mujoco.MjData(model)
    found = np.empty((len(rows), model.nq))
    for k, row in enumerate(rows):
        found[k] = data.qpos
        data.ctrl[:] = row
        mujoco.mj_step(model, data)
    return found @ np.array(robot.angles).T


_XML = """<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <option timestep="{step}" gravity="0 0 -{gravity}" integrator="RK4">
    <flag contact="disable"/>
  </option>
  <worldbody>{world}</worldbody>
  <actuator>{actuators}</actuator>
</mujoco>"""
_PAGE = """# Effects against MuJoCo

Made by `python analysis/catalogue/against_mujoco.py -o docs/effects_mujoco.md`.

The same robot in both engines, from rest, driven for {duration:g} s by the same torques, held over
steps of {step:g} ms: MuJoCo {version} with RK4, ours with `ode4`.

{table}
"""


def page() -> str:
    """Return the text of `docs/effects_mujoco.md`."""
    rows = ["| effect | changes q by [rad] | engines differ by [rad] | what bounds it |",
            "| --- | --- | --- | --- |"]
    found = [compare(name) for name in ROBOTS]
    rows += [f"| `{c.effect}` | {c.size:.2g} | {c.difference:.1e} | {c.why} |" for c in found]
    import mujoco

    return _PAGE.format(duration=DURATION, step=1e3 * STEP, table="\n".join(rows),
                        version=mujoco.__version__)


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
