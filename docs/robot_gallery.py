"""Write the models of `clie robot --gallery` as URDF: ``python docs/robot_gallery.py``.

A row of a table is one joint and the link that it moves.  Tables in Denavit-Hartenberg parameters
are turned into frames that sit on the joint, which turns about its z axis.
"""

from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import NamedTuple

import numpy as np

from clie_blocks.analysis.records.gallery import FOLDER
from clie_blocks.output import run_main, write

TURN, QUARTER = 2 * np.pi, np.pi / 2
Z = (0.0, 0.0, 1.0)
Vector = tuple[float, float, float]


class Row(NamedTuple):
    """A joint, and the link behind it in the frame of the joint: SI units, rpy as in URDF."""

    joint: str
    xyz: Vector
    rpy: Vector
    mass: float
    com: Vector
    moments: Vector  # xx, yy, zz about the centre of mass
    products: Vector = (0.0, 0.0, 0.0)  # xy, xz, yz
    limits: tuple[float, float, float, float] = (-TURN, TURN, 0.0, 0.0)  # rad, N m, rad/s
    axis: Vector = Z


@dataclass(frozen=True)
class Arm:
    """Rows of an arm, where it ends, and where the numbers come from."""

    source: str
    rows: tuple[Row, ...]
    flange: Vector
    flange_rpy: Vector = (0.0, 0.0, 0.0)


def cylinder(mass: float, radius: float, length: float, along: int) -> Vector:
    """Moments of inertia of a solid cylinder along one axis [kg m^2]."""
    across = mass * (3 * radius**2 + length**2) / 12
    return tuple(mass * radius**2 / 2 if k == along else across for k in range(3))


def universal_robot(links: tuple[tuple[float, ...], ...], efforts: tuple[float, ...],
                    velocities: tuple[float, ...]) -> Arm:
    """Arm of Universal Robots: a, d, alpha in quarter turns, mass, centre of mass, radius, length.

    They state a centre in the frame of its link, which lies d along z, a along x and alpha about
    x behind the joint; inertias are those of solid cylinders of the size of the link.
    """
    names = "shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"
    along = 1, 0, 0, 1, 1, 2
    rows, place, roll = [], (0.0, 0.0, 0.0), 0.0
    for k, (a, d, alpha, mass, x, y, z, radius, length) in enumerate(links):
        turned = {0: (x, y, z), 1: (x, -z, y), -1: (x, z, -y)}[round(alpha)]
        com = tuple(round(float(v), 6) for v in np.add((a, 0.0, d), turned))
        rows.append(Row(names[k], place, (roll, 0.0, 0.0), mass, com,
                        cylinder(mass, radius, length, along[k]),
                        limits=(-TURN, TURN, efforts[k], velocities[k])))
        place, roll = (a, 0.0, d), QUARTER * alpha
    return Arm(UR_SOURCE, tuple(rows), place, (roll, 0.0, 0.0))


UR_SOURCE = (
    'Universal Robots, support article "DH Parameters for calculations of kinematics and '
    'dynamics" (2022): DH parameters, masses, centres of mass. Torques: their article "Max. joint '
    'torques" (2020). Moments of inertia are not published: these are solid cylinders, their '
    "sizes from the ur_description of ROS-Industrial (2021).")

