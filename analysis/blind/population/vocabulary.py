"""The names of a study: what is made under each, and what kind of robot can have it."""

import dataclasses
from collections.abc import Collection, Mapping

import numpy as np

from clie_blocks.analysis.blind.engine.robot import DrawnRobot
from clie_blocks.analysis.blind.population.effect_site import Draw, HiddenEffect, Site

Needs = tuple[tuple[str, ...], bool | None, bool]


@dataclasses.dataclass(frozen=True, eq=False)
class Vocabulary:
    """Names of a study.

    Parameters
    ----------
    effects : mapping
        How each effect that the diagnosis may name is drawn.
    outsiders : mapping
        The same of those that it has no name for.
    whole_robot : tuple of str
        Names that no joint has alone.
    needs : mapping
        By name: kinds of robot; whether it hangs in gravity; whether its nominal model contains
        its coupling.
    first_joint : mapping
        By name: first joint that can have it, counted from 0.
    motor_encoders : float
        Share of the robots whose encoders sit on their motors.
    two_encoders : float
        Share of these that log the encoders of their links, too.
    joint_encoders : tuple of str
        Names that only an encoder behind the gear can show.

    """

    effects: Mapping[str, Draw]
    outsiders: Mapping[str, Draw]
    whole_robot: tuple[str, ...]
    needs: Mapping[str, Needs]
    first_joint: Mapping[str, int] = dataclasses.field(default_factory=dict)
    motor_encoders: float = 0.0
    two_encoders: float = 0.0
    joint_encoders: tuple[str, ...] = ()

    def joint(self, rng: np.random.Generator, name: str, n: int) -> int:
        """Draw the joint of an effect, counted from 0."""
        return int(rng.integers(self.first_joint.get(name, 0), n))

    def mount_encoder(self, rng: np.random.Generator, robot: DrawnRobot, names: Collection[str],
                      ) -> DrawnRobot:
        """Robot with its encoders on the motors, if chance and its effects let them be there."""
        if not self.motor_encoders or set(names) & set(self.joint_encoders):
            return robot
        drawn = rng.random()
        return dataclasses.replace(
            robot, encoder_on_motor=bool(drawn < self.motor_encoders),
            two_encoders=bool(drawn < self.two_encoders * self.motor_encoders))

    def draw(self, rng: np.random.Generator, name: str, site: Site) -> HiddenEffect:
        """Draw an effect at the joint of a site."""
        draw = {**self.effects, **self.outsiders}[name]
        joints = () if name in self.whole_robot else (site.joint + 1,)
        return HiddenEffect(name, joints, draw(rng, site))
