"""Pictures of diagrams: what is drawn, read from the plan, not from pixels."""

import cProfile
from pathlib import Path

import control as ct
import numpy as np
import pytest

from clie_blocks.controllers import pd_controller
from clie_blocks.diagrams.drawing.graph import read_graph
from clie_blocks.diagrams.drawing.layout import layout
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.diagrams.picture import draw
from clie_blocks.filters import velocity_filter
from clie_blocks.joints import decoupled_joints
from clie_blocks.output import save_figure
from clie_blocks.signals import DiagramError, interconnect, signals, summing


def static(function, name, n=1):
    return ct.nlsys(None, lambda t, x, u, params: function(u), name=name,
                    inputs=signals("u", n=n), outputs=signals("y", n=n))


def siso(numerator, denominator, name):
    return ct.tf(numerator, denominator, name=name, inputs=["u[0]"], outputs=["y[0]"])


@pytest.fixture
def textbook():
    """Unity feedback: sum, gain, integrator, limiter, plant."""
    return interconnect(
        [summing("r", "-y", output="e", n=1, name="error"), siso([3], [1], "gain"),
         siso([1], [1, 0], "integrator"), static(lambda u: np.clip(u, -1, 1), "limit"),
         siso([2], [1, 2], "plant")],
        connections=[("gain.u", "error.e"), ("integrator.u", "gain.y"),
                     ("limit.u", "integrator.y"), ("plant.u", "limit.y"), ("error.y", "plant.y")],
        inputs={"r": "error.r"}, outputs={"y": "plant.y"}, name="textbook")


@pytest.fixture
def joints():
    plant = decoupled_joints([1, 2], [1, 2], [0, 0])
    return joint_loop(plant, kp=[10, 10], kd=[5, 5])


def test_forward_chain_stands_on_one_line_from_left_to_right(textbook):
    boxes = layout(textbook).boxes
    chain = [boxes[key] for key in (">r", "error", "gain", "integrator", "limit", "plant", "y>")]
    assert {box.middle[1] for box in chain} == {chain[0].middle[1]}
    assert all(a.x + a.width < b.x for a, b in zip(chain, chain[1:]))


def test_feedback_runs_outside_the_chain(textbook):
    plan = layout(textbook)
    back = next(run for run in plan.runs if run.source == ("plant", "y"))
    low = max(box.y + box.height for box in plan.boxes.values())
    assert max(y for piece in back.pieces for _, y in piece) > low


def test_feedback_enters_the_sum_straight_from_below(textbook):
    plan = layout(textbook)
    back = next(run for run in plan.runs if run.source == ("plant", "y"))
    x, _ = plan.boxes["error"].middle
    assert min(x for piece in back.pieces for x, _ in piece) == x
    assert [arrow[2:] for arrow in back.arrows if arrow[0] == x] == [(0, -1)]


def test_icons_show_what_the_blocks_do(textbook):
    blocks = read_graph(textbook).blocks
    assert (blocks["error"].kind, blocks["error"].signs) == ("sum", ("+", "\u2212"))
    assert (blocks["gain"].kind, blocks["gain"].icon.content) == ("gain", "$3$")
    assert blocks["integrator"].icon.content == r"$\frac{1}{s}$"
    assert blocks["plant"].icon.content == r"$\frac{2}{s+2}$"
    x, y = blocks["limit"].icon.content
    np.testing.assert_allclose(y, np.clip(x, -1, 1), rtol=1e-12)
    assert max(x) > 1.2


def test_filter_shows_the_formula_of_the_paper():
    block = velocity_filter(2)
    loop = interconnect([block], [], inputs={"q": "velocity_filter.q"},
                        outputs={"dq": "velocity_filter.dq"}, name="filter")
    icon = read_graph(loop).blocks["velocity_filter"].icon
    assert icon.content == r"$\frac{200\,s}{s+200}\cdot\frac{300}{s+300}$"


@pytest.mark.parametrize("system, formula", [
    (siso([2, 1], [1, 0.5, 4], "g"), r"$\frac{2\,(s+0.5)}{s^2+0.5s+4}$"),
    (siso([5, 0], [1, 3], "g"), r"$\frac{5\,s}{s+3}$"),
    (ct.ss([[0.5]], [[1]], [[1]], [[0]], 0.1, name="g", inputs=["u[0]"], outputs=["y[0]"]),
     r"$\frac{1}{z-0.5}$"),
])
def test_formula_has_the_zeros_poles_and_gain(system, formula):
    loop = ct.interconnect([system], inplist=["g.u[0]"], outlist=["g.y[0]"], name="d")
    assert read_graph(loop).blocks["g"].icon.content == formula


def test_a_block_may_declare_its_own_characteristic():
    block = static(lambda u: 2 * u, "play")
    block.icon = ("curve", np.sign)
    loop = interconnect([block], [], inputs={"u": "play.u"}, outputs={"y": "play.y"}, name="d")
    x, y = read_graph(loop).blocks["play"].icon.content
    np.testing.assert_array_equal(y, np.sign(x))


def test_a_vector_is_one_wire_with_its_width(joints):
    graph = read_graph(joints)
    wires = [wire for wire in graph.wires if wire.target == ("plant", "u")]
    assert [(wire.source, wire.width) for wire in wires] == [(("pd", "u"), 2)]
    widths = [label.text for label in layout(joints).labels if label.text.isdigit()]
    assert widths == ["2"] * len({wire.source for wire in graph.wires})


