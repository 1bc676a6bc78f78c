"""Nothing in a picture covers anything else, for any diagram."""

import control as ct
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from clie_blocks.diagrams.clie_composite import clie_composite
from clie_blocks.diagrams.clie_loop import clie_loop
from clie_blocks.diagrams.drawing.graph import read_graph
from clie_blocks.diagrams.drawing.layout import layout
from clie_blocks.diagrams.drawing.paint import chains, joints
from clie_blocks.diagrams.feedback_linearization import feedback_linearization
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.effects import LIBRARY, with_effects
from clie_blocks.joints import decoupled_joints
from clie_blocks.signals import interconnect, signals, summing

SLACK = 0.6  # points


def rectangle(thing):
    """Left, top, right and bottom of a box or a label, a little shrunk."""
    if hasattr(thing, "block"):
        left, top = thing.x, thing.y
    else:
        left, top = thing.x - thing.width / 2, thing.y - thing.height / 2
    return left + SLACK, top + SLACK, left + thing.width - SLACK, top + thing.height - SLACK


def overlap(a, b):
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def span(piece):
    (x0, y0), (x1, y1) = piece
    return min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1)


def check(plan, graph):
    boxes = list(plan.boxes.values())
    solid = [box for box in boxes if not box.is_frame]
    for k, a in enumerate(solid):
        assert not any(overlap(rectangle(a), rectangle(b)) for b in solid[:k]), a.key
    check_frames(plan, [box for box in boxes if box.is_frame])
    check_labels(plan, solid)
    check_wires(plan, solid)
    check_connections(plan, graph)
    corners = [rectangle(thing) for thing in [*boxes, *plan.labels]]
    assert min(c[0] for c in corners) >= 0 and max(c[2] for c in corners) <= plan.width + SLACK
    assert min(c[1] for c in corners) >= 0 and max(c[3] for c in corners) <= plan.height + SLACK


def check_frames(plan, frames):
    for frame in frames:
        left, top, right, bottom = rectangle(frame)
        for box in plan.boxes.values():
            a, b, c, d = rectangle(box)
            if box.key.startswith(f"{frame.key}/"):
                assert left < a and top < b and c < right and d < bottom
            elif not frame.key.startswith(f"{box.key}/") and box is not frame:
                assert not overlap(rectangle(frame), rectangle(box)), (frame.key, box.key)
        for run in plan.runs:
            ends = {run.source[0], *(key for key, _ in run.targets)}
            if frame.key in ends or all(key.startswith(f"{frame.key}/") for key in ends):
                continue
            if any(key.startswith(f"{frame.key}/") for key in ends):
                continue
            assert not any(overlap(span(piece), rectangle(frame)) for piece in run.pieces)


def check_labels(plan, solid):
    for k, label in enumerate(plan.labels):
        room = rectangle(label)
        for other in plan.labels[:k]:
            assert not overlap(room, rectangle(other)), (label, other)
        for box in solid:
            if box.key != label.owner:
                assert not overlap(room, rectangle(box)), (label, box.key)
        for run in plan.runs:
            assert not any(overlap(span(piece), room) for piece in run.pieces), (label, run.source)


def check_wires(plan, solid):
    for run in plan.runs:
        for piece in run.pieces:
            (x0, y0), (x1, y1) = piece
            assert x0 == x1 or y0 == y1
            for box in solid:
                assert not overlap(span(piece), rectangle(box)), (run.source, box.key)
    for k, run in enumerate(plan.runs):
        for other in plan.runs[:k]:
            assert not any(along(a, b) for a in run.pieces for b in other.pieces), (
                run.source, other.source)


def along(a, b):
    """Whether two pieces of different nets lie on each other or share an end."""
    (ax0, ay0, ax1, ay1), (bx0, by0, bx1, by1) = span(a), span(b)
    if a[0] == a[1] or b[0] == b[1]:
        return False
    if ay0 == ay1 == by0 == by1:
        return ax0 <= bx1 and bx0 <= ax1
    if ax0 == ax1 == bx0 == bx1:
        return ay0 <= by1 and by0 <= ay1
    return False


def check_connections(plan, graph):
    """Each net is a tree whose ends are its source and its targets, each once."""
    wires = list(all_wires(graph))
    drawn = [(run.source, target) for run in plan.runs for target in run.targets]
    assert sorted(drawn) == sorted((wire.source, wire.target) for wire in wires)
    for run in plan.runs:
        meets = joints(run.pieces)
        pieces = {frozenset(piece) for piece in run.pieces if piece[0] != piece[1]}
        assert len(pieces) == sum(a != b for a, b in run.pieces) == len(meets) - 1
        ends = [point for point, ways in meets.items() if len(ways) == 1]
        assert len(ends) == 1 + len(run.targets)
        assert len(run.arrows) == len(run.targets)
        assert {(x, y) for x, y, *_ in run.arrows} < set(ends)
        steps = [frozenset(pair) for points in chains(run.pieces, meets)
                 for pair in zip(points, points[1:])]
        assert sorted(map(sorted, steps)) == sorted(map(sorted, pieces))


