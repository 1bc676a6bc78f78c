"""A copy that goes wild is held, and the copies beside it move on as if alone."""

import numpy as np

from clie_blocks.analysis.blind.engine.control_loop import NOWHERE, run


def test_a_wild_copy_does_not_spoil_its_neighbours(bench):
    joint = bench()
    motion = joint.motion(0.5, torque=0.2 * joint.robot.kp)
    noise = np.zeros(motion.q_d.shape)
    wild = {**joint.truth, "drag": np.full(joint.robot.n, -10.0)}
    (q, _), (gone, _) = run(joint.robot, [joint.truth, wild], [motion] * 2, [noise] * 2)
    alone = joint.run(motion)[0]
    assert np.max(np.abs(q - alone)) < 1e-9
    assert np.all(gone == NOWHERE)
