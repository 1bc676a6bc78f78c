"""Another process compiles what the next fits need, and nothing is compiled twice."""

import numpy as np
import pytest

from clie_blocks.analysis.gap.causes.drive import ACTUATOR_LAG, TIME_DELAY
from clie_blocks.analysis.gap.causes.friction import COULOMB
from clie_blocks.analysis.gap.fitting import compile_ahead as ahead
from clie_blocks.analysis.gap.fitting.hypothesis import Member, build_hypothesis
from clie_blocks.analysis.gap.simulation.closed_loop import simulator
from clie_blocks.compiled.codegen import machine


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty cache, and no program in memory."""
    monkeypatch.setenv("CLIE_BLOCKS_CACHE", str(tmp_path))
    monkeypatch.setattr(ahead, "processors", lambda: 2)
    simulator.cache_clear()
    yield tmp_path
    simulator.cache_clear()


def hypothesis(problem, cause, **values):
    values = {name: np.full(problem.n, value) for name, value in values.items()}
    return build_hypothesis(problem, (Member(cause, tuple(range(problem.n)), values, values),))


def refuse(*_):
    raise AssertionError("compiled once more")


def test_a_fit_runs_what_another_process_has_compiled(healthy, folder, monkeypatch):
    expected = hypothesis(healthy, TIME_DELAY, delay=2e-3)
    before = expected.means(0, [expected.values])[0]
    simulator.cache_clear()
    for file in folder.iterdir():
        file.unlink()
    with ahead.compiler(True):
        late = hypothesis(healthy, TIME_DELAY, delay=2e-3)
        ahead.compile_ahead([late])
        (running,) = ahead._compilers
        with running._changed:
            assert running._changed.wait_for(lambda: running._asked and not running._current, 60)
        monkeypatch.setattr(machine, "_compile", refuse)
        ahead.compile_here(late)
        np.testing.assert_array_equal(late.means(0, [late.values])[0], before)
    assert running._process.returncode is not None and not ahead._compilers


def test_what_is_needed_now_is_left_to_this_process(healthy, folder):
    with ahead.compiler(True):
        (running,) = ahead._compilers
        first, second = (hypothesis(healthy, COULOMB, level=0.1),
                         hypothesis(healthy, ACTUATOR_LAG, lag=1e-3))
        ahead.compile_here(second)
        ahead.compile_ahead([second])
        assert running._waiting == [] and running._current == ""
        ahead.compile_ahead([first, second])
        ahead.compile_here(first)  # waits where it is being compiled
        assert running._current != ahead._job(first).identity


def test_a_cause_that_the_library_lacks_is_not_compiled(healthy, folder):
    job = ahead._job(hypothesis(healthy, COULOMB, level=0.1))
    ahead._compile(job._replace(causes=("rust",)))
    ahead._compile(job._replace(causes=("time_delay",)))  # of another program
    assert not any(folder.iterdir())
    ahead._compile(job)
    assert any(folder.iterdir())


@pytest.mark.parametrize("worth, processors, cache", [(False, 2, ""), (True, 1, ""),
                                                      (True, 2, "off")])
def test_no_process_where_it_gains_nothing(folder, monkeypatch, worth, processors, cache):
    monkeypatch.setattr(ahead, "processors", lambda: processors)
    if cache:
        monkeypatch.setenv("CLIE_BLOCKS_CACHE", cache)
    with ahead.compiler(worth):
        assert not ahead._compilers
        ahead.compile_ahead([])


def test_a_search_goes_on_where_no_process_starts_or_one_ends_early(healthy, folder, monkeypatch):
    late = hypothesis(healthy, TIME_DELAY, delay=2e-3)
    monkeypatch.setattr(ahead.sys, "executable", str(folder / "no such program"))
    with ahead.compiler(True):
        assert not ahead._compilers
    monkeypatch.undo()
    monkeypatch.setenv("CLIE_BLOCKS_CACHE", str(folder))
    monkeypatch.setattr(ahead, "processors", lambda: 2)
    with ahead.compiler(True):
        (running,) = ahead._compilers
        running._process.kill()
        ahead.compile_ahead([late])
        ahead.compile_here(late)
        assert np.isfinite(late.means(0, [late.values])[0]).all()
