"""A picture does not depend on how blocks are listed, keeps its places, and obeys its hints."""

import itertools
import xml.etree.ElementTree as ElementTree

import control as ct
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clie_blocks import paper
from clie_blocks.controllers import pd_controller
from clie_blocks.diagrams import picture
from clie_blocks.diagrams.clie_composite import clie_composite
from clie_blocks.diagrams.clie_loop import clie_loop
from clie_blocks.diagrams.drawing.canonical import canonical
from clie_blocks.diagrams.drawing.graph import read_graph
from clie_blocks.diagrams.drawing.layout import layout
from clie_blocks.diagrams.feedback_linearization import feedback_linearization
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.diagrams.picture import draw
from clie_blocks.identification import gradient_update, regressor
from clie_blocks.joints import decoupled_joints, estimated_model
from clie_blocks.output import save_figure
from clie_blocks.signals import DiagramError, interconnect, signals, summing

ARM, GAINS = decoupled_joints(*paper.THETA.reshape(3, 2)), (paper.KP, paper.KD)
PAPER = {
    "joint_loop": joint_loop(ARM, *GAINS),
    "clie_loop": clie_loop(ARM, *GAINS, 20.0),
    "clie_composite": clie_composite(ARM, *GAINS, 20.0, 0.1, velocity="filtered-both"),
    "feedback_linearization": feedback_linearization(ARM, paper.THETA_HAT[1], *GAINS)}


def siso(function, name, states=0):
    if states:
        return ct.nlsys(lambda t, x, u, params: u - x, lambda t, x, u, params: x, states=1,
                        name=name, inputs=signals("u", n=1), outputs=signals("y", n=1))
    return ct.nlsys(None, lambda t, x, u, params: function(u), name=name,
                    inputs=signals("u", n=1), outputs=signals("y", n=1))


def listed_in(order):
    """The loop of sum, controller, saturation and plant, listed in some order."""
    return interconnect(
        list(order), [("controller.u", "error.e"), ("saturation.u", "controller.y"),
                      ("plant.u", "saturation.y"), ("error.y", "plant.y")],
        inputs={"r": "error.r"}, outputs={"y": "plant.y"}, name="loop")


LOOP = [summing("r", "-y", output="e", n=1, name="error"),
        siso(lambda u: 3 * u, "controller"), siso(lambda u: np.clip(u, -1, 1), "saturation"),
        siso(None, "plant", states=1)]


def places(plan):
    """Everything that is drawn, with where."""
    return ([(key, box.x, box.y, box.width, box.height, box.left, box.right)
             for key, box in plan.boxes.items()],
            [(run.source, run.targets, run.pieces) for run in plan.runs])


def test_all_24_orders_of_a_loop_give_one_picture():
    first = places(layout(listed_in(LOOP)))
    for order in itertools.permutations(LOOP):
        assert places(layout(listed_in(order))) == first
    x = {key: left for key, left, *_ in first[0]}
    chain = [">r", "error", "controller", "saturation", "plant", "y>"]
    assert sorted(chain, key=x.__getitem__) == chain


def permuted(diagram, order):
    """The same diagram with its blocks listed in another order."""
    blocks = [diagram.syslist[k] for k in order]
    rows = [np.cumsum([0, *(getattr(b, side) for b in diagram.syslist)])
            for side in ("ninputs", "noutputs")]
    into, out = (np.concatenate([np.arange(edge[k], edge[k + 1]) for k in order])
                 for edge in rows)
    found = ct.InterconnectedSystem(blocks, inputs=diagram.input_labels,
                                    outputs=diagram.output_labels, name=diagram.name)
    found.set_connect_map(diagram.connect_map[np.ix_(into, out)])
    found.set_input_map(diagram.input_map[into])
    shown = np.concatenate([out, len(out) + into])[:diagram.output_map.shape[1]]
    found.set_output_map(diagram.output_map[:, shown])
    return found


def wiring(diagram):
    """What the layout is made from: blocks in their order, and wires."""
    graph = canonical(read_graph(diagram))
    return [(key, b.kind, b.inputs, b.outputs, b.signs) for key, b in graph.blocks.items()], \
        graph.wires


@pytest.mark.parametrize("name", PAPER)
@settings(max_examples=10, deadline=None)
@given(data=st.data())
def test_the_paper_s_diagrams_are_read_alike_in_any_order(name, data):
    diagram = PAPER[name]
    order = data.draw(st.permutations(range(len(diagram.syslist))))
    assert wiring(permuted(diagram, order)) == wiring(diagram)


