"""True parameters of a robot, by name; the neutral value of each is that of a healthy robot.

Torques [N m] are of the motor side, angles [rad] of the joint.
"""

import numpy as np

G = 9.81  # m/s^2

NEUTRAL = {
    # joint
    "rotor": 0.0, "drag": 0.0, "offset": 0.0,
    # friction at the motor
    "level": 0.0, "static": 1.0, "stribeck": 1.0, "bias": 0.0, "quadratic": 0.0, "slope": 0.0,
    "bristle": 0.0, "bristle_range": 1.0, "wavy_level": 0.0, "wavy_drag": 0.0, "waves": 1.0,
    "warm_drag": 0.0, "warm_level": 0.0, "warm_time": 1.0,
    "uneven_level": 0.0, "uneven": 0.0,  # dry friction that repeats with the angle
    "dahl": 0.0, "dahl_reach": 1.0, "dahl_exponent": 1.0,
    "slip": 0.0, "slip_reach": 1.0,  # elements that slip one after another
    "rest_rise": 0.0, "rest_half": 1.0, "rest_speed": 1.0, "rest_slide": 1.0,
    "driving_loss": 0.0, "driven_loss": 0.0,  # of the gear, as shares of the motor's torque
    "brake": 0.0,  # level of a brake that drags now and then
    # load
    "links": 1.0, "heavier": 0.0,  # than stated, relative
    "tilt": 0.0, "payload": 0.0, "stiffness": 0.0, "rest": 0.0, "stop": np.inf,
    "stop_stiffness": 0.0, "hard_stop": np.inf, "wall": 0.0, "wandering": 0.0,
    "base_tilt": 0.0, "balance": 0.0, "balance_angle": 0.0, "balance_slack": 0.0, "fluid": 0.0,
    "hose": 0.0, "hose_time": 1.0, "neighbour": 0.0, "detent": 0.0, "detent_teeth": 1.0,
    "slosh": 0.0, "slosh_length": 1.0, "link_stiffness": 0.0, "mount_stiffness": 0.0,
    # transmission
    "twist_stiffness": 0.0, "twist_damping": 0.0, "half_gap": 0.0,
    "twist_knee": np.inf, "twist_slip": 0.0, "twist_slip_stiffness": 0.0,
    "wobble": 0.0, "wobble_order": 1.0, "mesh": 0.0, "mesh_depth": 0.0, "teeth": 1.0,
    "travel_of_neighbour": 0.0, "ratio_error": 0.0,
    # drive
    "limit": np.inf, "dead": 0.0, "lag": 0.0, "delay": 0.0, "gain": 1.0, "ripple": 0.0,
    "poles": 1.0, "phase": 0.0, "lost": 0.0, "heating": 0.0, "heating_time": 1.0,
    "sag": 0.0, "source_sag": 0.0, "quantum": 0.0, "peak": np.inf, "droop": 0.0,
    "phase_gain": 0.0, "pole_pairs": 1.0, "back_emf": 0.0, "jitter": 0.0, "beat": 1.0,
    "hold": 0.0, "hold_interval": 1.0, "torque_slew": np.inf, "brush": 0.0,
    # sensor and controller
    "step": 0.0, "late": 0.0, "eccentric": 0.0, "corner": 1.0, "integral": 0.0, "kp_factor": 1.0,
    "behind": 0.0, "kd_factor": 1.0, "zero": 0.0, "lost_counts": 0.0, "slew": np.inf,
    "reference_delay": 0.0, "stale": 0.0, "reference_speed": 0.0, "estimate_lag": 0.0,
    "compensated_weight": 0.0, "compensated_friction": 0.0, "compensated_speed": 1.0,
    "carried_links": 0.0,  # masses by which the law adds the weight of a planar chain, of stated
    # log
    "skew": 0.0, "logged_gain": 1.0,
    # time
    "tone": 0.0, "tone_hz": 1.0, "fault_torque": 0.0, "fault_level": 0.0, "fault_drag": 0.0,
    "fault_share": 0.5, "random": 0.0, "imbalance": 0.0, "imbalance_hz": 1.0}

DRY_FRICTION = ("level", "slope", "wavy_level", "warm_level", "fault_level", "uneven_level",
                "rest_rise", "driven_loss", "brake")  # what the engine holds as dry friction
Parameters = dict[str, np.ndarray]


def healthy_parameters(n: int) -> Parameters:
    """Parameters of a healthy robot, by name, each of shape (n,)."""
    return {key: np.full(n, value) for key, value in NEUTRAL.items()}
