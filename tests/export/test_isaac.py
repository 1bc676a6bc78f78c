"""Isaac Lab: the actuator gives the numbers of the block in every environment by itself."""

import dataclasses
import sys
import types

import numpy as np
import pytest

from clie_blocks.analysis.export.core import core
from clie_blocks.analysis.export.correction import Correction
from clie_blocks.analysis.export.export import export
from clie_blocks.analysis.export.joint_block import joint_block
from clie_blocks.analysis.export.samples import draw, with_samples
from tests.export import robots
from tests.export.test_cores import MIXTURES, STEP, expected, signals

ENVIRONMENTS = 3


class Tensors(types.ModuleType):
    """Those functions of PyTorch that an actuator calls, on arrays of numpy."""

    @staticmethod
    def zeros(shape, dtype=np.float32, device=None):
        """Zeros, of single precision by default."""
        return np.zeros(shape, dtype)

    @staticmethod
    def tensor(value, dtype=None, device=None):
        """An array of its own."""
        return np.array(value, dtype)

    def __getattr__(self, name):
        return getattr(np, {"as_tensor": "asarray", "round": "rint"}.get(name, name))


class ActuatorBase:
    """What an actuator of Isaac Lab inherits, with the documented arguments."""

    def __init__(self, cfg, joint_names, joint_ids, num_envs, device, stiffness=0.0, damping=0.0,
                 armature=0.0, friction=0.0, effort_limit=np.inf, velocity_limit=np.inf):
        self.cfg, self.joint_names = cfg, joint_names
        like = sys.modules["torch"].zeros((num_envs, len(joint_names)), device=device)
        self.stiffness, self.damping = cfg.stiffness + like, cfg.damping + like
        self.effort_limit = effort_limit + like


@dataclasses.dataclass
class ActuatorBaseCfg:
    """What its configuration inherits."""

    joint_names_expr: list = dataclasses.field(default_factory=list)


@dataclasses.dataclass
class Action:
    """What comes from the controller: shapes (environments, joints)."""

    joint_positions: object
    joint_velocities: object
    joint_efforts: object


@pytest.fixture(params=["stand-in", "torch"])
def torch(request, monkeypatch):
    """PyTorch, or the stand-in for it, beside one for Isaac Lab."""
    found = (Tensors("torch") if request.param == "stand-in" else
             pytest.importorskip("torch", reason="needs torch"))
    actuators, utils = types.ModuleType("actuators"), types.ModuleType("utils")
    actuators.ActuatorBase, actuators.ActuatorBaseCfg = ActuatorBase, ActuatorBaseCfg
    utils.configclass = lambda one: dataclasses.dataclass(one, kw_only=True)
    for name, module in (("torch", found), ("isaaclab", types.ModuleType("isaaclab")),
                         ("isaaclab.actuators", actuators), ("isaaclab.utils", utils)):
        monkeypatch.setitem(sys.modules, name, module)
    return found


def actuator(correction, physics_step=STEP, step=STEP, names=None, **changes):
    """The actuator of a correction, as Isaac Lab makes it."""
    module = types.ModuleType("corrected_actuators")
    exec(export(correction, "isaac", step=step).files["corrected_actuators.py"], vars(module))
    cfg = module.CorrectedActuatorCfg(joint_names_expr=list(module.JOINTS),
                                      physics_step=physics_step, **changes)
    return cfg.class_type(cfg, names or list(module.JOINTS), slice(None), ENVIRONMENTS, "cpu")


def step(torch, one, q, dq, effort, other=0.0):
    """Efforts of one step, from columns per joint, shape (environments, joints)."""
    one.tau_other = torch.as_tensor(np.array(other + 0.0 * q, float))
    q, dq, effort = (torch.as_tensor(np.array(value, float)) for value in (q, dq, effort))
    return np.asarray(one.compute(Action(q, dq, effort), q, dq).joint_efforts)


def batch(count):
    """Random inputs, others in every environment, shape (environments, N, 4)."""
    return np.array([signals(count * ENVIRONMENTS)[k::ENVIRONMENTS]
                     for k in range(ENVIRONMENTS)])


@pytest.mark.parametrize("names", [*MIXTURES, ("load_dependent_friction", "actuator_lag")],
                         ids=" ".join)
