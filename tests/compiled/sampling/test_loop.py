"""Sampled control of a continuous plant: exact against a plain loop over python-control."""

import control as ct
import numpy as np
import pytest

from clie_blocks import paper
from clie_blocks.compiled import METHODS, compile_diagram, sampled
from clie_blocks.compiled.runtime import simulate
from clie_blocks.controllers import pd_controller
from clie_blocks.diagrams.sampled_joint_loop import sampled_controller, sampled_joint_loop
from clie_blocks.effects import LIBRARY, with_effects
from clie_blocks.errors import ClieError, DivergedError
from clie_blocks.filters import difference_filter, velocity_filter
from clie_blocks.measurement import encoder
from clie_blocks.signals import DiagramError, interconnect, signals

STEP, PERIOD = 1e-3, 5e-3
METHOD = METHODS["ode5"]
WIRES = [("plant.u", "controller.u"), ("controller.q", "plant.q")]


def amplified_joint(n=1):
    """A joint with Coulomb friction behind an amplifier that saturates; input u, output q."""
    def motion(t, x, u, params):
        q, dq = x.reshape(2, n)
        friction = 0.2 * np.sign(dq) + 0.1 * np.exp(-np.abs(dq)) * np.sign(dq)
        return np.concatenate((dq, 8.0 * (u - friction - 0.3 * dq - 0.2 * np.sin(q))))

    joint = ct.nlsys(motion, lambda t, x, u, params: x[:n], name="joint", inputs=signals("u", n=n),
                     outputs=signals("q", n=n), states=signals("q", "dq", n=n))
    amplifier = ct.nlsys(None, lambda t, x, u, params: np.clip(u, -2.0, 2.0), name="amplifier",
                         inputs=signals("u", n=n), outputs=signals("u", n=n))
    return interconnect([amplifier, joint], [("joint.u", "amplifier.u")],
                        inputs={"u": "amplifier.u"}, outputs={"q": "joint.q"}, name="plant")


def play(width, period, name="play"):
    """Backlash with memory: the output moves only where the input pushes it."""
    def pushed(t, x, u, params):
        return np.clip(x, u - params[f"{name}.width"], u + params[f"{name}.width"])

    return ct.nlsys(pushed, pushed, dt=period, name=name, inputs=["q[0]"], outputs=["q[0]"],
                    states=["z"], params={f"{name}.width": width})


def law(period=PERIOD):
    """PD on a counted, differenced position behind some play; ports q_d, q, pe -> u."""
    return interconnect(
        [encoder(2e-3), play(5e-3, period), difference_filter(1, period),
         pd_controller([9.0], [0.8], name="pd")],
        [("play.q", "encoder.q_measured"), ("velocity_filter.q", "play.q"), ("pd.q", "play.q"),
         ("pd.dq", "velocity_filter.dq")],
        inputs={"q_d": "pd.q_d", "q": "encoder.q", "pe": "pd.pe"}, outputs={"u": "pd.u"},
        name="controller")


def one_step(plant, t, x, u):
    k = []
    for weights, c in zip(METHOD.a, METHOD.c):
        y = x + STEP * sum((w * rate for w, rate in zip(weights, k)), np.zeros_like(x))
        k.append(plant.dynamics(t + c * STEP, y, u))
    return x + STEP * sum(w * rate for w, rate in zip(METHOD.b, k))


def plain_loop(plant, parts, steps, x, into, late=lambda part, s: 0):
    """Sample and hold in plain Python; ``into(s, name, held)`` are the inputs of a block.

    Returns rows of the plant's states, the states of the parts, and what is held.
    """
    states = {part.name: np.zeros(part.nstates) for part in parts}
    after, wait = dict(states), {}
    held, rows = {part.name: np.zeros(part.noutputs) for part in parts}, []
    for s in range(steps + 1):
        t = s * STEP
        for part in parts:
            between = round(part.dt / STEP)
            if s % between == 0:
                wait[part.name] = late(part, s)
            if s % between == wait[part.name]:
                held["plant"] = plant.output(t, x, into(s, "plant", held))
                u, states[part.name] = into(s, part.name, held), after[part.name]
                held[part.name] = part.output(t, states[part.name], u)
                after[part.name] = part.dynamics(t, states[part.name], u)
        rows.append(np.concatenate([x, *(states[part.name] for part in parts),
                                    *(held[part.name] for part in parts)]))
        x = one_step(plant, t, x, into(s, "plant", held))
    return np.array(rows).T


