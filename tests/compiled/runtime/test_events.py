import numpy as np
import pytest

from clie_blocks.compiled import compile_diagram
from clie_blocks.errors import ClieError, DivergedError

CALL = {"duration": 4.0, "step": 0.01, "inputs": {"q_d": [1.0, -0.5]}}


@pytest.fixture(params=["llvm", "python"])
def program(loop, request):
    return compile_diagram(loop, request.param)


@pytest.mark.parametrize("every", [1, 7])
def test_a_stop_says_when_where_and_why(program, every):
    free = program.run(**CALL)
    run = program.run(**CALL, stop={"q": (-0.25, 0.7), "plant.dq": (-9, 9)}, every=every)
    outside = np.any((free.outputs[:2] < -0.25) | (free.outputs[:2] > 0.7), axis=0)
    k = np.flatnonzero(outside)[0]
    stopped = run.stopped
    assert stopped.time == pytest.approx(0.01 * k) and run.time[-1] == stopped.time
    assert stopped.value == free.outputs[int(stopped.signal[2]), k]
    assert stopped.bound in (-0.25, 0.7)
    assert str(stopped) == (f"stopped at t = {stopped.time:g} s, because {stopped.signal} = "
                            f"{stopped.value:.6g} is {'above' if stopped.bound > 0 else 'below'} "
                            f"{stopped.bound:g}")
    np.testing.assert_array_equal(run.outputs[:, -1], free.outputs[:, k])
    np.testing.assert_array_equal(run.outputs[:, :-1], free.outputs[:, :k:every])
    np.testing.assert_array_equal(run.time[:-1], free.time[:k:every])


def test_a_run_within_its_bounds_is_complete(program):
    free = program.run(**CALL)
    run = program.run(**CALL, stop={"q": (-5.0, 5.0), "plant.dq[1]": (None, 50.0)})
    assert run.stopped is None and free.stopped is None
    np.testing.assert_array_equal(run.outputs, free.outputs)


def test_a_start_outside_is_the_whole_run(program):
    run = program.run(**CALL, stop={"q[1]": (0.1, None)})
    assert run.stopped.time == 0.0 and run.stopped.signal == "q[1]"
    assert run.time.shape == (1,) and run.outputs.shape == (4, 1)


def test_the_end_is_watched_as_well(program):
    free = program.run(**CALL)
    high = np.max(free.outputs[0, :51])
    bound = (free.outputs[0, 49] + free.outputs[0, 50]) / 2
    assert high == free.outputs[0, 50]  # still rising there
    run = program.run(**{**CALL, "duration": 0.5}, stop={"q[0]": (None, bound)}, every=3)
    assert run.stopped.time == pytest.approx(0.5) and run.time[-1] == run.stopped.time


def test_other_bounds_need_no_new_program(loop):
    program = compile_diagram(loop)
    program.run(**CALL, stop={"q[0]": (-1, 0.5)})
    engines = len(program._engines)
    times = [program.run(**CALL, stop={"q[0]": (-1, high)}).stopped.time
             for high in (0.2, 0.5, 0.8)]
    assert times == sorted(times) and times[0] < times[2]
    assert len(program._engines) == engines


def test_a_signal_that_is_no_number_stops_and_a_state_diverges(make_block):
    block = make_block("root", lambda t, x, u, params: -np.ones(1) + 0 * u,
                       lambda t, x, u, params: np.sqrt(x), x=1)
    program = compile_diagram(block)
    run = program.run(2.0, 0.01, inputs={"u": 0.0}, initial_state=[1.0], stop={"y": (0, 5)})
    assert np.isnan(run.stopped.value) and "is not a number" in str(run.stopped)
    assert run.stopped.time == pytest.approx(1.01, abs=0.011)
    fast = compile_diagram(make_block("fast", lambda t, x, u, params: x**2 + 0 * u,
                                      lambda t, x, u, params: 1 * x, x=1))
    with pytest.raises(DivergedError):
        fast.run(2.0, 0.1, inputs={"u": 0.0}, initial_state=[1e200], stop={"y": (None, 1e201)})


def test_a_stop_after_many_chunks(make_block):
    block = make_block("ramp", lambda t, x, u, params: 1 * u, lambda t, x, u, params: 1 * x, x=1)
    run = compile_diagram(block).run(10.0, 1e-4, inputs={"u": 1.0}, every=1000,
                                     stop={"y": (None, 7.5)})
    assert run.stopped.time == pytest.approx(7.5, abs=2e-4)
    np.testing.assert_allclose(run.outputs[0], run.time, rtol=1e-9)
    assert run.time.size == 77


@pytest.mark.parametrize(("stop", "text"), [
    ({"q_e": (0, 1)}, "no signal 'q_e'"),
    ({"q": (1, 0)}, r"stop\['q'\] must be a pair \(low, high\) with low < high"),
    ({"q": 1.0}, "must be a pair"), ({"q": (1, 2, 3)}, "must be a pair"),
    ({"q": (np.nan, 1)}, "must be a pair"),
])
def test_mistakes_are_named(program, stop, text):
    with pytest.raises(ClieError, match=text):
        program.run(**CALL, stop=stop)
