"""Robots that people own: every URDF of example-robot-data, beside Pinocchio."""

import importlib.metadata
from pathlib import Path

import numpy as np
import pytest

from clie_blocks.errors import ClieError
from clie_blocks.rigid_body.dynamics import inverse_dynamics
from clie_blocks.rigid_body.tree import tree
from clie_blocks.rigid_body.urdf import describe_urdf

IMPOSSIBLE = "romeo_laas_small.urdf", "romeo_small.urdf"
WITHOUT_JOINTS = "quadrotor_base.urdf", "iris_simple.urdf"
EMPTY = ("ur3.urdf",)
REFUSED = {**dict.fromkeys(IMPOSSIBLE, "belong to no body"),
           **dict.fromkeys(WITHOUT_JOINTS, "at least one joint that moves"),
           **dict.fromkeys(EMPTY, "has 0")}


def robots():
    """Files of the package, which has data and no module."""
    try:
        files = importlib.metadata.files("example-robot-data") or []
    except importlib.metadata.PackageNotFoundError:
        pytest.skip("example-robot-data is not installed")
    return sorted(Path(file.locate()).resolve() for file in files if file.suffix == ".urdf")


def torques_of_pinocchio(pin, path, held, names, motions):
    """Inverse dynamics of the joints by name, with some joints held at zero."""
    model = pin.buildModelFromUrdf(str(path))
    locked = [model.getJointId(name) for name in held if model.existJointName(name)]
    if locked:
        model = pin.buildReducedModel(model, locked, pin.neutral(model))
    joints = [model.joints[model.getJointId(name)] for name in names]
    assert len(joints) == model.njoints - 1
    torques = []
    for motion in motions:
        q, speed, rate = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
        for joint, place, *state in zip(joints, *motion):
            if joint.nq == 2:  # a joint without limits is stated by cosine and sine
                q[joint.idx_q:joint.idx_q + 2] = np.cos(place), np.sin(place)
            else:
                q[joint.idx_q] = place
            speed[joint.idx_v], rate[joint.idx_v] = state
        torque = pin.rnea(model, model.createData(), q, speed, rate)
        torques.append([torque[joint.idx_v] for joint in joints])
    return np.array(torques)


@pytest.mark.slow
def test_torques_of_public_robots_are_those_of_pinocchio():
    pin = pytest.importorskip("pinocchio")
    compared = 0
    for path in robots():
        description = describe_urdf(path)
        held = {joint.name: 0.0 for joint in description.joints if joint.obstacle}
        if path.name in REFUSED:
            with pytest.raises(ClieError, match=REFUSED[path.name]):
                tree(description.bodies(locked=held))
            continue
        links = tree(description.bodies(locked=held))
        motions = np.random.default_rng(0).normal(size=(3, 3, links.n))
        expected = torques_of_pinocchio(pin, path, held, links.names, motions)
        np.testing.assert_allclose([inverse_dynamics(links, *motion) for motion in motions],
                                   expected, rtol=0, atol=1e-9 * np.abs(expected).max(),
                                   err_msg=path.name)
        compared += 1
    assert compared >= 60
