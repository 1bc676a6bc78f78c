"""MuJoCo as a peer of the rigid-body terms."""

import mujoco
import numpy as np


class Peer:
    """Inverse dynamics and mass matrix of a model, by names of joints."""

    def __init__(self, model, names):
        self.model, self.data = model, mujoco.MjData(model)
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
        self.at = np.array([model.jnt_dofadr[model.joint(name).id] for name in names])

    def inverse_dynamics(self, q, dq, ddq):
        data, at = self.data, self.at
        data.qpos[at], data.qvel[at], data.qacc[at] = q, dq, ddq
        mujoco.mj_inverse(self.model, data)
        return data.qfrc_inverse[at] + data.qfrc_passive[at]

    def mass_matrix(self, q):
        self.inverse_dynamics(q, 0.0 * q, 0.0 * q)
        matrix = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, matrix)
        return matrix[np.ix_(self.at, self.at)]
