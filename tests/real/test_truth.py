"""`truth.toml`: what is known of a machine, and what its author is told of a fault in it."""

import pytest

from clie_blocks.analysis.gap.causes.vocabulary import effect_names
from clie_blocks.analysis.real.truth import KNOWN_MACHINES, Size, machines_of
from clie_blocks.analysis.records import read_robot
from clie_blocks.errors import RecordError

RUN = 'machine = "axis"\n[[run]]\nname = "laps"\nlogs = ["a", "b"]\n'


def machine(folder, text):
    (folder / "truth.toml").write_text(text)
    return machines_of(folder)


def test_a_folder_with_a_truth_is_a_machine(tmp_path):
    axis = tmp_path / "axis"
    axis.mkdir()
    (axis / "truth.toml").write_text(
        f'{RUN}cause = ["coulomb"]\nsize = {{ "coulomb.level" = [2.5, 3] }}\n')
    (found,) = machines_of(tmp_path)
    assert (found.name, found.logs, found.truth) == ("axis", axis, axis)
    (run,) = found.runs
    assert run.cause == ("coulomb",) and run.size == (Size("coulomb.level", 2.5, 3.0),)


@pytest.mark.parametrize(("text", "message"), [
    ('machine = "axis"\n', r"no \[\[run\]\]"),
    (f"{RUN}cuase = []\n", "no key 'cuase'; nearest: 'cause'|cause"),
    (f'{RUN}cause = ["columb"]\n', "no effect 'columb'.*'coulomb'"),
    (f'{RUN}cause = "coulomb"\n', "cause must be a list of texts, got 'coulomb'"),
    (f'{RUN}size = {{ "coulomb.level" = [3.0, 2.0] }}\n', r"must be \[low, high\]"),
    ('[[run]]\nname = "laps"\n', r"needs a name and logs"),
    ("machine = \n", "must be TOML")])
def test_a_faulty_truth_is_refused_with_its_place(tmp_path, text, message):
    with pytest.raises(RecordError, match=f"truth.toml.*({message})"):
        machine(tmp_path, text)


def test_a_folder_without_machines_says_what_to_write(tmp_path):
    with pytest.raises(RecordError, match="put a truth.toml beside the logs.*emps"):
        machines_of(tmp_path)


@pytest.mark.parametrize("folder", sorted(KNOWN_MACHINES.iterdir()), ids=lambda path: path.name)
def test_the_public_machines_are_stated_soundly(folder):
    (found,) = machines_of(folder)
    assert found.source and all(run.why for run in found.runs)
    for run in found.runs:
        assert set(run.cause) | set(run.absent) <= effect_names()
        if run.robot:
            assert read_robot(folder / run.robot).n == max(1, len(run.joints))