def test_fig_2_is_one_picture_listed_forwards_and_backwards():
    diagram = PAPER["clie_loop"]
    backwards = permuted(diagram, range(len(diagram.syslist))[::-1])
    assert places(layout(backwards)) == places(layout(diagram))


def lesson():
    """The diagrams of the lesson: Fig. 2 grows block by block from Fig. 1."""
    blocks = [pd_controller(*GAINS, name="pd"), decoupled_joints(*paper.THETA.reshape(3, 2)),
              estimated_model(2, name="model"), pd_controller(*GAINS, name="pd_model"),
              summing("u_model", "-u", output="e_u", n=2, name="input_error"),
              regressor(2, name="regressor"), gradient_update(20.0, *GAINS, name="update")]
    wires = [("plant.u", "pd.u"), ("pd.q", "plant.q"), ("pd.dq", "plant.dq"),
             ("model.u", "pd_model.u"), ("pd_model.q", "model.q"), ("pd_model.dq", "model.dq"),
             ("input_error.u_model", "pd_model.u"), ("input_error.u", "pd.u"),
             ("regressor.dq", "model.dq"), ("regressor.u", "pd_model.u"),
             ("update.e_u", "input_error.e_u"), ("update.phi", "regressor.phi"),
             ("model.theta_hat", "update.theta_hat")]
    one = {"q_d": ["pd.q_d"], "pe": ["pd.pe"]}
    both = {"q_d": ["pd.q_d", "pd_model.q_d"], "pe": ["pd.pe", "pd_model.pe"]}
    free, theta = {"u_model": "model.u", "theta_hat": "model.theta_hat"}, {
        "theta_hat": "model.theta_hat"}
    q, u, e_u = {"q": "plant.q"}, {"u": "pd.u"}, {"e_u": "input_error.e_u"}
    model = {**q, "q_model": "model.q"}
    steps = [(2, 3, one, {**q, **u}), (3, 3, {**one, **free}, {**model, "dq_model": "model.dq"}),
             (4, 6, {**both, **theta}, {**model, **u, "u_model": "pd_model.u"}),
             (5, 8, {**both, **theta}, {**model, **e_u}),
             (6, 10, {**both, **theta}, {**model, **e_u, "phi": "regressor.phi"}),
             (7, 13, both, {**model, **e_u, "theta_hat": "update.theta_hat"})]
    for k, (count, wired, inputs, outputs) in enumerate(steps):
        yield interconnect(blocks[:count], wires[:wired], inputs=inputs, outputs=outputs,
                           name=f"step_{k + 1}")


def test_a_picture_that_grows_keeps_its_places():
    former = None
    for diagram in itertools.islice(lesson(), 5):
        figure = draw(diagram, like=former)
        if former is not None:
            check_kept(*(picture._PLANS[one].boxes for one in (former, figure)))
        former = figure


def check_kept(before, after):
    kept = [key for key in before if key in after]
    assert {"pd", "plant"} <= set(kept)
    for a, b in itertools.combinations(kept, 2):
        old, new = [(boxes[a], boxes[b]) for boxes in (before, after)]
        if all(box.block.kind not in ("input", "output") for box in old):
            assert np.sign(old[0].column - old[1].column) == np.sign(
                new[0].column - new[1].column), (a, b)
        if old[0].column == old[1].column and new[0].column == new[1].column:
            assert (old[0].y < old[1].y) == (new[0].y < new[1].y), (a, b)
    for key in kept:
        for side in ("left", "right"):
            old, new = getattr(before[key], side), getattr(after[key], side)
            assert [port for port in new if port in old] == list(old)


def test_without_the_former_picture_the_lesson_reshuffles():
    """Else the test above would hold without the hint."""
    plans = [layout(diagram) for diagram in itertools.islice(lesson(), 3)]
    with pytest.raises(AssertionError):
        for before, after in itertools.pairwise(plans):
            check_kept(before.boxes, after.boxes)


