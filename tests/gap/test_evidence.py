"""Evidence: it can be kept and read, and a cause that shrank to a simpler one is not counted."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from clie_blocks.analysis.gap.causes import friction
from clie_blocks.analysis.gap.evidence import Row, Table, from_json, simpler, to_json
from clie_blocks.analysis.gap.hypothesis import Member


def fitted(slope):
    cause = friction.LOAD_DEPENDENT_FRICTION[0]
    sizes = {"level": np.array([1.0, 1.0]), "slope": np.array([0.03, 0.03])}
    member = Member(cause, (1,), sizes, sizes)
    values = {"load_dependent_friction.level": np.array([0.0, 1.0]),
              "load_dependent_friction.slope": np.array([0.0, slope])}
    return SimpleNamespace(hypothesis=SimpleNamespace(members=(member,), values=values))


@pytest.mark.parametrize("slope, names", [(0.0, ("coulomb",)), (0.01, None)])
def test_load_dependent_friction_without_a_slope_is_coulomb_friction(slope, names):
    assert simpler(fitted(slope)) == names


def test_a_table_survives_a_file():
    table = Table(3.0, 0.5, 1, (2.0, 1.0), [Row(("coulomb",), 0.1, 1)])
    again = from_json(json.loads(json.dumps(to_json(table))))
    assert to_json(again) == to_json(table)
    assert again.rows[0].names == ("coulomb",)
