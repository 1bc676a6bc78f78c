"""The silent traps of python-control 0.10.2, each shown first and then refused."""

import control as ct
import numpy as np
import pytest

from clie_blocks.signals import (
    DiagramError,
    interconnect,
    ports,
    signal,
    signals,
    summing,
    vector,
)


def gain(name, k, key="k"):
    return ct.nlsys(None, lambda t, x, u, params: params[key] * u, name=name, params={key: k},
                    inputs=["u"], outputs=["y"])


def integrator(name="plant"):
    return ct.nlsys(lambda t, x, u, params: u, lambda t, x, u, params: x, name=name, states=1,
                    inputs=["u"], outputs=["y"])


def chain(first, second):
    return [first, second], [(f"{second.name}.u", f"{first.name}.y")]


def test_equal_keys_are_merged_by_python_control_and_refused_here():
    blocks, wires = chain(gain("a", 2.0), gain("b", 5.0))
    plain = ct.interconnect(blocks, connections=[list(w) for w in wires],
                            inplist=["a.u"], outlist=["b.y"])
    assert plain.output(0, [], [1.0])[0] == 25.0  # not 10
    with pytest.raises(DiagramError, match=r"'k' is 2.0 in block 'a' but 5.0 in 'b'"):
        interconnect(blocks, wires, inputs={"u": "a.u"}, outputs={"y": "b.y"}, name="d")


def test_equal_keys_with_equal_values_are_shared():
    blocks, wires = chain(gain("a", 2.0), gain("b", 2.0))
    diagram = interconnect(blocks, wires, inputs={"u": "a.u"}, outputs={"y": "b.y"}, name="d")
    assert diagram.output(0, [], [1.0])[0] == 4.0
    assert diagram.output(0, [], [1.0], params={"k": 3.0})[0] == 9.0


def test_unknown_parameter_is_ignored_by_python_control_and_refused_here():
    plain = gain("a", 2.0)
    assert plain.output(0, [], [1.0], params={"typo": 7.0})[0] == 2.0
    diagram = interconnect([plain], [], inputs={"u": "a.u"}, outputs={"y": "a.y"}, name="d")
    with pytest.raises(DiagramError, match="no block has the parameter 'typo'.*known: k"):
        diagram.output(0, [], [1.0], params={"typo": 7.0})


def test_nested_diagrams_pass_parameters_down():
    inner = interconnect([gain("a", 2.0)], [], inputs={"u": "a.u"}, outputs={"y": "a.y"},
                         name="inner")
    outer = interconnect([inner, gain("b", 5.0, key="b.k")], [("b.u", "inner.y")],
                         inputs={"u": "inner.u"}, outputs={"y": "b.y"}, name="outer")
    assert outer.output(0, [], [1.0], params={"k": 3.0})[0] == 15.0
    with pytest.raises(DiagramError, match="did you mean 'b.k'"):
        outer.output(0, [], [1.0], params={"b.kk": 3.0})


def test_equal_output_names_are_summed_by_python_control_and_must_be_qualified_here():
    blocks = [gain("a", 2.0), gain("b", 5.0, key="b.k")]
    plain = ct.interconnect(blocks, inplist=[["a.u", "b.u"]], outputs=["y"])
    assert plain.output(0, [], [1.0])[0] == 7.0
    with pytest.raises(DiagramError, match="write 'block.port'"):
        interconnect(blocks, [], inputs={"u": ["a.u", "b.u"]}, outputs={"y": "y"}, name="d")


def test_unused_signal_is_a_warning_in_python_control_and_an_error_here():
    blocks = [gain("a", 2.0), integrator()]
    with pytest.warns(UserWarning, match="Unused"):
        ct.interconnect(blocks, connections=[["plant.u", "a.y"]], inplist=["a.u"],
                        outlist=["a.y"])
    with pytest.raises(DiagramError, match="nothing drives plant.u"):
        interconnect(blocks, [], inputs={"u": "a.u"}, outputs={"y": "a.y"}, name="d")
    with pytest.raises(DiagramError, match="nothing reads plant.y.*unused="):
        interconnect(blocks, [("plant.u", "a.y")], inputs={"u": "a.u"}, outputs={}, name="d")
    interconnect(blocks, [("plant.u", "a.y")], inputs={"u": "a.u"}, outputs={"y": "a.y"},
                 unused=["plant.y"], name="d")


