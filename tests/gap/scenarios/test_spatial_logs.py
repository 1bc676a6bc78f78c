"""A leg of a robot in space: its public log beside the URDF that others publish of it."""

import importlib.metadata
from pathlib import Path

import numpy as np
import pytest

from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.checks.link_model import check_link_model
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.robot_sections import Links
from clie_blocks.rigid_body.model_file import read_model

JOINTS = "FL_hip_joint", "FL_thigh_joint", "FL_calf_joint"
KP, KD = 20.0, 1.5  # N m/rad, N m s/rad, as the authors of the log publish


def public_urdf(name):
    """File of the package example-robot-data, which has data and no module."""
    try:
        files = importlib.metadata.files("example-robot-data") or []
    except importlib.metadata.PackageNotFoundError:
        pytest.skip("example-robot-data is not installed")
    return next(Path(file.locate()).resolve() for file in files if file.name == name)


def leg(shared, sign=(1, 1, 1), gravity=(0.0, 0.0, -9.81)):
    """Front left leg, with the command that its law gives on the logged positions."""
    log = np.genfromtxt(shared / "data" / "go2" / "traj_0.csv.gz", delimiter=",", skip_header=1)
    time, q, qd = log[:, 0], log[:, 1:4], log[:, 13:16]
    rate = np.vstack([np.zeros(3), np.diff(q, axis=0)]) / np.median(np.diff(time))
    tree = read_model(public_urdf("go2.urdf"), "base", "FL_foot", sign=sign, gravity=gravity)
    robot = Robot(3, joints=JOINTS, tree=tree, links=Links(model="go2.urdf"),
                  controller=Controller(kp=np.full(3, KP), kd=np.full(3, KD)))
    return Record(time=time, q=q, qd=qd, u=KP * (qd - q) - KD * rate, joints=JOINTS), robot


@pytest.mark.slow
def test_the_urdf_of_the_leg_counts_as_its_log_does(shared):
    assert check_link_model(*leg(shared)) == []


@pytest.mark.slow
def test_a_leg_whose_base_is_upside_down_is_named(shared):
    (found,) = check_link_model(*leg(shared, gravity=(0.0, 0.0, 9.81)))
    assert found.check in ("links.joints", "links.opposed")
