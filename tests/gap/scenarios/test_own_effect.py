"""An effect of a user's own is searched for, named, and put back into a diagram."""

import numpy as np
import one_joint
import pytest

from clie_blocks.analysis.gap import Problem, diagnose
from clie_blocks.effects import LIBRARY, register_file

CUBIC = """
from clie_blocks.effects import Effect, Parameter
from clie_blocks.effects.blocks import Static


def cubic_torque(dq, drag):
    return drag * dq**3


CUBIC_DRAG = Effect(
    name="cubic_drag", family="friction", port="load",
    build=Static(cubic_torque, inputs=("dq",)),
    parameters=(Parameter("drag", "N m s^3/rad^3", 0.0, 10.0, 0.1, 0.0, "drag over cubed speed"),),
    equation="tau = drag dq^3", reference="own measurement", signature="Drag at high speed.",
    confused_with={}, simulators={}, wrong="One power.")
"""


@pytest.fixture(autouse=True)
def forgotten():
    """The catalogue as it is, after a test."""
    yield
    LIBRARY.registered.clear()


@pytest.mark.slow
def test_an_effect_of_a_file_is_named_with_its_parameter(tmp_path):
    (tmp_path / "my_effects.py").write_text(CUBIC)
    register_file(tmp_path / "my_effects.py")
    records = one_joint.logs(one_joint.Physics(cubic=0.4))
    found = diagnose(Problem.from_logs(one_joint.robot(), records))
    first = found.to_dict()["effects"][0]
    assert first["effect"] == "cubic_drag" and first["probability"] > 0.9
    assert first["parameters"]["drag"]["value"][0] == pytest.approx(0.4, rel=0.03)
    (setting,) = found.effects()
    assert setting.effect is LIBRARY["cubic_drag"]
    np.testing.assert_allclose(setting.values["drag"], 0.4, rtol=0.03)
