"""Sizes of things before they have a position: bodies, ports and the room for their texts.

Lengths are points.  Heights and port offsets count in `GRID` from the middle of a thing, so that
two ports can be made level exactly.
"""

from dataclasses import dataclass, field
from math import ceil

from clie_blocks.diagrams.drawing.graph import Block
from clie_blocks.diagrams.drawing.plan import Layout
from clie_blocks.diagrams.drawing.texts import measure, plain, symbol, wrapped

GRID = 6.0
PITCH = 4  # between two ports
SUM_ARM = 5  # from the middle of a sum to a wire that enters it from above or below
SUM_RADIUS = 13.0
NAME, PORT, FORMULA, SIGN, SMALL = 9.0, 10.0, 13.0, 8.0, 6.5


@dataclass
class Node:
    """A block with its size, or a bend of a long wire (no block).

    `above` and `below` are the grid steps from its middle to its ends, names included; `left` and
    `right` are its ports from top to bottom.
    """

    key: str
    block: Block | None = None
    left: list[str] = field(default_factory=list)
    right: list[str] = field(default_factory=list)
    width: float = 0.0
    body: tuple[float, float] = (0.0, 0.0)  # width and height of the outline
    above: int = 0
    below: int = 0
    main: str | None = None  # the port of a sum that enters straight
    # of an opened diagram: offsets of its ports by side and name, and its layout
    fixed: dict[tuple[str, str], int] = field(default_factory=dict)
    picture: Layout | None = None

    def offset(self, side: str, port: str) -> int:
        """Grid steps from the middle of the node down to a port."""
        if self.fixed:
            return self.fixed[side, port]
        ports = self.left if side == "L" else self.right
        k = ports.index(port)
        if self.main is not None:
            return SUM_ARM * (k - self.left.index(self.main)) if side == "L" else 0
        return PITCH * k - PITCH * (len(ports) - 1) // 2

    def fit_sum(self) -> None:
        """Room of a sum, which depends on which of its ports enters straight."""
        if len(self.left) == 3:
            self.main = self.left[1]
        offsets = [self.offset("L", port) for port in self.left]
        radius = ceil(SUM_RADIUS / GRID)
        self.above, self.below = max(radius, -min(offsets)), max(radius, max(offsets))

    @property
    def is_bend(self) -> bool:
        """Whether it is only a passing wire."""
        return self.block is None

    @property
    def is_terminal(self) -> bool:
        """Whether it is an input or output of the diagram."""
        return self.block is not None and self.block.kind in ("input", "output")

    @property
    def is_plain(self) -> bool:
        """Whether it is a block, a gain or a diagram: no sum, terminal or bend."""
        return self.block is not None and self.block.kind not in ("sum", "input", "output")

    @property
    def sortable(self) -> bool:
        """Whether its ports may be reordered."""
        return not self.is_bend and not self.is_terminal and not self.fixed


def node_of(block: Block, picture: Layout | None = None) -> Node:
    """Node of a block, sized to fit its texts; `picture` is the inside of an opened diagram."""
    node = Node(block.key, block, list(block.inputs), list(block.outputs))
    if picture is not None:
        _frame(node, block, picture)
    elif block.kind in ("input", "output"):
        _terminal(node, block)
    elif block.kind == "sum" and len(block.inputs) <= 3:
        _sum(node, block)
    elif block.kind == "gain":
        _gain(node, block)
    else:
        _box(node, block)
    return node


def out_label(block: Block) -> str:
    """Text over the outgoing wire of a block that does not name its port inside."""
    named = block.kind in ("sum", "gain") and block.name
    return symbol(block.outputs[0]) if named and block.outputs else ""


def port_text(block: Block, side: str, k: int) -> str:
    """Text next to port k inside a box; a tall sum shows signs."""
    if block.kind == "sum":
        return block.signs[k] if side == "L" else ""
    return symbol((block.inputs if side == "L" else block.outputs)[k])


