"""A wrist in MuJoCo whose last two links weigh at one place: which is off, no log can tell."""

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

from clie_blocks.analysis.gap import diagnose  # noqa: E402
from clie_blocks.analysis.gap.problem.problem import Problem  # noqa: E402
from clie_blocks.analysis.records import read_trial  # noqa: E402
from tests.gap.scenarios import coupled_wrist as wrist  # noqa: E402

BALANCED = wrist.LINKS.replace('pos="0.08 0 0.01"', 'pos="0.12 0 0"').replace(
    'pos="0.05 0.03 0.01"', 'pos="0 0 0"')
STATED, TRUE = 0.9, 1.5  # kg, of the last link
HEAVIER = f'mass="{STATED}"', f'mass="{TRUE}"'


def diagnosed(folder, links):
    robot, records = read_trial(wrist.write(folder, 4.0, coupling=np.eye(3), stated=links,
                                            links=links.replace(*HEAVIER)))
    return diagnose(Problem.from_logs(robot, records), effects=("payload", "coulomb"),
                    seconds=400.0)


@pytest.mark.slow
def test_links_that_weigh_at_one_place_are_named_together(tmp_path):
    diagnosis = diagnosed(tmp_path, BALANCED)
    answer = diagnosis.to_dict()
    masses = [row for row in answer["description"] if row["key"] == "links.mass_kg"]
    assert {row["joint"] for row in masses} == {2, 3}
    assert len({row["alternative"] for row in masses}) == 2
    for row in masses:
        assert row["identified"] - row["stated"] == pytest.approx(TRUE - STATED, rel=0.05)
    assert "these logs do not tell them apart" in str(diagnosis)


@pytest.mark.slow
def test_a_link_that_moves_of_its_own_is_named_alone(tmp_path):
    answer = diagnosed(tmp_path, wrist.LINKS).to_dict()
    masses = [row["joint"] for row in answer["description"] if row["key"] == "links.mass_kg"]
    assert masses == [3]
