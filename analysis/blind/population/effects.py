"""The hidden effects: what each changes in a robot's true numbers, as a function of its size.

`EFFECTS` are in the vocabulary of the diagnosis, `OUTSIDERS` are not.  An effect is drawn once
and then scaled: size 1 bends the motion by some tenths of a milliradian to a few milliradians.
"""

from dataclasses import dataclass

import numpy as np

from clie_blocks.analysis.blind.engine.robot import G
from clie_blocks.analysis.blind.engine.world import tip_way


@dataclass(frozen=True, eq=False)
class Hidden:
    """A drawn effect.

    Parameters
    ----------
    name : str
        Its name.
    joints : tuple of int
        Where it acts, counted from 1; empty for the robot as a whole.
    change : callable
        Size to ``{number: value}``; values are (n,) arrays.

    """

    name: str
    joints: tuple
    change: object

    def onto(self, truth, size):
        """True numbers with the effect at a size."""
        return {**truth, **self.change(size)}


@dataclass(frozen=True, eq=False)
class Scene:
    """Where an effect is drawn.

    Parameters
    ----------
    robot : Robot
        The robot.
    truth : dict
        Its numbers without the effect.
    runs : list of (q, u)
        What it does without the effect.
    joint : int
        Joint that is hit.

    """

    robot: object
    truth: dict
    runs: list
    joint: int

    @property
    def torque(self):
        """Torque that bends the set-point by a milliradian, shape (n,) [N m, motor side]."""
        return 1e-3 * self.robot.kp

    @property
    def loudest(self):
        """Largest command without the effect, shape (n,) [N m]."""
        return np.max([np.abs(u).max(axis=0) for _, u in self.runs], axis=0)

    @property
    def power(self):
        """Mean square of the command without the effect, shape (n,) [(N m)^2]."""
        return np.mean([np.mean(u**2, axis=0) for _, u in self.runs], axis=0)

    @property
    def farthest(self):
        """Largest angle without the effect, shape (n,) [rad]."""
        return np.max([q.max(axis=0) for q, _ in self.runs], axis=0)

    def at(self, key, value):
        """Numbers ``key`` with a value at the joint that is hit, else as they were."""
        numbers = self.truth[key].copy()
        numbers[self.joint] = np.broadcast_to(value, numbers.shape)[self.joint]
        return {key: numbers}


def draw_hidden(rng, name, scene):
    """Draw an effect at the joint of a scene.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of chance.
    name : str
        Of `EFFECTS` or `OUTSIDERS`.
    scene : Scene
        Where.

    """
    draw = {**EFFECTS, **OUTSIDERS}[name]
    joints = () if name in WHOLE_ROBOT else (scene.joint + 1,)
    return Hidden(name, joints, draw(rng, scene))


def _scaled(scene, key, unit, **fixed):
    """Change that grows in proportion to the size."""
    def change(size):
        found = scene.at(key, size * np.asarray(unit))
        for other, value in fixed.items():
            found |= scene.at(other, value)
        return found
    return change


def _coulomb(rng, scene):
    return _scaled(scene, "level", scene.torque)


def _stribeck(rng, scene):
    return _scaled(scene, "level", scene.torque, static=rng.uniform(1.5, 2.2),
                   stribeck=rng.uniform(0.01, 0.05))


def _asymmetric(rng, scene):
    share = rng.choice([-1, 1]) * rng.uniform(0.4, 0.9)
    return lambda size: (scene.at("level", size * scene.torque)
                         | scene.at("bias", share * size * scene.torque))


def _quadratic(rng, scene):
    return _scaled(scene, "quadratic", scene.torque / 0.1)


def _load_dependent(rng, scene):
    return _scaled(scene, "slope", 0.01)


def _presliding(rng, scene):
    return _scaled(scene, "bristle", scene.torque,
                   bristle_range=np.exp(rng.uniform(np.log(2e-3), np.log(2e-2))))


def _drift(rng, scene):
    key = str(rng.choice(["warm_drag", "warm_level"]))
    unit = scene.torque / 0.3 if key == "warm_drag" else scene.torque
    return _scaled(scene, key, unit, warm_time=rng.uniform(4.0, 12.0))


def _gravity(rng, scene):
    return lambda size: {"tilt": np.full(scene.robot.n, 2e-3 * size)}


def _payload(rng, scene):
    robot, unit = scene.robot, 0.0
    if robot.gravity:
        unit = np.min(scene.torque * robot.ratio / (G * robot.length.sum()))
    else:
        unit = np.min(0.01 * robot.kp * robot.ratio / 36.0 / robot.length.sum() ** 2)
    last = np.zeros(robot.n)
    last[-1] = unit
    return lambda size: {"payload": size * last}


def _coupling(rng, scene):
    """Links that pull at each other: a share of those drawn, the heavier the larger."""
    return lambda size: {"links": np.full(scene.robot.n, min(0.1 * size, 1.5))}


def _spring(rng, scene):
    robot = scene.robot
    return _scaled(scene, "stiffness", 3e-3 * robot.kp * robot.ratio,
                   rest=robot.pose + rng.uniform(-0.3, 0.3, robot.n))


def _elastic(rng, scene):
    robot = scene.robot
    ratio = rng.uniform(0.03, 0.08)

    def change(size):
        stiffness = 150.0 / size * robot.kp * robot.ratio
        return (scene.at("twist_stiffness", stiffness)
                | scene.at("twist_damping", 2 * ratio * np.sqrt(stiffness * robot.link)))
    return change