ARMS = {
    "ur5e": universal_robot((
        (0.0, 0.1625, 1, 3.761, 0.0, -0.02561, 0.00193, 0.060, 0.15),
        (-0.425, 0.0, 0, 8.058, 0.2125, 0.0, 0.11336, 0.060, 0.425),
        (-0.3922, 0.0, 0, 2.846, 0.15, 0.0, 0.0265, 0.060, 0.3922),
        (0.0, 0.1333, 1, 1.37, 0.0, -0.0018, 0.01634, 0.060, 0.12),
        (0.0, 0.0997, -1, 1.3, 0.0, 0.0018, 0.01634, 0.060, 0.12),
        (0.0, 0.0996, 0, 0.365, 0.0, 0.0, -0.001159, 0.0375, 0.0458)),
        3 * (150.0,) + 3 * (28.0,), 6 * (3.14159,)),
    "ur10e": universal_robot((
        (0.0, 0.1807, 1, 7.369, 0.021, 0.0, 0.027, 0.075, 0.178),
        (-0.6127, 0.0, 0, 13.051, 0.38, 0.0, 0.158, 0.075, 0.612),
        (-0.57155, 0.0, 0, 3.989, 0.24, 0.0, 0.068, 0.075, 0.57155),
        (0.0, 0.17415, 1, 2.1, 0.0, 0.007, 0.018, 0.075, 0.12),
        (0.0, 0.11985, -1, 1.98, 0.0, 0.007, 0.018, 0.075, 0.12),
        (0.0, 0.11655, 0, 0.615, 0.0, 0.0, -0.026, 0.045, 0.05)),
        (330.0, 330.0, 150.0, 56.0, 56.0, 56.0), 2 * (2.0944,) + 4 * (3.14159,)),
    "panda": Arm(
        "Gaz, Cognetti, Oliva, Robuffo Giordano, De Luca, Dynamic Identification of the Franka "
        "Emika Panda Robot, IEEE RA-L 4(4), 2019: masses, centres of mass and inertias, as "
        "franka_ros lists them. Frames, limits, torques: Franka Control Interface, Robot and "
        "interface specifications (2022).", (
            Row("joint1", (0, 0, 0.333), (0, 0, 0), 4.970684, (0.003875, 0.002081, -0.04762),
                (0.70337, 0.70661, 0.009117),
                (-0.000139, 0.006772, 0.019169),
                (-2.8973, 2.8973, 87, 2.175)),
            Row("joint2", (0, 0, 0), (-QUARTER, 0, 0), 0.646926, (-0.003141, -0.02872, 0.003495),
                (0.007962, 0.02811, 0.025995), (-0.003925, 0.010254, 0.000704),
                (-1.7628, 1.7628, 87, 2.175)),
            Row("joint3", (0, -0.316, 0), (QUARTER, 0, 0), 3.228604,
                (0.027518, 0.039252, -0.066502), (0.037242, 0.036155, 0.01083),
                (-0.004761, -0.011396, -0.012805),
                (-2.8973, 2.8973, 87, 2.175)),
            Row("joint4", (0.0825, 0, 0), (QUARTER, 0, 0), 3.587895,
                (-0.05317, 0.104419, 0.027454), (0.025853, 0.019552, 0.028323),
                (0.007796, -0.001332, 0.008641),
                (-3.0718, -0.0698, 87, 2.175)),
            Row("joint5", (-0.0825, 0.384, 0), (-QUARTER, 0, 0), 1.225946,
                (-0.011953, 0.041065, -0.038437), (0.035549, 0.029474, 0.008627),
                (-0.002117, -0.004037, 0.000229), (-2.8973, 2.8973, 12, 2.61)),
            Row("joint6", (0, 0, 0), (QUARTER, 0, 0), 1.666555, (0.060149, -0.014117, -0.010517),
                (0.001964, 0.004354, 0.005433), (0.000109, -0.001158, 0.000341),
                (-0.0175, 3.7525, 12, 2.61)),
            Row("joint7", (0.088, 0, 0), (QUARTER, 0, 0), 0.735522,
                (0.010517, -0.004252, 0.061597), (0.012516, 0.010027, 0.004815),
                (-0.000428, -0.001196, -0.000741),
                (-2.8973, 2.8973, 12, 2.61))), (0, 0, 0.107)),
    "xarm7": Arm(
        "UFACTORY, xarm_ros (xarm_description, 2023): frames, masses, centres of mass, inertias, "
        "limits, torques. Masses and centres also in their article Kinematic and Dynamic "
        "Parameters of UFACTORY xArm Series: other serial numbers are up to 4 % heavier.", (
            Row("joint1", (0, 0, 0.267), (0, 0, 0), 2.382, (-0.0002, 0.02905, -0.01233),
                (0.0056905, 0.0049566, 0.003316654), (-1.579e-05, 5.125e-06, -0.000873378),
                (-TURN, TURN, 50, 3.14)),
            Row("joint2", (0, 0, 0), (-QUARTER, 0, 0), 1.869, (0.00022, -0.12856, 0.01735),
                (0.0095989, 0.00382472, 0.007565669), (1.541e-06, 5.56e-06, -0.00317156),
                (-2.059, 2.0944, 50, 3.14)),
            Row("joint3", (0, -0.293, 0), (QUARTER, 0, 0), 1.6383, (0.0466, -0.02463, -0.00768),
                (0.00310955, 0.00264483, 0.0026624), (0.00030837, -0.00058453, 0.000338893),
                (-TURN, TURN, 30, 3.14)),
            Row("joint4", (0.0525, 0, 0), (QUARTER, 0, 0), 1.7269, (0.07047, -0.11575, 0.012),
                (0.005889, 0.00359703, 0.00543244), (0.00137112, 0.00088143, -0.001762155),
                (-0.19198, 3.927, 30, 3.14)),
            Row("joint5", (0.0775, -0.3425, 0), (QUARTER, 0, 0), 1.3203,
                (-0.00032, 0.01604, -0.026), (0.00534665, 0.0049779, 0.0013624),
                (1.5117e-05, -3.69e-07, -0.00022132), (-TURN, TURN, 30, 3.14)),
            Row("joint6", (0, 0, 0), (QUARTER, 0, 0), 1.325, (0.06469, 0.03278, 0.02141),
                (0.0014745, 0.0019037, 0.0023652), (-0.000488, 0.0002953, 0.00014749),
                (-1.69297, np.pi, 20, 3.14)),
            Row("joint7", (0.076, 0.097, 0), (-QUARTER, 0, 0), 0.17, (0, -0.00677, -0.01098),
                (9.3e-05, 5.87e-05, 0.000132), (0, 0, -3.6e-06), (-TURN, TURN, 20, 3.14))),
        (0, 0, 0)),
    "gen3": Arm(
        "Kinova, ros_kortex (kortex_description, 2019) and the User Guide of the Gen3, section "
        "on the dynamic parameters of the 7 DoF robot: frames, masses, centres of mass, inertias, "
        "limits, torques, without the vision module.", (
            Row("joint_1", (0, 0, 0.15643), (np.pi, 0, 0), 1.377, (-2.3e-05, -0.010364, -0.07336),
                (0.00457, 0.004831, 0.001409), (1e-06, 2e-06, 0.000448),
                (-TURN, TURN, 39, 1.3963)),
            Row("joint_2", (0, 0.005375, -0.12838), (QUARTER, 0, 0), 1.163,
                (-4.4e-05, -0.09958, -0.013278), (0.011088, 0.001072, 0.011255),
                (5e-06, 0, -0.000691), (-2.24, 2.24, 39, 1.3963)),
            Row("joint_3", (0, -0.21038, -0.006375), (-QUARTER, 0, 0), 1.163,
                (-4.4e-05, -0.006641, -0.117892), (0.010932, 0.011127, 0.001043),
                (0, -7e-06, 0.000606), (-TURN, TURN, 39, 1.3963)),
            Row("joint_4", (0, 0.006375, -0.21038), (QUARTER, 0, 0), 0.93,
                (-1.8e-05, -0.075478, -0.015006), (0.008147, 0.000631, 0.008316),
                (-1e-06, 0, -0.0005), (-2.57, 2.57, 39, 1.3963)),
            Row("joint_5", (0, -0.20843, -0.006375), (-QUARTER, 0, 0), 0.678,
                (1e-06, -0.009432, -0.063883), (0.001596, 0.001607, 0.000399),
                (0, 0, 0.000256), (-TURN, TURN, 9, 1.2218)),
            Row("joint_6", (0, 0.00017505, -0.10593), (QUARTER, 0, 0), 0.678,
                (1e-06, -0.045483, -0.00965), (0.001641, 0.00041, 0.001641),
                (0, 0, -0.000278), (-2.09, 2.09, 9, 1.2218)),
            Row("joint_7", (0, -0.10593, -0.00017505), (-QUARTER, 0, 0), 0.364,
                (-9.3e-05, 0.000132, -0.022905), (0.000214, 0.000223, 0.00024),
                (0, 1e-06, -2e-06), (-TURN, TURN, 9, 1.2218))), (0, 0, -0.061525), (np.pi, 0, 0)),
    "go2-leg": Arm(
        "Unitree Robotics, unitree_ros (go2_description, 2023): frames, masses, centres of mass, "
        "inertias, limits, torques of the front left leg. Its rotors are left to [motor].", (
            Row("hip", (0.1934, 0.0465, 0), (0, 0, 0), 0.678, (-0.0054, 0.00194, -0.000105),
                (0.00048, 0.000884, 0.000596), (-3.01e-06, 1.11e-06, -1.42e-06),
                (-1.0472, 1.0472, 23.7, 30.1), (1, 0, 0)),
            Row("thigh", (0, 0.0955, 0), (0, 0, 0), 1.152, (-0.00374, -0.0223, -0.0327),
                (0.00584, 0.0058, 0.00103), (8.72e-05, -0.000289, 0.000808),
                (-1.5708, 3.4907, 23.7, 30.1), (0, 1, 0)),
            Row("calf", (0, 0, -0.213), (0, 0, 0), 0.154, (0.00548, -0.000975, -0.115),
                (0.00108, 0.0011, 3.29e-05), (3.4e-07, 1.72e-05, 8.28e-06),
                (-2.7227, -0.83776, 45.43, 15.7), (0, 1, 0))), (0, 0, -0.213)),
    "so101": Arm(
        "TheRobotStudio, SO-ARM100, the SO-101 from CAD (2025): frames, masses, centres of mass, "
        "inertias, limits. Torque, speed: Feetech, datasheet of the STS3215 at 12 V, 30 kg cm and "
        "45 rpm.", (
            Row("shoulder_pan", (0.0388353, 0, 0.0624), (np.pi, 0, -np.pi), 0.100006,
                (-0.0307604, -1.66727e-05, -0.0252713), (8.3759e-05, 8.10403e-05, 2.39783e-05),
                (7.55525e-08, -1.16342e-06, 1.54663e-07), (-1.91986, 1.91986, 2.94, 4.71)),
            Row("shoulder_lift", (-0.0303992, -0.0182778, -0.0542), (-QUARTER, -QUARTER, 0), 0.103,
                (-0.0898471, -0.00838224, 0.0184089), (4.08002e-05, 0.000147318, 0.000142487),
                (-1.97819e-05, -4.03016e-08, 8.97326e-09), (-1.74533, 1.74533, 2.94, 4.71)),
            Row("elbow_flex", (-0.11257, -0.028, 0), (0, 0, QUARTER), 0.104,
                (-0.0980701, 0.00324376, 0.0182831), (2.87438e-05, 0.000159844, 0.00014529),
                (7.41152e-06, 1.26409e-06, -4.90188e-08), (-1.69, 1.69, 2.94, 4.71)),
            Row("wrist_flex", (-0.1349, 0.0052, 0), (0, 0, -QUARTER), 0.079,
                (-0.000103312, -0.0386143, 0.0281156), (3.68263e-05, 2.5391e-05, 2.1e-05),
                (1.7893e-08, -5.28128e-08, 3.6412e-06), (-1.65806, 1.65806, 2.94, 4.71)),
            Row("wrist_roll", (0, -0.0611, 0.0181), (QUARTER, 0.0486795, np.pi), 0.087,
                (0.000213627, 0.000245138, -0.025187), (2.75087e-05, 4.33657e-05, 3.45059e-05),
                (-3.35241e-07, -5.7352e-06, -5.17847e-08), (-2.74385, 2.84121, 2.94, 4.71)),
            Row("gripper", (0.0202, 0.0188, -0.0234), (QUARTER, 0, 0), 0.012,
                (-0.00157495, -0.0300244, 0.0192755), (6.61427e-06, 1.89032e-06, 5.28738e-06),
                (-3.19807e-07, -5.90717e-09, -1.09945e-07), (-0.174533, 1.74533, 2.94, 4.71))),
        (0, 0, 0))}