def inside_name(block: Block) -> str:
    """Name inside a box that has no icon."""
    return wrapped(block.name) if block.icon is None else ""


def inset(block: Block) -> float:
    """Distance of the port names from the outline; a diagram has a second outline."""
    return 8.0 if block.kind == "diagram" else 5.0


def below_name(block: Block) -> str:
    """Name below a block whose inside shows an icon."""
    shown = block.icon is not None and block.kind != "sum"
    return plain(block.name) if shown else ""


def _terminal(node: Node, block: Block) -> None:
    width = max(30.0, measure(symbol(block.name), PORT)[0] + 16.0)
    node.width, node.body = width, (width, 16.0)
    node.above = node.below = 1  # so close that terminals can be level with ports


def _sum(node: Node, block: Block) -> None:
    node.body = (2 * SUM_RADIUS, 2 * SUM_RADIUS)
    label = measure(out_label(block), PORT)[0]
    # the label needs room right of the circle; the same is kept on the left to stay centred
    node.width = 2 * SUM_RADIUS + 2 * (label + 4 if label else 0)
    node.main = node.left[0]
    node.fit_sum()


def _gain(node: Node, block: Block) -> None:
    text = measure(block.icon.content if block.icon else "", PORT)[0]
    side = max(36.0, text + 24.0)
    label = measure(out_label(block), PORT)[0]
    node.body = (side, 36.0)
    node.width = max(side + 2 * (label + 4 if label else 0),
                     measure(below_name(block), NAME)[0])
    node.above, node.below = 3, 3 + _name_room(block)


def _box(node: Node, block: Block) -> None:
    sides = [max([measure(port_text(block, side, k), PORT)[0] for k in range(len(ports))] or [0])
             for side, ports in (("L", block.inputs), ("R", block.outputs))]
    wide, high = _inside(block)
    rows = max(len(block.inputs), len(block.outputs), 1)
    half = max(PITCH * rows // 2 + 1, ceil((high / 2 + 6) / GRID))
    if block.kind == "diagram":
        half += 1
    width = max(60.0, wide + 2 * max(sides) + 18.0 + 2 * inset(block))
    node.body = (width, 2 * half * GRID)
    label = measure(out_label(block), PORT)[0]
    node.width = max(width + 2 * (label + 4 if label else 0), measure(below_name(block), NAME)[0])
    node.above, node.below = half, half + _name_room(block)


def _inside(block: Block) -> tuple[float, float]:
    """Width and height of what stands in the middle of a box."""
    if block.icon is None:
        return measure(inside_name(block), NAME, True)
    if block.icon.kind == "curve":
        return 44.0, 34.0
    wide, high = measure(block.icon.content or "$\\Sigma$", FORMULA)
    return wide, high


def _name_room(block: Block) -> int:
    return ceil((NAME * 1.2 + 4) / GRID) if below_name(block) else 0


def _frame(node: Node, block: Block, picture: Layout) -> None:
    """Frame round an opened diagram; its ports are level with the terminals inside."""
    margin, title = 2 * GRID, 3 * GRID
    height = picture.height + margin + title
    half = ceil(height / 2 / GRID)
    node.body = (max(picture.width, measure(plain(block.name), NAME, True)[0] + 12)
                 + 2 * margin, 2 * half * GRID)
    node.width = node.body[0]
    node.above = node.below = half
    node.picture = picture
    for key, side, port in ([(b.key, "L", b.name) for b in _kind(picture, "input")]
                            + [(b.key, "R", b.name) for b in _kind(picture, "output")]):
        middle = picture.boxes[key].middle[1]
        node.fixed[side, port] = round((middle + title) / GRID) - half
    node.left.sort(key=lambda port: node.fixed["L", port])
    node.right.sort(key=lambda port: node.fixed["R", port])


def _kind(picture: Layout, kind: str) -> list[Block]:
    return [box.block for box in picture.boxes.values()
            if box.block.kind == kind and box.depth == 0]
