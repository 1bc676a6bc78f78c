import control as ct
import numpy as np
import pytest

from clie_blocks.compiled import compile_diagram
from clie_blocks.compiled.frontend.flatten import flatten, schedule
from clie_blocks.signals import DiagramError, interconnect, signals


def same_as_python_control(program, diagram, points=20):
    generator = np.random.default_rng(3)
    for _ in range(points):
        t, x = generator.uniform(0, 5), generator.standard_normal(diagram.nstates)
        u = generator.standard_normal(diagram.ninputs)
        np.testing.assert_allclose(program.dynamics(t, x, u), diagram.dynamics(t, x, u),
                                   rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(program.output(t, x, u), diagram.output(t, x, u),
                                   rtol=1e-12, atol=1e-12)


def filtered(name):
    lag = ct.ss([[-3.0]], [[2.0]], [[1.0]], [[0.5]], name="lag", inputs=["u[0]"],
                outputs=["y[0]"])
    square = ct.nlsys(None, lambda t, x, u, params: params["square.k"] * u**2, name="square",
                      inputs=signals("u", n=1), outputs=signals("y", n=1),
                      params={"square.k": 0.5})
    return interconnect([lag, square], [("square.u", "lag.y")], inputs={"u": "lag.u"},
                        outputs={"y": "square.y", "linear": "lag.y"}, name=name)


def nested(depth):
    inner = filtered("level0")
    for k in range(depth):
        other = filtered(f"side{k}")
        inner = interconnect(
            [inner, other], [(f"side{k}.u", f"level{k}.y", f"-level{k}.linear")],
            inputs={"u": f"level{k}.u"},
            outputs={"y": f"side{k}.y", "linear": f"level{k}.linear"},
            unused=[f"side{k}.linear"], name=f"level{k + 1}")
    return inner


@pytest.mark.parametrize("engine", ["llvm", "python"])
def test_nested_diagrams_equal_python_control(engine):
    diagram = nested(3)
    program = compile_diagram(diagram, engine)
    same_as_python_control(program, diagram)
    assert [leaf.name for leaf in flatten(diagram).leaves][:2] == [
        "level2.level1.level0.lag", "level2.level1.level0.square"]


def test_ports_of_nested_diagrams_can_be_logged():
    program = compile_diagram(nested(2))
    run = program.run(0.1, step=1e-2, inputs={"u": 1.0},
                      log=["y", "level1.side0.u", "level1.y", "level1.level0.linear"])
    side, shown, linear = run.outputs[1], run.outputs[2], run.outputs[3]
    assert run.output_labels[1:] == ["level1.side0.u[0]", "level1.y[0]",
                                     "level1.level0.linear[0]"]
    np.testing.assert_allclose(side, 0.5 * linear**2 - linear, atol=1e-15)
    assert np.ptp(shown) > 0


@pytest.mark.parametrize("system", [
    ct.tf([2.0, 1.0], [1.0, 0.4, 3.0]),
    ct.ss([[0.0, 1.0], [-2.0, -0.3]], [[0.0, 1.0], [1.0, 0.0]], [[1.0, 0.0]], [[0.0, 2.0]]),
    ct.feedback(ct.ss(-1, 1, 1, 0), ct.ss(-2, 1, 1, 0)),
    ct.interconnect([ct.ss(-1, 1, 1, 0, name="a", inputs="u", outputs="v"),
                     ct.ss(-2, 1, 1, 0, name="b", inputs="v", outputs="y")],
                    inputs="u", outputs="y"),
], ids=["transfer function", "state space", "feedback", "linear interconnection"])
def test_linear_systems_equal_their_matrices(system):
    program = compile_diagram(system)
    same_as_python_control(program, ct.ss(system))


def test_gains_on_wires_and_inputs_as_outputs():
    gain = ct.nlsys(None, lambda t, x, u, params: u, name="gain", inputs=1, outputs=1)
    lag = ct.ss(-1, 1, 1, 0, name="lag", inputs=["u[0]"], outputs=["y[0]"])
    diagram = ct.interconnect(
        [gain, lag], connections=[[(0, 0), (1, 0, -2.5)], [(1, 0), (0, 0, 0.5)]],
        inplist=[[(0, 0), (1, 0)]], outlist=[[(0, 0, 3.0), (1, 0, -1.0)]], name="wires")
    same_as_python_control(compile_diagram(diagram), diagram)


def test_parameter_values_follow_python_control_through_levels():
    diagram = nested(1)
    program = compile_diagram(diagram)
    for k in (0.5, 2.0):
        params = {"square.k": k}
        np.testing.assert_allclose(
            program.output(0.0, [1.0, 2.0], [0.3], params),
            diagram.output(0.0, [1.0, 2.0], [0.3], params=params), rtol=1e-14)


def test_one_key_with_two_values_keeps_both_apart():
    def gain(name, k):
        return ct.nlsys(None, lambda t, x, u, params: params["k"] * u, name=name, inputs=["u"],
                        outputs=["y"], params={"k": k})

    diagram = ct.interconnect([gain("a", 2.0), gain("b", 5.0)], connections=[["b.u", "a.y"]],
                              inplist=["a.u"], outlist=["b.y"], params={})
    program = compile_diagram(diagram)
    assert program.params == {"a.k": 2.0, "b.k": 5.0}
    assert program.output(0.0, [], [1.0]) == [10.0]
    assert program.output(0.0, [], [1.0], {"b.k": 1.0}) == [2.0]


def wire_through(name):
    """A diagram whose output is its own input, through no block."""
    idle = ct.ss(-1, 1, 1, 0, name="idle", inputs=["u"], outputs=["y"])
    made = ct.InterconnectedSystem([idle], inplist=[(0, 0)], outlist=[(0, 0)], name=name,
                                   inputs=["u"], outputs=["y"])
    made.output_map = np.array([[0.0, 1.0]])
    return made


def test_wire_through_a_diagram():
    program = compile_diagram(wire_through("wire"))
    assert program.output(0.0, [0.3], [0.7]) == [0.7]


def test_loop_of_wires_alone_is_refused():
    ring = ct.InterconnectedSystem(
        [wire_through("one"), wire_through("two")], name="ring", inputs=0, outputs=["y"],
        connections=[[(0, 0), (1, 0)], [(1, 0), (0, 0)]], outlist=[(0, 0)])
    with pytest.raises(DiagramError, match="form a loop without a block"):
        compile_diagram(ring)


def test_signals_come_after_what_they_need():
    needs = {"a": {"c"}, "b": set(), "c": {"b"}}
    assert schedule(needs, {}) == ["b", "c", "a"]


def static(name, function, u, y):
    return ct.nlsys(None, lambda t, x, u, params: function(u), name=name,
                    inputs=signals("u", n=u), outputs=signals("y", n=y))


def test_algebraic_loop_names_blocks_and_signals():
    blocks = [static("filter", lambda u: u, 1, 1), static("gain", lambda u: -u / 2, 1, 1),
              static("sum", lambda u: u[:1] + u[1:], 2, 1)]
    diagram = ct.interconnect(
        blocks, connections=[["gain.u[0]", "sum.y[0]"], ["sum.u[0]", "gain.y[0]"],
                             ["filter.u[0]", "gain.y[0]"]],
        inplist=["sum.u[1]"], outlist=["filter.y[0]"], name="loop")
    with pytest.raises(DiagramError) as refused:
        compile_diagram(diagram)
    text = str(refused.value)
    assert "algebraic loop: " in text and "gain.y[0]" in text and "sum.y[0]" in text
    assert "filter" not in text.split(".  ")[0].split("Each of these")[0]


def test_feedthrough_is_judged_signal_by_signal():
    # y[0] of each block reads u[1] only, so the loop through the blocks is none of the signals
    one = static("one", lambda u: np.array([u[1], u[0]]), 2, 2)
    two = static("two", lambda u: np.array([u[1], u[0]]), 2, 2)
    # python-control makes one pass per block and one more, too few here without idle blocks
    idle = [static(f"idle{k}", lambda u: u, 1, 1) for k in range(3)]
    diagram = interconnect(
        [one, two, *idle], [("two.u[0]", "one.y[0]"), ("one.u[0]", "two.y[1]"),
                            ("two.u[1]", "one.y[1]")],
        inputs={"r": ["one.u[1]", *(f"{block.name}.u" for block in idle)]},
        outputs={"y": "two.y[0]"}, unused=[f"{block.name}.y" for block in idle], name="crossed")
    program = compile_diagram(diagram)
    assert program.output(0.0, [], [0.7]) == [0.7]
    np.testing.assert_array_equal(diagram.output(0.0, [], [0.7]), [0.7])


def test_long_chain_of_static_blocks():
    n = 60
    blocks = [static(f"b{k}", lambda u: np.tanh(u) + 0.1, 1, 1) for k in range(n)]
    diagram = interconnect(
        blocks, [(f"b{k + 1}.u", f"b{k}.y") for k in reversed(range(n - 1))],
        inputs={"u": "b0.u"}, outputs={"y": f"b{n - 1}.y"}, name="chain")
    value = 0.4
    for _ in range(n):
        value = np.tanh(value) + 0.1
    assert compile_diagram(diagram, "python").output(0, [], [0.4]) == pytest.approx(value)
