"""Texts of a block, each with its position and the room it takes."""

from collections.abc import Callable, Iterator

from clie_blocks.diagrams.drawing import shapes
from clie_blocks.diagrams.drawing.plan import Box, Label, Point
from clie_blocks.diagrams.drawing.shapes import GRID, Node
from clie_blocks.diagrams.drawing.texts import measure, plain, symbol


def labels_of(node: Node, box: Box) -> list[Label]:
    """Texts of one block: its name, its ports in the order of the node, and its formula."""
    block = box.block
    x, y = box.middle

    def label(text: str, at: Point, size: float, bold: bool = False) -> Label:
        width, height = measure(text, size, bold)
        return Label(text, at[0], at[1], width, height, size, bold, block.key)

    if block.kind in ("input", "output"):
        return [label(symbol(block.name), (x, y), shapes.PORT)]
    if box.is_frame:
        text = plain(block.name)
        at = box.x + 8 + measure(text, shapes.NAME, True)[0] / 2, box.y + 1.5 * GRID
        return [label(text, at, shapes.NAME, True)]
    found = []
    if shapes.out_label(block):
        text = shapes.out_label(block)
        width, height = measure(text, shapes.PORT)
        found.append(label(text, (box.x + box.width + 4 + width / 2, y - 3 - height / 2),
                           shapes.PORT))
    if shapes.below_name(block):
        found.append(label(shapes.below_name(block), (x, box.y + box.height + 4 + shapes.NAME / 2),
                           shapes.NAME))
    if node.main is not None:
        found += [label(sign, at, shapes.SIGN) for sign, at in _signs(node, box)]
    elif block.kind != "gain":
        found += _inside_labels(node, box, label)
    if block.kind == "gain" and block.icon is not None:
        found.append(label(block.icon.content, (box.x + 0.4 * box.width, y), shapes.PORT))
    return found


def _signs(node: Node, box: Box) -> Iterator[tuple[str, Point]]:
    """Signs of a sum, inside the circle next to where each wire enters."""
    x, y = box.middle
    reach = 0.58 * shapes.SUM_RADIUS
    for port in node.left:
        sign = box.block.signs[box.block.inputs.index(port)]
        arm = node.offset("L", port)
        yield sign, (x - reach, y) if arm == 0 else (x, y + (reach if arm > 0 else -reach))


def _inside_labels(node: Node, box: Box, label: Callable[..., Label]) -> list[Label]:
    block, found = box.block, []
    x, y = box.middle
    if block.icon is None:
        found.append(label(shapes.inside_name(block), (x, y), shapes.NAME, True))
    elif block.icon.kind != "curve":
        found.append(label(block.icon.content or "$\\Sigma$", (x, y), shapes.FORMULA))
    for side, ports, names in (("L", node.left, block.inputs), ("R", node.right, block.outputs)):
        for port in ports:
            text = shapes.port_text(block, side, names.index(port))
            if text:
                half = measure(text, shapes.PORT)[0] / 2 + shapes.inset(block)
                at = box.x + half if side == "L" else box.x + box.width - half
                found.append(label(text, (at, y + node.offset(side, port) * GRID), shapes.PORT))
    return found