def single(q_d, pe):
    """Inputs of plant and controller in the loop of `WIRES`."""
    def into(s, name, held):
        row = [q_d[s], held["plant"][0], pe[s]] if name == "controller" else held["controller"]
        return np.array(row)
    return into


def drive(steps, seed=3):
    random = np.random.default_rng(seed)
    return 0.4 + 0.3 * np.sign(np.sin(np.arange(steps + 1) / 60)), random.normal(0, 0.2, steps + 1)


def compare(program, expected, run):
    n = len(run.states)
    np.testing.assert_allclose(run.states, expected[:n], rtol=0, atol=1e-12)
    held = run.outputs[[run.output_labels.index("u[0]")]]
    np.testing.assert_allclose(held, expected[n:n + 1], rtol=0, atol=1e-12)


@pytest.mark.parametrize("engine", ["llvm", "python"])
def test_quantiser_and_play_equal_a_plain_loop_over_python_control(engine):
    plant, controller, steps = amplified_joint(), law(), 400
    q_d, pe = drive(steps)
    expected = plain_loop(plant, [controller], steps, np.array([0.1, 0.0]), single(q_d, pe))
    program = sampled(plant, controller, wires=WIRES, engine=engine)
    assert program.inputs == ["q_d[0]", "pe[0]"] and program.outputs == ["q[0]", "u[0]"]
    run = program.run(steps * STEP, step=STEP, inputs={"q_d": q_d, "pe": pe},
                      initial_state={"plant.joint": [0.1, 0.0]})
    compare(program, expected, run)
    assert np.ptp(run.outputs[0]) > 0.2


TIMING = [LIBRARY["time_delay"](delay=0.02), LIBRARY["packet_hold"](hold=0.03, interval=0.2),
          LIBRARY["setpoint_slew"](speed=1.5), LIBRARY["tick_jitter"](spread=0.01, beat=3.1)]


@pytest.mark.parametrize("effects", [*([one] for one in TIMING), TIMING],
                         ids=[*(one.name for one in TIMING), "all"])
def test_timing_effects_equal_a_plain_loop_over_python_control(effects):
    plant, controller, steps = amplified_joint(), with_effects(law(), effects), 300
    q_d, pe = drive(steps)
    expected = plain_loop(plant, [controller], steps, np.zeros(2), single(q_d, pe))
    run = sampled(plant, controller, wires=WIRES).run(
        steps * STEP, step=STEP, inputs={"q_d": q_d, "pe": pe})
    compare(None, expected, run)


def test_a_delay_of_n_samples_shifts_the_first_motion():
    plant, steps = amplified_joint(), 60
    for n in (0, 3):
        effects = [LIBRARY["time_delay"](delay=n * PERIOD)] if n else []
        run = sampled(plant, with_effects(law(), effects), wires=WIRES).run(
            steps * STEP, step=STEP, inputs={"q_d": 1.0, "pe": 0.0})
        assert np.flatnonzero(run.states[1])[0] == n * round(PERIOD / STEP) + 1


@pytest.mark.parametrize("engine", ["llvm", "python"])
def test_ticks_come_late_by_an_input(engine):
    plant, controller, steps = amplified_joint(), law(), 300
    q_d, pe = drive(steps)
    jitter = np.random.default_rng(1).uniform(-1e-3, 8e-3, steps + 1)
    expected = plain_loop(
        plant, [controller], steps, np.zeros(2), single(q_d, pe),
        late=lambda part, s: int(np.clip(np.rint(jitter[s] / STEP), 0, 4)))
    program = sampled(plant, controller, wires=WIRES, jitter=["controller"], engine=engine)
    assert program.inputs[-1] == "controller.jitter"
    inputs = {"q_d": q_d, "pe": pe, "controller.jitter": jitter}
    compare(program, expected, program.run(steps * STEP, step=STEP, inputs=inputs))
    none = program.run(steps * STEP, step=STEP, inputs=inputs | {"controller.jitter": 0.0})
    even = sampled(plant, controller, wires=WIRES).run(
        steps * STEP, step=STEP, inputs={"q_d": q_d, "pe": pe})
    np.testing.assert_array_equal(none.outputs, even.outputs)