def test_a_vector_that_is_taken_apart_is_drawn_by_elements():
    a, b = static(np.tanh, "a", n=2), static(np.tanh, "b")
    loop = ct.interconnect([a, b], connections=[["b.u[0]", "a.y[1]"]], inplist=["a.u"],
                           outlist=["a.y[0]", "b.y"], inputs=2, outputs=["first", "second"],
                           name="d")
    graph = read_graph(loop)
    assert graph.blocks["a"].outputs == ("y[0]", "y[1]")
    assert [wire.source for wire in graph.wires if wire.target[0] == "b"] == [("a", "y[1]")]


def test_several_sources_meet_in_a_sum_with_signs():
    plant, load = static(np.tanh, "plant", n=2), static(np.tanh, "load", n=2)
    pd = static(np.tanh, "pd", n=2)
    loop = interconnect([pd, plant, load],
                        [("plant.u", "pd.y", "-load.y"), ("load.u", "plant.y")],
                        inputs={"r": "pd.u"}, outputs={"y": "plant.y"}, name="d")
    sums = [block for block in read_graph(loop).blocks.values() if block.kind == "sum"]
    assert [block.signs for block in sums] == [("+", "\u2212")]


def test_a_factor_on_a_wire_becomes_a_gain():
    a, b = static(np.tanh, "a"), static(np.tanh, "b")
    loop = ct.interconnect([a, b], connections=[[(1, 0), (0, 0, -2.5)]], inplist=["a.u[0]"],
                           outlist=["b.y[0]"], inputs=["r"], outputs=["y"], name="d")
    gains = [block.icon.content for block in read_graph(loop).blocks.values()
             if block.kind == "gain"]
    assert gains == ["$-2.5$"]


def test_plant_branch_stands_above_the_model_branch():
    from clie_blocks.diagrams.clie_loop import clie_loop

    plant = decoupled_joints([1, 2], [1, 2], [0, 0])
    boxes = layout(clie_loop(plant, [10, 10], [5, 5], 20.0)).boxes
    assert boxes["pd"].y < boxes["pd_model"].y and boxes["plant"].y < boxes["model"].y
    assert boxes["plant"].middle[1] < boxes["input_error"].middle[1] < boxes["model"].middle[1]
    assert boxes["model"].x < boxes["regressor"].x < boxes["update"].x
    assert boxes["pd"].middle[1] == boxes["plant"].middle[1]


def test_same_diagram_gives_the_same_bytes(joints, tmp_path):
    first, second = (Path(save_figure(draw(joints), tmp_path / name, "loop", ["svg"])[0])
                     .read_bytes() for name in "ab")
    assert first == second and b"<svg" in first


def test_texts_stay_in_the_room_kept_for_them(joints):
    figure = draw(joints)
    axes = figure.axes[0]
    for text, label in zip(axes.texts, layout(joints).labels):
        shown = text.get_window_extent().transformed(axes.transData.inverted())
        assert text.get_text() == label.text
        assert shown.width <= label.width + 3.0
        assert abs((shown.x0 + shown.x1) / 2 - label.x) < 2.0


def test_values_colour_blocks_and_add_a_bar(joints):
    figure = draw(joints, values={"pd": 0.1, "plant": 0.9}, value_label="share")
    assert len(figure.axes) == 2 and figure.axes[1].get_ylabel() == "share"
    colours = {tuple(np.round(patch.get_facecolor(), 3)) for patch in figure.axes[0].patches}
    assert len(colours) >= len({tuple(np.round(patch.get_facecolor(), 3))
                                for patch in draw(joints).axes[0].patches}) + 1


def test_names_can_be_shown_otherwise(joints):
    texts = [label.text for label in layout(joints, names={"pd": "PD controller"}).labels]
    assert "PD controller" in texts and "pd" not in texts


@pytest.mark.parametrize("keyword", ["values", "names", "expand"])
def test_an_unknown_block_is_named_with_the_nearest(joints, keyword):
    value = {"plnt"} if keyword == "expand" else {"plnt": 1.0}
    with pytest.raises(DiagramError, match="plnt"):
        draw(joints, **{keyword: value})


def test_the_cost_of_a_picture_grows_slower_than_the_cube_of_its_blocks(textbook):
    from clie_blocks.diagrams.clie_composite import clie_composite

    plant = decoupled_joints([1, 2], [1, 2], [0, 0])
    loop = clie_composite(plant, [10, 10], [5, 5], 20.0, 0.1, velocity="filtered-both")
    assert len(loop.syslist) >= 14
    blocks = len(loop.syslist) / len(textbook.syslist)
    assert calls_to_plan(loop) < blocks**3 * calls_to_plan(textbook)


def calls_to_plan(diagram):
    """Calls of functions that the plan of a picture takes, on any machine as many."""
    calls = cProfile.Profile()
    calls.runcall(layout, diagram)
    return sum(entry.callcount for entry in calls.getstats())


def test_a_single_block_and_the_algebra_of_python_control_are_drawn(tmp_path):
    gain, plant = static(lambda u: 2 * u, "gain"), siso([1], [1, 1], "plant")
    for number, system in enumerate((pd_controller([1, 2], [1, 2]), plant, ct.ss(plant),
                                     ct.feedback(gain, ct.ss(plant)),
                                     ct.series(gain, ct.ss(plant)))):
        (path,) = save_figure(draw(system), tmp_path, f"figure_{number}", ("svg",))
        assert "</svg>" in Path(path).read_text()
    with pytest.raises(DiagramError, match="no block of python-control"):
        draw(3.0)
