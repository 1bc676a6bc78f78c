"""Halving the step: every stiff effect converges, and friction creeps no more than it says."""

import numpy as np
import pytest

from clie_blocks.analysis.catalogue.numerics import convergence, creep
from clie_blocks.effects import LIBRARY, sticking

STIFF = [name for name in LIBRARY if LIBRARY[name].stiff]
MEMORYLESS_ROUNDING = {"encoder_quantization", "torque_quantization"}


@pytest.mark.parametrize("name", [n for n in STIFF if n not in MEMORYLESS_ROUNDING])
def test_a_shorter_step_comes_closer(name):
    """First order at least over the halvings that do not diverge, or only rounding is left."""
    found = convergence(name)
    finite = [e for e in found.errors if np.isfinite(e)]
    assert len(finite) >= 2
    assert finite[-1] < 1e-10 or finite[-1] < 0.75 ** (len(finite) - 1) * finite[0]
    assert finite[-1] < 0.01 * found.size + 1e-10


@pytest.mark.parametrize(("setting", "bound"), [
    (LIBRARY["coulomb"].typical(level=0.4), 1e-3 * np.arctanh(0.9)),
    (LIBRARY["presliding"].typical(level=0.4), 1e-6),
    (LIBRARY["maxwell_slip"].typical(level=0.4), 1e-6),
    (sticking(LIBRARY["coulomb"]).typical(level=0.4), 1e-9),
    (sticking(LIBRARY["stribeck"]).typical(level=0.4), 1e-9),
], ids=lambda value: value.name if hasattr(value, "name") else "")
def test_a_stuck_joint_creeps_no_faster_than_stated(setting, bound):
    assert abs(creep(setting, 0.36)) <= bound