def urdf(name: str, arm: Arm) -> str:
    """Text of the URDF of an arm, with its source on top."""
    said = fill(arm.source, 95, initial_indent="     ", subsequent_indent="     ")
    lines = ['<?xml version="1.0"?>', f"<!-- Written by docs/robot_gallery.py.\n{said} -->",
             f'<robot name="{name}">', '  <link name="base"/>']
    before = "base"
    for row in arm.rows:
        lines += _joint(row, before)
        before = f"{row.joint}_link"
    return "\n".join([
        *lines, '  <link name="flange"/>',
        f'  <joint name="mount" type="fixed"><parent link="{before}"/><child link="flange"/>',
        f'    <origin xyz="{_numbers(arm.flange)}" rpy="{_numbers(arm.flange_rpy)}"/></joint>',
        "</robot>\n"])


def _joint(row: Row, before: str) -> list[str]:
    (xx, yy, zz), (xy, xz, yz) = row.moments, row.products
    lower, upper, effort, velocity = row.limits
    moments = " ".join(f'i{axes}="{value:.6g}"' for axes, value in
                       zip(("xx", "yy", "zz", "xy", "xz", "yz"), (xx, yy, zz, xy, xz, yz)))
    return [
        f'  <link name="{row.joint}_link"><inertial>',
        f'    <origin xyz="{_numbers(row.com)}"/><mass value="{row.mass:.9g}"/>',
        f"    <inertia {moments}/>", "  </inertial></link>",
        f'  <joint name="{row.joint}" type="revolute"><parent link="{before}"/>'
        f'<child link="{row.joint}_link"/>',
        f'    <origin xyz="{_numbers(row.xyz)}" rpy="{_numbers(row.rpy)}"/>'
        f'<axis xyz="{_numbers(row.axis)}"/>',
        f'    <limit lower="{lower:.6g}" upper="{upper:.6g}" effort="{effort:g}" '
        f'velocity="{velocity:g}"/>',
        "  </joint>"]


def _numbers(values: Vector) -> str:
    return " ".join(f"{value:.9g}" for value in values)


def main(argv: list[str] | None = None) -> None:
    """Write every arm beside its robot file."""
    for name, arm in ARMS.items():
        print(write(Path(FOLDER) / f"{name}.urdf", urdf(name, arm)))


if __name__ == "__main__":
    run_main(main)