def _backlash(rng, scene):
    return _scaled(scene, "half_gap", 5e-4)


def _saturation(rng, scene):
    return lambda size: scene.at("limit", scene.loudest / (1 + 0.15 * size))


def _delay(rng, scene):
    """A drive that acts late, or an encoder that answers late."""
    return _scaled(scene, str(rng.choice(["delay", "delay", "late"])), 1e-3)


def _ripple(rng, scene):
    """A harmonic of the motor's turn, high enough to show within the travel."""
    poles = rng.integers(1, 4) + np.floor(8.0 / scene.robot.ratio[scene.joint])
    return _scaled(scene, "ripple", scene.torque, phase=rng.uniform(0, 6.28), poles=poles)


def _tone(rng, scene):
    return _scaled(scene, "tone", scene.torque, phase=rng.uniform(0, 6.28),
                   tone_hz=np.exp(rng.uniform(np.log(0.3), np.log(4.0))))


def _fault(rng, scene):
    kinds = ("fault_torque", 1.0), ("fault_level", 1.0), ("fault_drag", 3.0)
    key, unit = kinds[rng.integers(3)]
    return _scaled(scene, key, unit * scene.torque, fault_share=rng.uniform(0.3, 0.7))


def _hard_stop(rng, scene):
    """End of the travel a little before the farthest angle."""
    return lambda size: scene.at("hard_stop", scene.farthest - 1e-3 * size)


def _wall(rng, scene):
    """Wall that the tip meets a little before the end of its way."""
    robot = scene.robot
    at, along = tip_way(robot)
    angles = [np.cumsum(q, axis=1) for q, _ in scene.runs]
    ways = [(np.cos(a) @ robot.length - at[0]) * along[0]
            + (np.sin(a) @ robot.length - at[1]) * along[1] for a in angles]
    farthest = max(way.max() for way in ways)
    return lambda size: {"wall": np.full(
        robot.n, max(farthest - 1e-3 * size * robot.length.sum(), 1e-6))}


def _gap_at(key, unit, **fixed):
    return lambda rng, scene: _scaled(scene, key, unit, **fixed)


EFFECTS = {
    "coulomb": _coulomb, "stribeck": _stribeck, "asymmetric_coulomb": _asymmetric,
    "quadratic_drag": _quadratic, "load_dependent_friction": _load_dependent,
    "presliding": _presliding, "friction_drift": _drift,
    "gravity": _gravity, "payload": _payload, "coupling": _coupling, "spring": _spring,
    "joint_elasticity": _elastic, "backlash": _backlash,
    "actuator_saturation": _saturation,
    "dead_zone": lambda rng, scene: _scaled(scene, "dead", scene.torque),
    "actuator_lag": _gap_at("lag", 1e-3), "time_delay": _delay,
    "torque_ripple": _ripple,
    "torque_gain_error": lambda rng, scene: lambda size: scene.at("gain", 1 + 0.02 * size),
    "encoder_quantization": _gap_at("step", 3e-4),
    "encoder_eccentricity": lambda rng, scene: _scaled(scene, "eccentric", 2e-4,
                                                       phase=rng.uniform(0, 6.28)),
    "velocity_filter_mismatch":
        lambda rng, scene: lambda size: scene.at("corner", 1 / (1 + 0.1 * size)),
    "periodic_disturbance": _tone, "step_fault": _fault}

OUTSIDERS = {
    "random_torque": lambda rng, scene: _scaled(scene, "random", scene.torque),
    "packet_loss": _gap_at("lost", 0.01),
    "position_friction": lambda rng, scene: _scaled(
        scene, "wavy_level", 2 * scene.torque, waves=rng.uniform(6, 12),
        phase=rng.uniform(0, 6.28)),
    "wavy_damping": lambda rng, scene: _scaled(
        scene, "wavy_drag", 5 * scene.torque, waves=rng.uniform(4, 8),
        phase=rng.uniform(0, 6.28)),
    "wandering_stiffness": lambda rng, scene: _scaled(
        scene, "wandering", 10 * scene.torque, rest=scene.robot.pose),
    "soft_stop": lambda rng, scene: _scaled(
        scene, "stop_stiffness", 20 * scene.torque,
        stop=scene.robot.pose + rng.uniform(0.05, 0.12)),
    "hard_stop": _hard_stop, "wall": _wall,
    "motor_heating": lambda rng, scene: _scaled(
        scene, "heating", 0.02 / scene.power, heating_time=rng.uniform(3.0, 10.0)),
    "supply_sag": _gap_at("sag", 0.02),
    "hidden_integral": lambda rng, scene: _scaled(scene, "integral", 0.02 * scene.robot.kp),
    "gain_scaling": lambda rng, scene: lambda size: scene.at("kp_factor", 1 + 0.01 * size)}

WHOLE_ROBOT = ("gravity", "payload", "coupling", "wall")
NEEDS = {  # kinds of robot; whether it hangs in gravity; whether its coupling is known
    "gravity": (("arm", "pendulum"), False, True), "payload": (("arm", "pendulum"), None, True),
    "coupling": (("arm",), False, False), "wall": (("arm", "pendulum"), None, True),
    "load_dependent_friction": (("arm", "pendulum"), True, True)}
