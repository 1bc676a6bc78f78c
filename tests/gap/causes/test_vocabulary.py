"""The names that a diagnosis of logs can give, and what is said of others."""

import control as ct
import numpy as np
import pytest

from clie_blocks.analysis.catalogue.pages import page
from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.causes.vocabulary import (
    FOUND_BY_REPLAY,
    SAME_PHYSICS,
    STATED_NUMBERS,
    class_of,
    describe_answer,
    effect_names,
    effects_of_number,
    excluded_names,
    searched_effects,
    select_causes,
)
from clie_blocks.effects import LIBRARY, with_effects
from clie_blocks.errors import ClieError


def test_searched_effects_are_those_of_causes_replay_and_classes_and_in_the_catalogue():
    names = searched_effects()
    assert list(names) == sorted({*(cause.name for cause in CAUSES), *FOUND_BY_REPLAY,
                                  *STATED_NUMBERS, *SAME_PHYSICS})
    assert set(names) == set(LIBRARY)


@pytest.mark.parametrize(("name", "number"), [
    ("back_emf", {"damping": 0.9}), ("viscous", {"damping": 0.9}), ("inertia", {"inertia": 1.3}),
    ("ratio_error", {"inertia": 0.8, "damping": 0.4})])
def test_an_effect_that_stands_for_a_number_moves_the_robot_as_that_number_does(name, number):
    effect = {"back_emf": {"damping": 0.4}, "viscous": {"extra": 0.4}, "inertia": {"extra": 0.3},
              "ratio_error": {"error": 0.25}}[name]
    w = np.logspace(-1, 2, 7)

    def response(plant):
        linear = ct.linearize(plant, np.zeros(plant.nstates), np.zeros(1))
        return linear[0, 0](1j * w)

    stated = {"inertia": 1.0, "damping": 0.5}
    moved = with_effects(plant_of(**stated), [LIBRARY[name](**effect)])
    np.testing.assert_allclose(response(moved), response(plant_of(**{**stated, **number})))
    assert class_of(name) == "parametric"


def plant_of(inertia, damping):
    """One joint ``inertia ddq + damping dq = u`` as a plant."""
    return ct.nlsys(lambda t, x, u, params: np.array([x[1], (u[0] - damping * x[1]) / inertia]),
                    lambda t, x, u, params: x, name="plant", inputs=["u[0]"],
                    states=["q[0]", "dq[0]"], outputs=["q[0]", "dq[0]"])


def test_a_name_of_a_class_is_searched_as_its_class():
    assert select_causes(["torque_gain"], ()) == select_causes(["torque_gain_error"], ())
    assert select_causes(["back_emf"], ()) == ()
    assert effects_of_number("motor.viscous_friction_nms") == ("back_emf", "viscous")
    assert effects_of_number("links.mass_kg") == ()


def test_a_typing_error_gets_the_nearest_name_and_the_full_list():
    with pytest.raises(ClieError, match="no effect is called 'colomb'; did you mean 'coulomb'?"
                       ) as caught:
        select_causes((), ["colomb"])
    assert all(searched in str(caught.value) for searched in searched_effects())
    with pytest.raises(ClieError, match="no effect is called 'zzz'\n"):
        select_causes(["zzz"], ())


def test_a_choice_limits_what_is_searched_for_and_what_may_be_named():
    causes = select_causes(["coulomb", "friction_drift"], ["friction_drift"])
    assert [cause.name for cause in causes] == ["coulomb"]
    assert select_causes((), ()) == CAUSES
    assert excluded_names((), ["spring"]) == {"spring"}
    assert excluded_names(["coulomb"], ()) == effect_names() - {"coulomb"}


@pytest.mark.parametrize(("name", "words"), [
    ("back_emf", "parametric: another motor.viscous_friction_nms"),
    ("torque_gain", "torque_gain_error"), ("dahl", "dahl, from the motion"),
    ("gain_error", "gain_error, from the logged commands")])
def test_the_catalogue_says_what_a_diagnosis_answers(name, words):
    assert words in describe_answer(name)
    assert words in " ".join(page(name).split())
