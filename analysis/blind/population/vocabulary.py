"""The names of a study: what is made under each, and what kind of robot can have it."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from clie_blocks.analysis.blind.population.effect_site import Draw, HiddenEffect, Site

Needs = tuple[tuple[str, ...], bool | None, bool]


@dataclass(frozen=True, eq=False)
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

    """

    effects: Mapping[str, Draw]
    outsiders: Mapping[str, Draw]
    whole_robot: tuple[str, ...]
    needs: Mapping[str, Needs]
    first_joint: Mapping[str, int] = field(default_factory=dict)

    def joint(self, rng: np.random.Generator, name: str, n: int) -> int:
        """Draw the joint of an effect, counted from 0."""
        return int(rng.integers(self.first_joint.get(name, 0), n))

    def draw(self, rng: np.random.Generator, name: str, site: Site) -> HiddenEffect:
        """Draw an effect at the joint of a site."""
        draw = {**self.effects, **self.outsiders}[name]
        joints = () if name in self.whole_robot else (site.joint + 1,)
        return HiddenEffect(name, joints, draw(rng, site))
