"""Friction on a real machine: the EMPS axis under its own sampled controller, nothing fitted."""

import control as ct
import numpy as np
import pytest

from clie_blocks.analysis.records import read_record
from clie_blocks.compiled import sampled
from clie_blocks.effects import LIBRARY, with_effects
from clie_blocks.joints import inertial_joints

# A. Janot, M. Gautier, M. Brunot, Data Set and Reference Models of EMPS, 2019
MASS, VISCOUS, COULOMB, OFFSET = 95.1089, 203.5034, 20.3935, -3.1648  # kg, N s/m, N, N
KP, KV, FORCE_PER_VOLT, LIMIT, PERIOD = 160.18, 243.45, 35.15, 10.0, 1e-3

SYMMETRIC = [LIBRARY["coulomb"](level=COULOMB, width=1e-4), LIBRARY["offset"](torque=OFFSET)]
ASYMMETRIC = [LIBRARY["asymmetric_coulomb"](forward=COULOMB + OFFSET, backward=COULOMB - OFFSET,
                                            width=1e-4)]


def cascade():
    """Controller of the axis; its velocity is the slope of the mean of two samples."""
    def update(t, x, u, params):
        return np.concatenate((u[1:2], x[:1]))

    def output(t, x, u, params):
        wanted, q, pulse = u
        speed = (q - x[1]) / (2 * PERIOD)
        volt = np.clip(KP * KV * (wanted - q) - KV * speed + pulse, -LIMIT, LIMIT)
        return np.array([FORCE_PER_VOLT * volt])

    return ct.nlsys(update, output, dt=PERIOD, states=2, name="controller", outputs=["u[0]"],
                    inputs=["q_d[0]", "q[0]", "pe[0]"])


def position_error(record, effects, parts=10):
    """Root mean square difference of the simulated position from the measured one [m]."""
    plant = with_effects(inertial_joints([MASS], [VISCOUS], [0.0]), effects)
    loop = sampled(plant, cascade(),
                   wires=[("plant.u", "controller.u"), ("controller.q", "plant.q")])
    start, steps = record.q[0, 0], len(record) - 1
    pulses = np.zeros_like(record.qd) if record.pe is None else record.pe
    run = loop.run(steps * PERIOD, PERIOD / parts, "ode4", log="q", every=parts, inputs={
        "q_d": np.repeat(record.qd[:-1], parts, axis=0),
        "pe": np.repeat(pulses[:-1], parts, axis=0)},
        initial_state={"plant.plant": [start, 0.0], "controller": [start, start]})
    return np.sqrt(np.mean((np.asarray(run.outputs).ravel() - record.q[:, 0]) ** 2))


@pytest.mark.parametrize("part", [0, 1], ids=["identification", "pulses"])
def test_coulomb_friction_closes_the_gap_of_the_axis(shared, part):
    record = read_record(shared / "data" / "emps", part=part)
    without = position_error(record, [LIBRARY["offset"](torque=OFFSET)])
    symmetric, asymmetric = (position_error(record, e) for e in (SYMMETRIC, ASYMMETRIC))
    assert np.ptp(record.q) > 0.2 and without > 14e-6
    assert symmetric < 2.2e-6  # over a stroke of a quarter of a metre
    assert asymmetric == pytest.approx(symmetric, rel=0.01)  # the exact pair of the catalogue