def test_every_environment_gives_the_numbers_of_the_block(torch, names):
    correction = robots.of_links(*map(robots.setting, names), gain=2.0, torque=3.0,
                                 command=0.5, zero=0.1, inertia=0.06, before={
                                     "gear": 1.0, "gain": 2.0})
    one, rows = actuator(correction), batch(40)
    made = core(joint_block(correction, 0, STEP))
    wanted = np.array([expected(made, env * [1.0, 1.0, 0.5, 1.0]) for env in rows])
    for i in range(20):
        found = step(torch, one, *(rows[:, i, k, None] for k in range(4)))
        np.testing.assert_allclose(found[:, 0], wanted[:, i, 0], rtol=1e-11, atol=1e-11)
        np.testing.assert_allclose(np.asarray(one.measured)[:, 0], wanted[:, i, 5], rtol=1e-11)
    one.reset([1])  # this one begins again, the others go on
    again = expected(made, rows[1, 20:] * [1.0, 1.0, 0.5, 1.0])
    for i in range(20):
        found = step(torch, one, *(rows[:, 20 + i, k, None] for k in range(4)))
        np.testing.assert_allclose(found[[0, 2], 0], wanted[[0, 2], 20 + i, 0], rtol=1e-11,
                                   atol=1e-11)
        np.testing.assert_allclose(found[1, 0], again[i, 0], rtol=1e-11, atol=1e-11)


def test_every_joint_has_its_own_block_by_its_name(torch):
    both = Correction((robots.joint(), robots.joint(name="j2", damping=0.3)), 1e-3, ())
    one = actuator(both, names=["joint_2", "j1"], logged={"joint_2": "j2"})
    found = step(torch, one, np.zeros((3, 2)), np.ones((3, 2)), np.zeros((3, 2)))
    np.testing.assert_allclose(found, [[-0.3 - robots.LOAD, -robots.DAMPING - robots.LOAD]] * 3)
    with pytest.raises(ValueError, match="'elbow' is not corrected; those are"):
        actuator(both, names=["elbow"])
    with pytest.raises(ValueError, match="no whole number"):
        actuator(both, physics_step=1.5 * STEP)


def test_a_law_of_its_own_comes_first_and_keeps_to_the_limit_of_the_effort(torch):
    one = actuator(robots.correction(offset=0.0, damping=0.0), stiffness=4.0, damping=0.5)
    q, dq, target = (torch.as_tensor(np.full((3, 1), value)) for value in (0.2, 1.0, 1.2))
    np.testing.assert_allclose(one.compute(Action(target, 0 * dq, None), q, dq).joint_efforts,
                               np.full((3, 1), 3.5))
    one.effort_limit = torch.as_tensor(np.full((3, 1), 2.0))
    np.testing.assert_allclose(one.compute(Action(target, 0 * dq, None), q, dq).joint_efforts,
                               np.full((3, 1), 2.0))


def test_friction_stops_a_joint_within_a_long_step_of_the_physics(torch):
    """Friction of many short steps in one: a creeping joint stops, and does not swing."""
    one = actuator(robots.correction(robots.setting("coulomb"), offset=0.0, damping=0.0),
                   physics_step=10 * STEP)
    q, dq = np.zeros((3, 1)), np.array([[0.02], [-0.01], [1.0]])
    effort = step(torch, one, q, dq, 0.0 * q)
    after = dq + 10 * STEP / robots.INERTIA * effort
    np.testing.assert_allclose(after[:2], 0.0, atol=1e-12)
    np.testing.assert_allclose(effort[2], -0.1)


@pytest.mark.parametrize("name, inertia", [
    (None, robots.INERTIA), ("coulomb", robots.INERTIA), ("stribeck", robots.INERTIA),
    ("backlash", robots.INERTIA - robots.MOTOR["motor_inertia"])])
def test_a_joint_driven_by_it_moves_as_the_corrected_robot(torch, name, inertia):
    """Blocks of 0.25 ms in a physics of 1 ms, which is of first order: 4.6e-4 rad by itself."""
    effects = [robots.setting(name)] if name else []
    one = actuator(robots.correction(*effects), physics_step=STEP, step=STEP / 4)
    wanted = robots.reference(effects, robots.set_points(0.5))
    q, dq, last, found = 0.0, 0.0, 0.0, []
    for q_d in robots.set_points(0.5):
        found.append(q)
        u, last = robots.KP * (q_d - q) - robots.KD * (q - last) / robots.PERIOD, q
        column = np.ones((ENVIRONMENTS, 1))
        dq += STEP / inertia * step(torch, one, q * column, dq * column, u * column)[2, 0]
        q += STEP * dq
    assert np.sqrt(np.mean((found - wanted) ** 2)) < 6e-4
    if name:
        moved = wanted - robots.reference([], robots.set_points(0.5))
        assert np.sqrt(np.mean(moved ** 2)) > 1.5e-3


class Scene(dict):
    """Robots by name, in some environments."""

    num_envs = ENVIRONMENTS