@pytest.mark.parametrize("engine", ["llvm", "python"])
def test_cascade_of_two_rates_equals_a_plain_loop(engine):
    slow = ct.nlsys(lambda t, x, u, params: x + 0.02 * (u[:1] - u[1:]),
                    lambda t, x, u, params: 6.0 * (u[:1] - u[1:]) + x, dt=0.02, name="position",
                    states=["z"], inputs=["q_d", "q"], outputs=["dq_d"])
    fast = interconnect(
        [difference_filter(1, PERIOD), ct.ss([], [], [], [[0.7, -0.7]], PERIOD, name="gain",
                                             inputs=["dq_d", "dq[0]"], outputs=["u"])],
        [("gain.dq", "velocity_filter.dq")], inputs={"dq_d": "gain.dq_d",
                                                     "q": "velocity_filter.q"},
        outputs={"u": "gain.u"}, name="speed")
    plant, steps = amplified_joint(), 300

    def into(s, name, held):
        return {"position": lambda: np.array([0.5, held["plant"][0]]),
                "speed": lambda: np.array([held["position"][0], held["plant"][0]]),
                "plant": lambda: held["speed"]}[name]()

    expected = plain_loop(plant, [slow, fast], steps, np.zeros(2), into)
    run = sampled(plant, [slow, fast], engine=engine, wires=[
        ("plant.u[0]", "speed.u"), ("position.q", "plant.q[0]"), ("speed.q", "plant.q"),
        ("speed.dq_d", "position.dq_d")]).run(steps * STEP, step=STEP, inputs={"q_d": 0.5})
    assert run.output_labels == ["q[0]", "dq_d", "u"]
    np.testing.assert_allclose(run.states, expected[:5], rtol=0, atol=1e-12)
    np.testing.assert_allclose(run.outputs[1:], expected[5:], rtol=0, atol=1e-12)
    assert run.outputs[0, -1] > 0.2


def test_static_controller_is_sampled_by_the_period_given():
    plant = ct.ss([[-1.0]], [[1.0]], [[1.0]], [[0.0]], name="plant", inputs=["u"], outputs=["y"])
    gain = ct.nlsys(None, lambda t, x, u, params: params["gain.k"] * (u[:1] - u[1:]), name="gain",
                    inputs=["r", "y"], outputs=["u"], params={"gain.k": 2.0})
    program = sampled(plant, gain, 0.1, [("plant.u", "gain.u"), ("gain.y", "plant.y")])
    for k in (2.0, 5.0):
        run = program.run(1.0, step=0.01, inputs={"r": 1.0}, every=10, params={"gain.k": k})
        decay, x = np.exp(-0.1), [0.0]
        for _ in range(10):
            x.append(decay * x[-1] + (1 - decay) * k * (1.0 - x[-1]))
        np.testing.assert_allclose(run.states[0], x, rtol=1e-10)


def test_signals_of_the_controller_are_held_in_the_log():
    run = sampled(amplified_joint(), law(), wires=WIRES).run(
        0.3, step=STEP, inputs={"q_d": 1.0, "pe": 0.0}, log=["controller.q", "controller.pd.dq",
                                                             "plant.q", "u", "plant.u"])
    seen, speed, q, u, applied = run.outputs
    ticks = np.arange(q.size) // 5 * 5
    for held in (seen, speed, u):
        np.testing.assert_array_equal(held, held[ticks])
    np.testing.assert_array_equal(seen, q[ticks])
    np.testing.assert_array_equal(u, applied)
    assert not np.array_equal(q, q[ticks])


