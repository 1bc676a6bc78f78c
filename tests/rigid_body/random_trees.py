"""Trees of random links, and the same ones as MJCF for MuJoCo."""

import numpy as np
from scipy.spatial.transform import Rotation

from clie_blocks.rigid_body.tree import PRISMATIC, REVOLUTE, Body, tree

GRAVITY = (0.3, -0.4, -9.81)


def random_inertia(rng):
    """Moments that a distribution of mass has [kg m^2]."""
    spread = rng.normal(size=(3, 3))
    second = 0.01 * spread @ spread.T
    return np.trace(second) * np.eye(3) - second


def random_bodies(seed, n, sliding=()):
    """Bodies of a branching tree, each behind those that carry them."""
    rng = np.random.default_rng(seed)
    carriers = [None, *(f"j{rng.integers(0, k)}" for k in range(1, n))]
    return [Body(f"j{k}", carriers[k], Rotation.random(random_state=seed + k).as_matrix(),
                 0.3 * rng.normal(size=3), rng.normal(size=3), rng.uniform(0.5, 3.0),
                 0.1 * rng.normal(size=3), random_inertia(rng),
                 PRISMATIC if k in sliding else REVOLUTE) for k in range(n)]


def random_tree(seed, n, sliding=()):
    return tree(random_bodies(seed, n, sliding), GRAVITY)


def mjcf(bodies, gravity=GRAVITY):
    """The bodies as a model of MuJoCo."""
    def text(values):
        return " ".join(repr(float(value)) for value in np.ravel(values))

    def element(body):
        inertia = body.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        turn = Rotation.from_matrix(body.rotation).as_quat(scalar_first=True)
        kind = "slide" if body.kind == PRISMATIC else "hinge"
        inner = "".join(element(other) for other in bodies if other.parent == body.name)
        return (f'<body name="link of {body.name}" pos="{text(body.offset)}" quat="{text(turn)}">'
                f'<joint name="{body.name}" type="{kind}" axis="{text(body.axis)}"/>'
                f'<inertial pos="{text(body.com)}" mass="{body.mass!r}" '
                f'fullinertia="{text(inertia)}"/>{inner}</body>')

    roots = "".join(element(body) for body in bodies if body.parent is None)
    return (f'<mujoco><compiler angle="radian"/><option gravity="{text(gravity)}"/>'
            f'<worldbody>{roots}</worldbody></mujoco>')
