"""A hobby servo that lifts a link, from MuJoCo: position actuator, friction, weight, delay."""

import dataclasses

import mujoco
import numpy as np

from clie_blocks.analysis.records import Record

PERIOD, STEP, SECONDS = 0.02, 5e-4, 60.0  # s
RESOLUTION, NOISE = 1.534e-3, 3e-4  # rad
MODEL = """<mujoco>
  <option timestep="{step}" integrator="implicitfast" gravity="0 0 -9.81"/>
  <worldbody><body>
    <inertial pos="{com} 0 0" mass="{mass}" diaginertia="{inertia} {inertia} {inertia}"/>
    <joint name="j" axis="0 -1 0" armature="{rotor}" damping="1e-3" frictionloss="{friction}"
           solreffriction="{soft} 1" solimpfriction="0.999 0.999 0.001"/>
  </body></worldbody>
  <actuator><position joint="j" kp="{kp}" kv="{kv}"/></actuator>
</mujoco>"""


@dataclasses.dataclass(frozen=True)
class Course:
    """How the servo goes to a set-point: late, or on a course of its own.

    Parameters
    ----------
    delay : float
        Of the set-point [s].
    rate, acceleration : float
        Fastest change of what it goes to [rad/s, rad/s^2].

    """

    delay: float = 0.0
    rate: float = np.inf
    acceleration: float = np.inf

    def aims(self, set_points):
        """What the servo goes to in each step of the engine, (N,) [rad]."""
        late = round(self.delay / STEP)
        wanted = np.concatenate([np.full(late, set_points[0]), set_points])[:len(set_points)]
        if np.isinf(self.rate):
            return wanted
        aim, speed, found = wanted[0], 0.0, np.empty_like(wanted)
        for i, one in enumerate(wanted):
            left = one - aim
            if np.isinf(self.acceleration):
                aim += np.clip(left, -self.rate * STEP, self.rate * STEP)
            else:
                braked = np.sign(left) * np.sqrt(2.0 * self.acceleration * abs(left))
                change = self.acceleration * STEP
                speed += np.clip(np.clip(braked, -self.rate, self.rate) - speed, -change, change)
                aim += speed * STEP
            found[i] = aim
        return found


def log(seed, course):
    """Log of random steps of a drawn servo, at 50 Hz and in steps of its encoder."""
    rng = np.random.default_rng(seed)
    kp, mass, com = rng.uniform(4.0, 20.0), rng.uniform(0.05, 0.4), rng.uniform(0.05, 0.15)
    rotor = kp / rng.uniform(25.0, 60.0) ** 2
    model = mujoco.MjModel.from_xml_string(MODEL.format(
        step=STEP, soft=4 * STEP, com=com, mass=mass, inertia=0.1 * mass * com**2, rotor=rotor,
        friction=kp * rng.uniform(0.003, 0.02), kp=kp,
        kv=rng.uniform(1.0, 2.0) * np.sqrt(kp * rotor)))
    data, count, ticks = mujoco.MjData(model), round(SECONDS / PERIOD), round(PERIOD / STEP)
    steps = np.repeat(rng.uniform(-0.6, 0.6, count), rng.integers(10, 50, count))[:count]
    aims, q = course.aims(np.repeat(steps, ticks)).reshape(count, ticks), np.empty(count)
    data.qpos[:] = steps[0]
    for i in range(count):
        q[i] = data.qpos[0]
        for data.ctrl[0] in aims[i]:
            mujoco.mj_step(model, data)
    q = RESOLUTION * np.round((q + rng.normal(0, NOISE, count)) / RESOLUTION)
    return Record(time=PERIOD * np.arange(count), q=q[:, None], qd=steps[:, None])