def test_chunks_decimation_and_stops_do_not_matter(monkeypatch):
    program = sampled(amplified_joint(), law(), wires=WIRES, jitter=["controller"])
    steps = 203
    random = np.random.default_rng(0)
    inputs = {"q_d": 1.0, "pe": random.normal(size=(steps, 1)),
              "controller.jitter": random.uniform(0, 4e-3, steps)}
    whole = program.run(steps * STEP, step=STEP, inputs=inputs)
    monkeypatch.setattr(simulate, "CHUNK", 7)
    for every in (1, 3, 29):
        some = program.run(steps * STEP, step=STEP, inputs=inputs, every=every)
        np.testing.assert_array_equal(some.states, whole.states[:, ::every])
    stopped = program.run(steps * STEP, step=STEP, inputs=inputs, stop={"q": (None, 0.2)})
    end = np.flatnonzero(whole.outputs[0] > 0.2)[0]
    np.testing.assert_array_equal(stopped.outputs, whole.outputs[:, :end + 1])


def test_divergence_names_the_plant():
    plant = ct.nlsys(lambda t, x, u, params: x**2 + u, lambda t, x, u, params: x, name="plant",
                     states=["x"], inputs=["u"], outputs=["q"])
    gain = ct.ss([], [], [], [[1.0]], 0.1, name="controller", inputs=["q"], outputs=["u"])
    with pytest.raises(DivergedError, match="state x of block 'plant'"):
        sampled(plant, gain, 0.1, WIRES).run(5.0, step=0.01, initial_state=[1.0])


def test_paper_arm_under_a_sampled_pd_law_with_g1_by_tustin():
    def final(period):
        loop = sampled_joint_loop(paper.paper_arm(), paper.KP, paper.KD, period)
        assert loop.outputs == ["q[0]", "q[1]", "dq[0]", "dq[1]", "u[0]", "u[1]"]
        return loop.run(2.0, step=1e-3, every=2000, inputs={
            "q_d": paper.SET_POINT, "pe": 0.0}).states[:4, -1]

    continuous = interconnect(
        [velocity_filter(2), pd_controller(paper.KP, paper.KD, name="pd"), paper.paper_arm()],
        [("pd.dq", "velocity_filter.dq"), ("plant.u", "pd.u"), ("pd.q", "plant.q"),
         ("velocity_filter.q", "plant.q")], inputs={"q_d": "pd.q_d", "pe": "pd.pe"},
        outputs={"q": "plant.q"}, unused=["plant.dq"], name="continuous")
    run = compile_diagram(continuous).run(2.0, step=1e-3, every=2000, inputs={
        "q_d": paper.SET_POINT, "pe": 0.0})
    limit = run.states[[label.startswith("plant.") for label in run.state_labels], -1]
    error = [np.max(np.abs(final(period) - limit)) for period in (8e-3, 4e-3, 2e-3)]
    # a hold delays by half a period: the difference is of first order in it
    assert error[0] > 1e-4
    np.testing.assert_allclose([error[0] / error[1], error[1] / error[2]], 2.0, rtol=0.25)


def test_paper_arm_equals_a_plain_loop_over_python_control():
    plant = paper.paper_arm()
    law, steps = sampled_controller(paper.KP, paper.KD, PERIOD), 60

    def into(s, name, held):
        return np.concatenate([paper.SET_POINT, held["plant"][:2], [0.3, -0.2]]) if (
            name == "controller") else held["controller"]

    expected = plain_loop(plant, [law], steps, np.zeros(4), into)
    run = sampled_joint_loop(plant, paper.KP, paper.KD, PERIOD).run(
        steps * STEP, step=STEP, inputs={"q_d": paper.SET_POINT, "pe": [0.3, -0.2]})
    scale = 1 + np.max(np.abs(expected), axis=1, keepdims=True)
    assert np.max(np.abs(run.states - expected[:8]) / scale[:8]) < 1e-12


def test_python_control_refuses_what_runs_here():
    plant, controller = amplified_joint(), law()
    with pytest.raises(ValueError, match="incompatible timebases"):
        ct.interconnect([plant, controller], inputs=["q_d[0]"], outputs=["q[0]"])
    sampled(plant, controller, wires=WIRES)


