"""The exported numbers, put into a MuJoCo model, move as the corrected model does."""

from xml.etree import ElementTree

import numpy as np
import pytest

from clie_blocks.analysis.gap.diagnosis import diagnose
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.report.exports import corrected_model

SUBSTEPS = 8  # a step of 0.125 ms
LOG = 2  # kept back by the diagnosis


def robot_in_mujoco(mujoco, found):
    """MuJoCo model of the exported joints and motors; the link of a single joint hangs on it."""
    root = ElementTree.fromstring(corrected_model(found))
    chain, world = found.problem.chain, root.find("worldbody")
    step = found.problem.period / SUBSTEPS
    ElementTree.SubElement(root, "option", timestep=str(step), integrator="implicitfast",
                           gravity=f"0 0 {-chain.g}")
    for k, joint in enumerate(list(world)):
        world.remove(joint)
        joint.attrib |= {"axis": "0 -1 0", "solreffriction": f"{4 * step} 1",
                         "solimpfriction": "0.9999 0.9999 0.001"}
        body = ElementTree.SubElement(world, "body", pos=f"0 {k} 0")
        body.append(joint)
        ElementTree.SubElement(body, "inertial", pos=f"{chain.com[k]} 0 0",
                               mass=str(max(chain.mass[k], 1e-9)), diaginertia="1e-9 1e-9 1e-9")
    return mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode"))


def moved(mujoco, found, log):
    """Positions of the MuJoCo robot under the stated law in the experiment of a log."""
    model, law = robot_in_mujoco(mujoco, found), found.problem.law
    data = mujoco.MjData(model)
    data.qpos[:] = log.start
    data.qfrc_applied[:] = -found.problem.gear_ratio * found.model.hypothesis.values["load"]
    out, measured = np.empty_like(log.q), np.empty_like(log.q)
    memory = np.zeros((2, found.problem.n))
    for i in range(len(log)):
        out[i] = data.qpos
        measured[i] = data.qpos + log.dither[i]
        x = measured[i] - measured[0]
        rate = law.numerator[0] * x + memory[0]
        memory[0] = law.numerator[1] * x - law.denominator[1] * rate + memory[1]
        memory[1] = law.numerator[2] * x - law.denominator[2] * rate
        data.ctrl[:] = law.command(log.q_d[i] - measured[i], rate, log.pe[i])
        mujoco.mj_step(model, data, SUBSTEPS)
    return out


@pytest.mark.parametrize("cause, seed", [("coulomb", 5), ("time_delay", 3),
                                         ("actuator_saturation", 3)])
def test_a_simulator_with_the_exported_numbers_moves_as_the_corrected_model(case, cause, seed):
    mujoco = pytest.importorskip("mujoco", reason="needs the extra clie-blocks[mujoco]")
    made = case(cause, seed)
    found = diagnose(Problem.from_logs(made.robot, made.records), effects=(cause,))
    k = made.causes[cause] - 1
    log = found.problem.logs[LOG]
    before, after = (
        np.std(fit.hypothesis.error(LOG)[:, k]) for fit in (found.nominal, found.model)
    )
    corrected = log.q - found.model.hypothesis.error(LOG)
    apart = np.std(moved(mujoco, found, log) - corrected, axis=0)[k]
    assert apart < 0.15 * before  # what the cause explains is in the simulator
    assert apart < 0.5 * after  # and the engine's own way adds less than the noise
