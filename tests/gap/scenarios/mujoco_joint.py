"""One joint with a load in MuJoCo, under a law at 1 kHz and logged as robots write their logs."""

import numpy as np

from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.robot_sections import Links, Motor

PERIOD, SUBSTEPS = 1e-3, 5  # s of the law, and steps of the engine in it

MODEL = """
<mujoco><option timestep="{step}" integrator="implicitfast"/>
<worldbody><body>
<joint name="q" axis="0 -1 0" damping="{damping}" frictionloss="{coulomb}" armature="{armature}"/>
<inertial pos="{com} 0 0" mass="{mass}" diaginertia="1e-6 1e-6 1e-6"/>{load}
</body></worldbody><actuator><motor joint="q" gear="1"/></actuator></mujoco>"""
LOAD = ('<body><inertial pos="{place} 0 0" mass="{mass}" diaginertia="1e-6 1e-6 1e-6"/></body>')


def chirp(seconds, low=0.2, high=3.0, size=0.3):
    """A reference that speeds up, at every tick of the law."""
    time = PERIOD * np.arange(round(seconds / PERIOD))
    return size * np.sin(2 * np.pi * (low * time + (high - low) * time**2 / (2 * seconds)))


def pick_and_place(seconds, seed, rest=2.0, move=0.6, size=0.8):
    """Smooth moves between random poses, with long rests."""
    rng, ticks = np.random.default_rng(seed), round(seconds / PERIOD)
    reference, last = [], 0.0
    while sum(map(len, reference)) < ticks:
        goal, s = rng.uniform(-size, size), np.linspace(0.0, 1.0, round(move / PERIOD))
        reference += [last + (goal - last) * (10 * s**3 - 15 * s**4 + 6 * s**5),
                      np.full(round(rest / PERIOD), goal)]
        last = goal
    return np.concatenate(reference)[:ticks]


def run(reference, kp, kd, mass=0.3, com=0.2, damping=0.02, coulomb=0.0, armature=0.01,
        load=None, late=0, gain=1.0, every=5, noise=2e-5, step=0.0, seed=0):
    """Log of the joint: time, q, qd and the torque of its motor, one row per `every` ticks.

    `load` is a mass and its distance from the joint.  The set-point acts `late` ticks after it is
    logged, and the drive gives `gain` times its command.
    """
    import mujoco

    model = mujoco.MjModel.from_xml_string(MODEL.format(
        step=PERIOD / SUBSTEPS, damping=damping, coulomb=coulomb, armature=armature, com=com,
        mass=mass, load="" if load is None else LOAD.format(mass=load[0], place=load[1])))
    data, rng, rows = mujoco.MjData(model), np.random.default_rng(seed), []
    data.qpos[0] = reference[0]
    last = None
    for k, asked in enumerate(reference):
        seen = data.qpos[0] + noise * rng.standard_normal()
        seen = step * np.round(seen / step) if step else seen
        rate = 0.0 if last is None else (seen - last) / PERIOD
        last = seen
        command = kp * (reference[max(k - late, 0)] - seen) - kd * rate
        if k % every == 0:
            rows.append((PERIOD * k, seen, asked, gain * command, command))
        data.ctrl[0] = gain * command
        mujoco.mj_step(model, data, SUBSTEPS)
    return np.array(rows)


def robot_of(law=None, links=None, inertia=None, **motor):
    """Robot file of the joint: torques count on the joint side."""
    return Robot(n=1, name="joint in MuJoCo", motor=Motor(
        gear_ratio=[1.0], inertia=None if inertia is None else [inertia], **motor),
        links=links or Links(), controller=law or Controller(law="unknown"))


def record_of(rows, robot, *signals, name="log"):
    """Record with q and some of ``qd``, ``tau``, ``u``."""
    columns = dict(zip(("qd", "tau", "u"), rows[:, 2:].T, strict=True))
    return Record(time=rows[:, 0], q=rows[:, [1]], robot=robot, source=name,
                  **{signal: columns[signal][:, None] for signal in signals})