PLANT = ct.ss([[-1.0]], [[1.0]], [[1.0]], [[0.0]], name="plant", inputs=["u"], outputs=["q"])
TIMED = ct.ss([[0.5]], [[1.0]], [[1.0]], [[0.0]], 0.1, name="controller", inputs=["q"],
              outputs=["u"])
FLOWING = ct.ss([[-0.5]], [[1.0]], [[1.0]], [[0.0]], name="controller", inputs=["q"],
                outputs=["u"])
STATIC = ct.ss([], [], [], [[1.0]], name="controller", inputs=["q"], outputs=["u"])


@pytest.mark.parametrize(("arguments", "text"), [
    ((PLANT, FLOWING, 0.1, WIRES), "has states in continuous time.*sample_system"),
    ((TIMED, STATIC, 0.1, WIRES), "the plant 'controller' is in discrete time"),
    ((PLANT, STATIC, None, WIRES), "'controller' has no sample time of its own; give period="),
    ((PLANT, TIMED, 0.2, WIRES), "has the sample time 0.1 s, not 0.2 s"),
    ((PLANT, STATIC, -1.0, WIRES), "must be positive"),
    ((PLANT, STATIC, {"contrller": 1.0}, WIRES), "no sampled part.*did you mean 'controller'"),
    ((PLANT, TIMED, None, [("plant.u", "controller.v")]), "no output 'v'"),
])
def test_parts_that_do_not_fit_are_refused(arguments, text):
    with pytest.raises(DiagramError, match=text):
        sampled(*arguments)


def test_period_and_step_must_fit():
    with pytest.raises(ClieError, match=r"the period 0.1 s is not a multiple of the step 0.03 s"):
        sampled(PLANT, TIMED, None, WIRES).run(0.3, step=0.03)


def test_a_batch_equals_single_runs():
    program = sampled(amplified_joint(), law(), wires=WIRES, jitter=["controller"])
    gains, starts = np.linspace(3.0, 12.0, 5)[:, None], np.linspace(-0.2, 0.2, 10).reshape(5, 2)
    inputs = {"q_d": 1.0, "pe": np.random.default_rng(0).normal(size=(300, 1)),
              "controller.jitter": 1e-3}
    done = program.batch(0.3, step=STEP, inputs=inputs, params={"kp": gains},
                         initial_state={"plant.joint": starts}, every=10)
    for k in range(5):
        run = program.run(0.3, step=STEP, inputs=inputs, params={"kp": gains[k]},
                          initial_state={"plant.joint": starts[k]}, every=10)
        np.testing.assert_allclose(done.outputs[k], run.outputs, rtol=0, atol=1e-12)
        np.testing.assert_allclose(done.final_state[k], run.states[:, -1], rtol=0, atol=1e-12)


@pytest.mark.parametrize("question", [
    lambda program: program.as_nlsys(), lambda program: program.source("c"),
    lambda program: program.source("python")])
def test_questions_without_an_answer_name_the_remedy(question):
    program = sampled(PLANT, TIMED, None, WIRES)
    assert "define void @map0" in program.source("llvm")
    with pytest.raises(ClieError, match="a loop with sampled parts cannot .*; "):
        question(program)


@pytest.mark.parametrize("engine", ["llvm", "python"])
def test_an_opaque_law_is_called_back_at_its_ticks(engine):
    calls = []

    def relay(t, x, u, params):
        calls.append(t)
        return [-1.0 if float(u[0]) > 0 else 1.0]

    law = ct.nlsys(None, relay, dt=0.1, name="controller", inputs=["q"], outputs=["u"])
    law.opaque = True
    with pytest.warns(UserWarning, match="calls back block 'controller', output function"):
        program = sampled(PLANT, law, 0.1, WIRES, engine=engine)
    calls.clear()
    run = program.run(1.0, step=0.01, initial_state=[0.5], every=10)
    np.testing.assert_allclose(sorted(set(calls)), np.arange(11) * 0.1)
    expected = [0.5]
    for _ in range(10):
        u = -1.0 if expected[-1] > 0 else 1.0
        expected.append(u + (expected[-1] - u) * np.exp(-0.1))
    np.testing.assert_allclose(run.states[0], expected, rtol=1e-9)


