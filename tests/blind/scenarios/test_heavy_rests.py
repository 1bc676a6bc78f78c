"""Joints of the other engine that a rest holds fast: far beyond what a small excess shows."""

import pytest

from clie_blocks.analysis.blind.population.catalogue import WHOLE_CATALOGUE
from clie_blocks.analysis.blind.population.files import write_trial
from clie_blocks.analysis.blind.population.maker import make_trial
from clie_blocks.analysis.gap import diagnose, read


@pytest.mark.slow
def test_a_joint_that_a_rest_holds_fast_is_named_with_what_renews_its_contact(tmp_path):
    made = make_trial(WHOLE_CATALOGUE, 22469, 16)
    (truth,) = made.label["effects"]
    write_trial(made, tmp_path / "trial")
    found = diagnose(read(tmp_path / "trial"))
    assert found.to_dict()["set_90"] == [truth["effect"]] == ["rest_time_breakaway"]
    (setting,) = found.effects()
    (joint,) = truth["joints"]
    for name, true in (("velocity", "rest_speed"), ("slip", "rest_slide")):
        assert setting.values[name][joint - 1] == pytest.approx(
            truth["numbers"][true][joint - 1], rel=0.1)
