"""The names that a diagnosis of logs can give, and what is said of others."""

import pytest

from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.causes.vocabulary import (
    EFFECT_NAMES,
    FOUND_BY_REPLAY,
    excluded_names,
    searched_effects,
    select_causes,
)
from clie_blocks.effects import LIBRARY
from clie_blocks.errors import ClieError


def test_searched_effects_are_those_of_the_causes_and_of_the_replay_and_in_the_catalogue():
    names = searched_effects()
    assert list(names) == sorted({cause.name for cause in CAUSES} | set(FOUND_BY_REPLAY))
    assert set(names) < set(LIBRARY)


def test_an_effect_of_the_catalogue_that_is_not_searched_for_is_not_called_unknown():
    for name in sorted(set(LIBRARY) - EFFECT_NAMES):
        with pytest.raises(ClieError) as caught:
            select_causes([name], ())
        message = str(caught.value)
        assert f"{name} is in the catalogue (clie effects {name})" in message
        assert "no log diagnosis searches for it yet" in message
        assert all(searched in message for searched in searched_effects())


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
    assert excluded_names(["coulomb"], ()) == EFFECT_NAMES - {"coulomb"}