def all_wires(graph):
    yield from graph.wires
    for block in graph.blocks.values():
        if block.inner:
            yield from all_wires(block.inner)


def paper_plant():
    return decoupled_joints([1, 2], [1, 2], [0, 0])


PAPER = {
    "joint_loop": lambda: joint_loop(paper_plant(), [10, 10], [5, 5]),
    "clie_loop": lambda: clie_loop(paper_plant(), [10, 10], [5, 5], 20.0),
    "clie_measured": lambda: clie_loop(paper_plant(), [10, 10], [5, 5], 20.0,
                                       velocity="measured"),
    "clie_input_error": lambda: clie_loop(paper_plant(), [10, 10], [5, 5], 20.0,
                                          velocity="input-error"),
    "clie_composite": lambda: clie_composite(paper_plant(), [10, 10], [5, 5], 20.0, 0.1),
    "feedback_linearization": lambda: feedback_linearization(
        paper_plant(), [1, 1, 1, 1, 0, 0], [10, 10], [5, 5]),
}


@pytest.mark.parametrize("figure", PAPER)
def test_paper_figures(figure):
    diagram = PAPER[figure]()
    check(layout(diagram), read_graph(diagram))


@pytest.mark.parametrize("expand", [False, True, {"plant"}])
def test_loop_with_effects_closed_and_opened(expand):
    effects = [LIBRARY["coulomb"](level=0.3, width=1e-2), LIBRARY["viscous"](extra=0.1)]
    loop = with_effects(PAPER["joint_loop"](), effects)
    plan = layout(loop, expand)
    check(plan, read_graph(loop, expand))
    assert ("plant/coulomb" in plan.boxes) == bool(expand)


def box(name, inputs, outputs, n):
    count = len(outputs) * n
    return ct.nlsys(None, lambda t, x, u, params: np.full(count, np.tanh(u.sum())), name=name,
                    inputs=signals(*inputs, n=n), outputs=signals(*outputs, n=n))


@st.composite
def diagrams(draw, most=7, depth=0):
    """Any wiring of blocks, sums and nested diagrams: loops, fans, several sources."""
    n = draw(st.integers(1, 2)) if depth == 0 else 2
    blocks = []
    for k in range(draw(st.integers(1, most))):
        kind = draw(st.sampled_from(["box", "box", "sum", "nest"] if depth == 0 and n == 2
                                    else ["box", "sum"]))
        if kind == "sum":
            signs = draw(st.lists(st.sampled_from(["", "-"]), min_size=2, max_size=4))
            terms = [sign + name for sign, name in zip(signs, "abcd")]
            blocks.append(summing(*terms, output="y", n=n, name=f"sum_{k}"))
        elif kind == "nest":
            inner = draw(diagrams(most=3, depth=1))
            inner.name = f"nest_{k}"
            blocks.append(inner)
        else:
            inputs = [f"u_{i}" for i in range(draw(st.integers(0, 3)))]
            outputs = [f"y_{i}" for i in range(draw(st.integers(1, 3)))]
            blocks.append(box(f"block_{k}", inputs, outputs, n))
    return wired(draw, blocks, f"diagram_{depth}")


def wired(draw, blocks, name):
    """Connect each input port to one or two sources or to a diagram input."""
    from clie_blocks.signals import ports

    outputs = [f"{b.name}.{port}" for b in blocks for port in ports(b.output_labels)]
    connections, inputs = [], {}
    for block in blocks:
        for port in ports(block.input_labels):
            target = f"{block.name}.{port}"
            sources = draw(st.lists(st.sampled_from(outputs), max_size=2, unique=True))
            if sources:
                signs = draw(st.lists(st.sampled_from(["", "-"]), min_size=2, max_size=2))
                connections.append((target, *(s + o for s, o in zip(signs, sources))))
            else:
                inputs.setdefault(f"r_{draw(st.integers(0, 2))}", []).append(target)
    shown = draw(st.lists(st.sampled_from(outputs), min_size=1, max_size=3, unique=True))
    return interconnect(blocks, connections, inputs=inputs, unused=outputs, name=name,
                        outputs={f"out_{k}": port for k, port in enumerate(shown)})


@settings(max_examples=25, deadline=None, derandomize=True,
          suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(diagrams(), st.booleans())
def test_random_diagrams(diagram, expand):
    check(layout(diagram, expand), read_graph(diagram, expand))


def test_forty_blocks_are_still_drawn_well():
    blocks = [box(f"block_{k}", ["u_0", "u_1"], ["y_0"], 2) for k in range(40)]
    wires = [(f"block_{k}.u_0", f"block_{k - 1}.y_0") for k in range(1, 40)]
    wires += [(f"block_{k}.u_1", f"block_{min(k + 3, 39)}.y_0") for k in range(40)]
    diagram = interconnect(blocks, wires, inputs={"r": "block_0.u_0"},
                           outputs={"y": "block_39.y_0"}, name="long")
    check(layout(diagram), read_graph(diagram))
