import control as ct
import numpy as np
import pytest

from clie_blocks.compiled import compile_diagram
from clie_blocks.compiled.frontend.flatten import schedule
from clie_blocks.signals import DiagramError, interconnect, signals


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