def test_columns_and_order_are_obeyed():
    step_3 = next(itertools.islice(lesson(), 2, None))
    figure = draw(step_3, columns=[["plant", "pd_model"], ["pd"], ["model"]],
                  order=["pd_model", "plant"])
    boxes = picture._PLANS[figure].boxes
    assert boxes["plant"].column == boxes["pd_model"].column
    assert boxes["plant"].x < boxes["pd"].x < boxes["model"].x
    assert boxes["pd_model"].y < boxes["plant"].y
    other = picture._PLANS[draw(step_3, columns=[["plant", "pd_model"]],
                                order=["plant", "pd_model"])].boxes
    assert other["pd_model"].y > other["plant"].y


def test_a_hint_of_the_user_goes_before_the_former_picture():
    steps = list(itertools.islice(lesson(), 3))
    former = draw(steps[1], columns=[["pd"], ["plant", "model"]])
    boxes = picture._PLANS[draw(steps[2], like=former)].boxes
    assert boxes["model"].column == boxes["plant"].column > boxes["pd"].column
    boxes = picture._PLANS[draw(steps[2], like=former, columns=[["plant"], ["pd"]])].boxes
    assert boxes["plant"].x < boxes["pd"].x


def test_order_holds_for_inputs_and_outputs():
    diagram = PAPER["joint_loop"]
    for order in ([">pe", ">q_d"], [">q_d", ">pe"]):
        boxes = picture._PLANS[draw(diagram, order=order)].boxes
        assert boxes[order[0]].y < boxes[order[1]].y


@pytest.mark.parametrize("hint, said", [
    ({"columns": [["pdd"]]}, r"columns has 'pdd'.*did you mean 'pd'"),
    ({"columns": [[">q_d"]]}, "columns has '>q_d'"),
    ({"columns": ["pd", "plant"]}, "list of keys for each column"),
    ({"columns": [["pd"], ["pd"]]}, "'pd' twice"),
    ({"order": ["pd", "plnt"]}, "order has 'plnt'.*did you mean 'plant'"),
    ({"order": "plnt"}, "order has 'plnt'"),
    ({"like": 3}, "like has int, which is no picture"),
])
def test_a_hint_that_names_no_block_says_so(hint, said):
    with pytest.raises(DiagramError, match=said):
        draw(PAPER["joint_loop"], **hint)


def test_an_svg_holds_the_picture_in_words(tmp_path):
    figure = draw(listed_in(LOOP), names={"plant": "joint <1> & gear"})
    path = save_figure(figure, tmp_path, "loop", ("svg",))[0]
    root = ElementTree.parse(path).getroot()
    name = "{http://www.w3.org/2000/svg}"
    title, text = root.find(f"{name}title"), root.find(f"{name}desc")
    assert root.get("role") == "img"
    assert root.get("aria-labelledby").split() == [title.get("id"), text.get("id")]
    assert title.text == "Block diagram loop"
    assert text.text == (
        "Input: r. Output: y. error adds r and minus y of joint <1> & gear. "
        "controller takes e of error. saturation takes y of controller. "
        "joint <1> & gear takes y of saturation. Output y shows y of joint <1> & gear.")


def test_blocks_of_one_name_are_drawn_apart():
    """python-control's algebra repeats names."""
    block = siso(np.tanh, "friction")
    with pytest.warns(UserWarning, match="duplicate object"):
        twice = ct.series(block, block)
    assert {"friction", "friction#2"} <= set(layout(twice).boxes)


@pytest.mark.parametrize("block", [
    ct.tf([1, 1], [1], name="improper"), ct.frd([1, 2j], [1, 2], name="measured"),
    ct.tf([[[1], [2]], [[3], [4]]], [[[1, 1], [1, 2]], [[1, 3], [1, 4]]], name="two_by_two")],
    ids=lambda block: block.name)
def test_what_has_ports_is_one_box(block):
    boxes = picture._PLANS[draw(block)].boxes
    assert [key for key, box in boxes.items()
            if box.block.kind not in ("input", "output")] == [block.name]
    assert sum(box.block.kind == "input" for box in boxes.values()) == 1  # a vector is one wire


def test_feedback_is_drawn_with_its_structure():
    loop = ct.feedback(siso(np.tanh, "drive"), ct.ss(-1, 1, 1, 0, name="plant"))
    boxes = layout(loop).boxes
    (junction,) = [box for box in boxes.values() if box.block.kind == "sum"]
    assert junction.block.signs == ("+", "\u2212")
    assert junction.x < boxes["drive"].x and {"plant", "drive"} <= set(boxes)