@pytest.mark.parametrize("engine", ["llvm", "python"])
def test_a_plant_with_feedthrough_shows_a_tick_the_input_held_until_then(engine):
    plant = ct.ss([[-2.0]], [[1.0]], [[1.0]], [[0.5]], name="plant", inputs=["u"], outputs=["q"])
    law = ct.nlsys(lambda t, x, u, params: 0.5 * x + 0.1 * u[:1],
                   lambda t, x, u, params: x - 2.0 * u[:1] + u[1:], dt=PERIOD, name="controller",
                   states=["z"], inputs=["q", "r"], outputs=["u"])
    steps = 100

    def into(s, name, held):
        return np.array([held["plant"][0], np.cos(3 * s * STEP)]) if name == "controller" else (
            held["controller"])

    expected = plain_loop(plant, [law], steps, np.array([0.3]), into)
    run = sampled(plant, law, wires=WIRES, engine=engine).run(
        steps * STEP, step=STEP, inputs={"r": lambda t: np.cos(3 * t)},
        initial_state={"plant": [0.3]})
    np.testing.assert_allclose(run.states, expected[:2], rtol=0, atol=1e-12)
    np.testing.assert_allclose(run.outputs[1], expected[2], rtol=0, atol=1e-12)
    np.testing.assert_allclose(run.outputs[0], run.states[0] + 0.5 * run.outputs[1], atol=1e-15)


def test_transfer_functions_keep_their_names():
    plant = ct.tf([1.0], [1.0, 1.0], name="plant", inputs=["u"], outputs=["q"])
    law = ct.tf([2.0, -1.8], [1.0, -1.0], 0.1, name="controller", inputs=["e"], outputs=["u"])
    error = ct.ss([], [], [], [[1.0, -1.0]], 0.1, name="error", inputs=["r", "q"], outputs=["e"])
    run = sampled(plant, [error, law], wires=[
        ("plant.u", "controller.u"), ("controller.e", "error.e"), ("error.q", "plant.q")]).run(
        40.0, step=0.01, inputs={"r": 1.0}, log="q")
    assert run.outputs[0, -1] == pytest.approx(1.0, abs=1e-5)  # the law integrates


@pytest.mark.parametrize("seed", range(12))
def test_random_parts_that_read_each_other_equal_a_plain_loop(seed):
    random, steps = np.random.default_rng(seed), 80
    n, sizes = random.integers(0, 4), random.integers(0, 4, 2)

    def linear(size, inputs, outputs, dt, name, into, out):
        a, b, c, d = (random.normal(0, 0.4, shape) for shape in (
            (size, size), (size, inputs), (outputs, size), (outputs, inputs)))
        return ct.ss(a if dt else a - 2 * np.eye(size), b, c, d, dt, name=name, inputs=into,
                     outputs=out)

    plant = linear(n, 2, 2, 0, "plant", ["u", "w"], ["y", "z"])
    parts = [linear(size, 3, 2, STEP * random.integers(1, 6), name, ["y", "other", "r"],
                    ["u", "v"]) for size, name in zip(sizes, ("one", "two"))]
    r = random.normal(size=steps + 1)

    def into(s, name, held):
        one, two, y = held["one"], held["two"], held.get("plant", np.zeros(2))
        return np.array({"plant": lambda: [one[0] - two[1], two[0]],
                         "one": lambda: [y[0], two[1], r[s]],
                         "two": lambda: [y[1], one[1], r[s]]}[name]())

    expected = plain_loop(plant, parts, steps, np.zeros(n), into)
    run = sampled(plant, parts, engine=("llvm", "python")[seed % 2], inputs={
        "r": ["one.r", "two.r"]}, wires=[
        ("plant.u", "one.u", "-two.v"), ("plant.w", "two.u"), ("one.y", "plant.y"),
        ("two.y", "plant.z"), ("one.other", "two.v"), ("two.other", "one.v")]).run(
        steps * STEP, step=STEP, inputs={"r": r}, log=["one.u", "one.v", "two.u", "two.v"])
    found = np.vstack([run.states, run.outputs])
    np.testing.assert_allclose(found, expected, rtol=0,
                               atol=1e-12 * (1 + np.max(np.abs(expected))))
