"""The paper's values: as printed, and as they follow where it contradicts its own definitions.

Source: "Stable Robot Manipulator Parameter Identification: A Closed-Loop Input Error Approach".
Parameter vectors are ordered ``[a1, a2, b1, b2, d1, d2]``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from clie_blocks.labels import PerJoint
from clie_blocks.manipulator import two_link_arm

if TYPE_CHECKING:
    import control as ct

# Section 5: the robot.  The link inertias are not printed; zero reproduces Tables 2 and 3 best.
MASS = np.array([0.5, 0.5])  # kg
LENGTH = np.array([0.6, 0.6])  # m
GEAR_RATIO = np.array([100.0, 100.0])
J_MOTOR = np.array([1 / 50, 1 / 50])  # kg m^2
B_MOTOR = np.array([1 / 25, 1 / 25])  # N m s/rad

# Section 5.1: gains, filters and noise.
KP = np.array([10.0, 10.0])  # N m/rad
KD = np.array([5.0, 5.0])  # N m s/rad
GAIN_PAIRS = ((10.0, 5.0), (8.0, 4.0), (12.0, 6.0))  # (kp, kd) for which mu_0 is printed
OMEGA_HIGHPASS, OMEGA_LOWPASS = 200.0, 300.0  # rad/s, G1 (47)
OMEGA_F = 300.0  # rad/s, G2 (34)
STEP = 1e-4  # s, with the solver ode5
NOISE_VARIANCE = 1e-6  # rad^2; printed 1e-3, which no result of the paper agrees with
NOISE_VARIANCE_PRINTED = 1e-3

# Not in the paper: the set-point of the identification and its duration.  The printed gain
# needs more than 300 s, the text says 100 s.
SET_POINT = np.array([np.pi / 3, np.pi / 4])  # rad
DURATION = 400.0  # s
DURATION_PRINTED = 100.0

# Table 1: adaptation gain and gain of the gradient method.
GAMMA = 20.0
ALPHA = {1: 0.0, 2: 1e-4, 3: 1e-3}

# Table 2: "approximate real values" and the mean estimates of the last 20 s.
THETA = np.array([1.9891, 1.9952, 0.4973, 0.4998, 0.0113, -0.0026])
THETA_HAT = {1: np.array([1.9839, 1.9926, 0.4964, 0.4983, 0.0132, -0.0018]),
             2: np.array([1.9855, 1.9943, 0.4964, 0.4983, 0.0129, -0.0021]),
             3: np.array([2.0015, 2.0103, 0.4968, 0.4985, 0.0098, -0.0050])}
# The column "|theta| (%)" is 100 times the absolute error, not a percentage.
ERROR_PRINTED = {1: np.array([0.52, 0.26, 0.09, 0.19, 0.05, 0.08]),
                 2: np.array([0.36, 0.09, 0.09, 0.15, 0.16, 0.05]),
                 3: np.array([1.24, 1.51, 0.05, 0.13, 0.15, 0.24])}
THETA_NAMES = ("a1", "a2", "b1", "b2", "d1", "d2")
THETA_UNITS = ("1/s", "1/s", "1/(kg m^2)", "1/(kg m^2)", "rad/s^2", "rad/s^2")

# Table 3: signed mean of the estimation error, its norm, mean squared tracking errors [rad^2].
EPS_MEAN = {1: (2.29e-5, 5.54e-6), 2: (2.23e-5, 5.66e-6), 3: (6.26e-5, 6.26e-5)}
EPS_NORM = {1: 2.36e-5, 2: 2.30e-5, 3: 8.86e-5}  # text; the table prints 2.39e-5 in CASE 1
TRACKING_MSE_PRINTED = {1: (1.468e-7, 9.342e-7), 2: (1.468e-7, 9.342e-7), 3: (1.481e-7, 9.342e-7)}
TRACKING_MSE = {1: (1.468e-4, 9.342e-4), 2: (1.468e-4, 9.342e-4), 3: (1.481e-4, 9.342e-4)}

# Sections 5.1 and 4.2: bounds and constants of the theorems.
ETA_NORM = 0.8768  # max over t of ||B PE - D||, (16)
MU_0 = {(10.0, 5.0): 0.9637, (8.0, 4.0): 0.9845, (12.0, 6.0): 0.9485}  # (18)
K_1_PRINTED, K_2, K_3_PRINTED, K_4 = 11.19, 5.0, 11.19, 5.0
K_1 = 6.189  # Theorem 2 as defined; the printed value forgets the -I of K_bar
K_3 = {2: 1e-4, 3: 1e-3}  # min{k_1, alpha}, which (A.11) needs; Theorem 4 prints a max
BOUND_31 = 1.67e-4  # sqrt(2) k_2 eps_bar, CASE 1
BOUND_46 = {2: 1.99e-4, 3: 7.67e-4}
RHO = 11.19

# Fig. 3: windows of the weighted excitation condition (49).
WINDOWS = ((0.0, 5.0), (5.0, 15.0), (15.0, 25.0), (25.0, 35.0), (35.0, 45.0), (45.0, 55.0))


def paper_arm(*, name: str = "plant") -> ct.NonlinearIOSystem:
    """The two-link arm of section 5 with its motors and gears, link inertias zero.

    Parameters
    ----------
    name : str
        Name of the block.

    Returns
    -------
    control.NonlinearIOSystem
        Inputs: u [N m].  Outputs: q [rad], dq [rad/s].

    """
    return two_link_arm(MASS, LENGTH, GEAR_RATIO, J_MOTOR, B_MOTOR, name=name)


def tracking_reference(t: PerJoint) -> np.ndarray:
    """Reference of the validation with (50): positions [rad] of both joints, section 5.2."""
    return np.array([np.sin(np.pi / 4 * t) / 2 + 3 * np.sin(np.pi / 3 * t) / 4,
                     np.sin(np.pi / 3 * t) / 10 + np.cos(np.pi / 4 * t) / 2])


def tracking_velocity(t: PerJoint) -> np.ndarray:
    """First derivative of `tracking_reference` [rad/s]."""
    v, w = np.pi / 4, np.pi / 3
    return np.array([v * np.cos(v * t) / 2 + 3 * w * np.cos(w * t) / 4,
                     w * np.cos(w * t) / 10 - v * np.sin(v * t) / 2])


def tracking_acceleration(t: PerJoint) -> np.ndarray:
    """Second derivative of `tracking_reference` [rad/s^2]."""
    v, w = np.pi / 4, np.pi / 3
    return np.array([-v**2 * np.sin(v * t) / 2 - 3 * w**2 * np.sin(w * t) / 4,
                     -w**2 * np.sin(w * t) / 10 - v**2 * np.cos(v * t) / 2])