class Robot:
    """What an event term reads and writes of an articulation, with the documented arguments."""

    device = "cpu"

    def __init__(self, one, armature=0.5):
        self.actuators, self.written = {"corrected": one}, None
        names = ["other", *one.joint_names]
        self.data = types.SimpleNamespace(default_joint_armature=sys.modules["torch"].as_tensor(
            np.full((ENVIRONMENTS, len(names)), armature)))
        self.find_joints = lambda wanted, preserve_order: (
            [names.index(name) for name in wanted], wanted)

    def write_joint_armature_to_sim(self, armature, joint_ids, env_ids):
        """Keep what was written."""
        self.written = np.asarray(armature), joint_ids, np.asarray(env_ids)


def events_of(torch, monkeypatch):
    """A correction, its draws, the export with them, and the module of the event term."""
    correction = dataclasses.replace(robots.correction(robots.setting("coulomb")), uncertainty={
        "numbers": ["joint.j1.inertia", "joint.j1.damping", "effect.0.level.0"],
        "covariance": np.diag([1e-6, 1e-4, 1e-6]).tolist()})
    drawn = draw(correction, 5, seed=2)
    found = with_samples(export(correction, "isaac", step=STEP), correction, drawn, step=STEP)
    events = types.ModuleType("corrected_events")
    if isinstance(torch, Tensors):
        chosen = np.random.default_rng(0)
        monkeypatch.setattr(torch, "arange", lambda n, device: np.arange(n), raising=False)
        monkeypatch.setattr(torch, "randint", lambda high, shape, device: chosen.integers(
            high, size=shape), raising=False)
    exec(found.files["corrected_events.py"], vars(events))
    return correction, drawn, found, events


def test_an_event_term_gives_each_environment_a_draw_as_a_whole(torch, monkeypatch):
    correction, drawn, _, events = events_of(torch, monkeypatch)
    one = actuator(correction)
    robot = Robot(one)
    env = types.SimpleNamespace(scene=Scene(robot=robot))
    events.draw_corrected_joints(env, None, types.SimpleNamespace(name="robot"))
    joint = one.joints[0]
    columns = np.asarray(joint.p).T
    rows = np.array(events.DRAWS["j1"][0])
    places = [int(np.abs(rows - column).sum(axis=1).argmin()) for column in columns]
    np.testing.assert_allclose(columns, rows[places], rtol=1e-14)
    inertias = [drawn.corrections[place].joints[0].inertia for place in places]
    np.testing.assert_allclose(np.asarray(joint.inertia), inertias, rtol=1e-12)
    armature, ids, where = robot.written
    np.testing.assert_allclose(armature[:, 0] - 0.5,
                               np.array(inertias) - correction.joints[0].inertia, atol=1e-15)
    assert ids == [1] and where.tolist() == [0, 1, 2]
    kept = columns[0].copy()
    events.draw_corrected_joints(env, torch.as_tensor(np.array([1])),
                                 types.SimpleNamespace(name="robot"))
    np.testing.assert_array_equal(np.asarray(joint.p).T[0], kept)  # the others go on with theirs
    torques = step(torch, one, np.zeros((3, 1)), np.ones((3, 1)), np.zeros((3, 1)))[:, 0]
    moving = drawn.corrections[places[0]]
    level = float(np.ravel(moving.effects[0].values["level"])[0])
    assert torques[0] == pytest.approx(-moving.joints[0].damping - robots.LOAD - level)


def test_an_armature_that_would_be_negative_is_said_and_the_block_knows_it(torch, monkeypatch):
    """PhysX takes none below zero: a warning, and the inertia that the joint is left with."""
    correction, drawn, found, events = events_of(torch, monkeypatch)
    lightest = min(one.joints[0].inertia for one in drawn.corrections)
    least = correction.joints[0].inertia - lightest
    assert any(f"up to {least:.6g} kg m^2 less" in note for note in found.notes)
    assert '"j1": 0.00' in events.__doc__ and "No armature can be" in events.__doc__
    one = actuator(correction)
    robot = Robot(one, armature=1e-6)
    monkeypatch.setattr(torch, "randint", lambda high, shape, device: torch.as_tensor(
        np.full(shape, [k.joints[0].inertia for k in drawn.corrections].index(lightest))))
    with pytest.warns(UserWarning, match="j1: a draw has .* less inertia"):
        events.draw_corrected_joints(types.SimpleNamespace(scene=Scene(robot=robot)), None,
                                     types.SimpleNamespace(name="robot"))
    np.testing.assert_array_equal(robot.written[0], 0.0)
    np.testing.assert_allclose(np.asarray(one.joints[0].inertia),
                               correction.joints[0].inertia - 1e-6)
