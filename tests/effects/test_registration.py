"""Effects of a user's own: registered from a file, or refused with the line and the remedy."""

import dataclasses

import numpy as np
import pytest

from clie_blocks.effects import LIBRARY, register, register_file, with_effects
from clie_blocks.errors import ClieError
from clie_blocks.joints import inertial_joints
from clie_blocks.labels import DiagramError

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


def written(folder, text):
    """File of effects with a text."""
    path = folder / "my_effects.py"
    path.write_text(text)
    return path


def test_an_effect_of_a_file_is_in_the_catalogue_and_can_be_inserted(tmp_path):
    (effect,) = register_file(written(tmp_path, CUBIC))
    assert LIBRARY["cubic_drag"] is effect and "cubic_drag" in list(LIBRARY)
    plant = with_effects(inertial_joints([2.0], [0.1], [0.0]), [effect(drag=0.5)])
    rate = plant.dynamics(0.0, np.array([0.0, 2.0]), np.array([1.0]))
    np.testing.assert_allclose(rate, [2.0, (1.0 - 0.1 * 2.0 - 0.5 * 8.0) / 2.0])


@pytest.mark.parametrize(("old", "new", "line", "said"), [
    ('name="cubic_drag"', 'name="coulomb"', 10, "the catalogue has an effect of this name"),
    ('"load"', '"laod"', 10, "no port is called 'laod'; did you mean 'load'"),
    ("drag * dq**3", "drag * dq**3 + 1.0", 10, "at its neutral values it must change nothing"),
    ("drag * dq**3", "drag * speed**3", 10, "NameError"),
    ("0.1, 0.0", "0.1, None", 10, "no parameter has a neutral value"),
    ("0.0, 10.0, 0.1", "0.0, 10.0, 11.0", 10, "typical value 11"),
    ("import Static", "import Statik", 3, "ImportError"),
    ("equation=", "eqation=", 10, "TypeError"),
    ("def cubic_torque(dq, drag):", "def cubic_torque(dq, drag)", 6, "SyntaxError")])
def test_a_file_that_breaks_the_contract_is_refused_with_its_line(
        tmp_path, old, new, line, said):
    path = written(tmp_path, CUBIC.replace(old, new, 1))
    with pytest.raises(ClieError) as caught:
        register_file(path)
    assert f"my_effects.py:{line}: " in str(caught.value) and said in str(caught.value)
    assert "cubic_drag" not in LIBRARY


def test_a_file_without_effects_and_one_that_is_not_there_are_refused(tmp_path):
    with pytest.raises(ClieError, match="it defines no effect; write MY_EFFECT = Effect"):
        register_file(written(tmp_path, "from clie_blocks.effects import LIBRARY\n"
                                        "COULOMB = LIBRARY['coulomb']\n"))
    with pytest.raises(ClieError, match="cannot be read"):
        register_file(tmp_path / "missing.py")


def test_an_effect_is_registered_once(tmp_path):
    (effect,) = register_file(written(tmp_path, CUBIC))
    assert register(effect) is effect
    with pytest.raises(DiagramError, match="the catalogue has an effect of this name"):
        register(dataclasses.replace(effect, wrong="Another one."))
