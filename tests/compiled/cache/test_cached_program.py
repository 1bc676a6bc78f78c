"""A program from the disk is the program that was compiled, and needs no diagram."""

import numpy as np
import pytest

from clie_blocks.compiled import CompiledDifferenceError, compile_diagram
from clie_blocks.compiled.cache.cached_program import CachedProgram, cached_program, source_digest
from clie_blocks.compiled.cache.signature import parse_description

SETS = {"map.gain": np.array([0.5, 0.6, 0.7]), "map.offset": np.array([[1.0, 2.0]])}
ROWS = np.random.default_rng(0).standard_normal((40, 2))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("CLIE_BLOCKS_CACHE", str(tmp_path))
    return tmp_path


@pytest.fixture
def difference(make_block):
    """A nonlinear difference equation of two joints."""
    def update(t, x, u, params):
        return params["map.gain"] * np.sin(x) + params["map.offset"] * u

    block = make_block("map", update, lambda t, x, u, params: x**2, x=2, u=2, y=2,
                       gain=0.5, offset=np.ones(2))
    block.dt = 0.1
    return block


def nowhere():
    raise AssertionError("the diagram is not needed")


def ran(program, **options):
    return program.batch(4.0, inputs=ROWS, params=SETS, threads=1, **options)


def test_the_next_process_needs_no_diagram(difference, folder):
    expected = ran(compile_diagram(difference), log=["y[1]"], every=4)
    first = ran(cached_program("one", lambda: difference), log=["y[1]"], every=4)
    again = ran(cached_program("one", nowhere), log=["y[1]"], every=4)
    for found in (first, again):
        np.testing.assert_array_equal(found.outputs, expected.outputs)
        np.testing.assert_array_equal(found.final_state, expected.final_state)


def test_a_batch_runs_what_was_compiled_before_it_was_needed(difference, folder):
    cached_program("one", lambda: difference).compile(["y[0]", "y[1]"], SETS, 4)
    np.testing.assert_array_equal(ran(cached_program("one", nowhere)).outputs,
                                  ran(compile_diagram(difference)).outputs)


def test_what_was_not_asked_before_is_compiled_from_the_diagram(difference, folder):
    ran(cached_program("one", lambda: difference), log=["y[1]"])
    asked = []
    later = ran(cached_program("one", lambda: asked.append(1) or difference), log=["y"])
    assert asked
    np.testing.assert_array_equal(later.outputs, ran(compile_diagram(difference)).outputs)


def test_a_diagram_that_is_not_what_its_trace_says_is_not_stored(make_block, folder):
    calls = []

    def update(t, x, u, params):
        calls.append(1)
        return x * (1.0 if len(calls) > 2 else 2.0)

    block = make_block("counter", update, lambda t, x, u, params: x, x=1)
    block.dt = 0.1
    with pytest.raises(CompiledDifferenceError):
        cached_program("one", lambda: block)
    assert not any(folder.iterdir())


def test_another_identity_is_another_program(difference, folder):
    cached_program("one", lambda: difference)
    with pytest.raises(AssertionError, match="not needed"):
        cached_program("two", nowhere)


def test_damaged_files_are_made_again(difference, folder):
    expected = ran(cached_program("one", lambda: difference))
    for file in folder.glob("*.bin"):
        file.write_bytes(file.read_bytes()[:-1])
    found = ran(cached_program("one", lambda: difference))
    np.testing.assert_array_equal(found.outputs, expected.outputs)


def test_without_a_cache_it_runs_all_the_same(difference, folder, monkeypatch):
    expected = ran(compile_diagram(difference))
    monkeypatch.setenv("CLIE_BLOCKS_CACHE", "off")
    np.testing.assert_array_equal(ran(cached_program("one", lambda: difference)).outputs,
                                  expected.outputs)


def test_without_machine_code_it_is_the_program_itself(difference, folder, monkeypatch):
    monkeypatch.setattr("clie_blocks.compiled.program.available_engine", lambda name: "python")
    program = cached_program("slow", lambda: difference)
    assert not isinstance(program, CachedProgram)
    assert ran(program).outputs.shape == (3, 2, 41)


def test_changed_sources_are_other_programs(tmp_path, monkeypatch):
    package = tmp_path / "some_blocks"
    (package / "deep" / "deeper").mkdir(parents=True)
    (package / "__init__.py").write_text("")
    monkeypatch.syspath_prepend(tmp_path)
    digests = []
    for file, text in (("__init__.py", "gain = 1"), ("__init__.py", "gain = 2"),
                       ("deep/law.py", "gain = 1"), ("deep/deeper/law.py", "gain = 1"),
                       ("deep/deeper/law.py", "gain = 2"), ("deep/notes.txt", "no source")):
        (package / file).write_text(text)
        source_digest.cache_clear()
        digests.append(source_digest("some_blocks"))
    assert len(set(digests)) == 5 and digests[-1] == digests[-2]


def test_a_description_has_all_labels_of_the_program(difference):
    program = compile_diagram(difference)
    description = parse_description(program.description.text())
    for name in ("name", "inputs", "outputs", "states", "period"):
        assert getattr(description, name) == getattr(program, name)
    np.testing.assert_array_equal(description.parameters.vector({"map.gain": 0.1}, "map"),
                                  [0.1, 1.0, 1.0])


def test_sources_tell_packages_apart():
    one, two = source_digest("clie_blocks.compiled"), source_digest("clie_blocks.effects")
    assert one == source_digest("clie_blocks.compiled") and one != two


def test_inputs_may_be_one_table(difference, folder):
    program = compile_diagram(difference)
    one = program.run(4.0, inputs=ROWS)
    np.testing.assert_array_equal(one.outputs, program.run(4.0, inputs={"u": ROWS}).outputs)
    with pytest.raises(ValueError, match="shape"):
        program.run(4.0, inputs=ROWS[:, :1])