def test_shared_block_carries_parameters_between_plain_diagrams_but_not_between_ours():
    block = gain("a", 2.0)

    def plain():
        return ct.InterconnectedSystem([block], inplist=["a.u"], outlist=["a.y"])

    first, second = plain(), plain()
    second._update_params({"k": 100.0})
    assert first._out(0, np.zeros(0), np.array([1.0]))[0] == 100.0  # not 2
    ours = [interconnect([block], [], inputs={"u": "a.u"}, outputs={"y": "a.y"}, name="d")
            for _ in range(2)]
    ours[0]._update_params({})
    ours[1]._update_params({"k": 100.0})
    assert ours[0]._out(0, np.zeros(0), np.array([1.0]))[0] == 2.0


def test_subsystem_input_as_output_breaks_print_in_python_control_and_is_refused_here():
    blocks, wires = chain(gain("a", 2.0), integrator())
    plain = ct.interconnect(blocks, connections=[list(w) for w in wires], inplist=["a.u"],
                            outlist=["plant.u", "plant.y"])
    with pytest.raises(IndexError):
        str(plain)
    with pytest.raises(DiagramError, match="block 'plant' has no output 'u'.*known: y"):
        interconnect(blocks, wires, inputs={"u": "a.u"},
                     outputs={"y": "plant.y", "v": "plant.u"}, name="d")


def test_two_wires_into_one_port_are_added_by_python_control_and_refused_here():
    blocks = [gain("a", 2.0), gain("b", 5.0, key="b.k"), integrator()]
    with pytest.raises(DiagramError, match="plant.u is driven twice"):
        interconnect(blocks, [("plant.u", "a.y"), ("plant.u", "b.y")],
                     inputs={"u": ["a.u", "b.u"]}, outputs={"y": "plant.y"}, name="d")


def test_sizes_that_differ_are_named():
    two = summing("a", "-b", output="y", n=2, name="two")
    three = summing("a", "-b", output="y", n=3, name="three")
    with pytest.raises(DiagramError, match="three.a has 3 signals but two.y has 2"):
        interconnect([two, three], [("three.a", "two.y")], inputs={}, outputs={}, name="d")


def test_blocks_of_one_name_are_refused():
    with pytest.raises(DiagramError, match="two blocks are called 'a'"):
        interconnect([gain("a", 1.0), gain("a", 1.0)], [], inputs={}, outputs={}, name="d")


def test_minus_subtracts_and_sources_add():
    n = 2
    sources = [summing("x", output="y", n=n, name=name) for name in "abc"]
    total = summing("x", output="y", n=n, name="total")
    diagram = interconnect(
        [*sources, total], [("total.x", "a.y", "-b.y", "c.y")],
        inputs={name: f"{name}.x" for name in "abc"}, outputs={"y": "total.y"}, name="d")
    u = np.arange(6.0)
    np.testing.assert_array_equal(diagram.output(0, [], u), u[:2] - u[2:4] + u[4:])


def test_mistyped_port_names_the_nearest():
    blocks, wires = chain(gain("a", 2.0), integrator())
    with pytest.raises(DiagramError, match="did you mean 'plant'"):
        interconnect(blocks, [("plnt.u", "a.y")], inputs={}, outputs={}, name="d")


def test_signal_labels_and_groups():
    labels = signals("q", "dq", n=2)
    assert labels == ["q[0]", "q[1]", "dq[0]", "dq[1]"]
    assert ports([*labels, "t"]) == {"q": [0, 1], "dq": [2, 3], "t": [4]}


def test_signal_of_a_response():
    response = ct.TimeResponseData([0.0, 1.0], np.arange(6.0).reshape(3, 2),
                                   output_labels=["t", "q[0]", "q[1]"], issiso=False)
    np.testing.assert_array_equal(signal(response, "q"), [[2.0, 3.0], [4.0, 5.0]])
    with pytest.raises(DiagramError, match="did you mean 'q'"):
        signal(response, "qq")


@pytest.mark.parametrize("value, options, message", [
    ("x", {}, "must be a number"), ([1.0, np.nan], {}, "finite"), ([[1.0]], {}, "shape"),
    ([1.0, 2.0], {"n": 3}, "3 numbers, one per joint"), ([0.0], {"above": 0}, "greater than 0"),
    ([-1.0], {"least": 0}, "at least 0")])
def test_vector_says_what_is_wrong(value, options, message):
    with pytest.raises(DiagramError, match=f"pd: kp.*{message}"):
        vector(value, "pd: kp", unit="N m/rad", **options)


def test_vector_spreads_a_scalar_and_copies():
    values = np.ones(3)
    assert vector(values, "x") is not values
    np.testing.assert_array_equal(vector(2.0, "x", n=3), [2.0, 2.0, 2.0])
