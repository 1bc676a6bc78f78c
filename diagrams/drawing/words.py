"""What a picture shows, in words, for those who do not see it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from clie_blocks.diagrams.drawing.graph import Block, Pin
from clie_blocks.diagrams.drawing.plan import Box, Layout


def words_of(plan: Layout, values: Mapping[str, float] | None = None,
             value_label: str = "") -> str:
    """Blocks of a picture with what enters each, one sentence a block.

    `values` colour the blocks; `value_label` says what they are.
    """
    source = {target: run.source for run in plan.runs for target in run.targets}
    boxes = sorted(plan.boxes.values(), key=lambda box: (box.column, box.y))
    ends = [_ends(boxes, kind) for kind in ("input", "output")]
    said = [_takes(box.block, plan, source) for box in boxes
            if box.block.kind != "input" and box.block.inputs and not box.is_frame]
    shades = [f"{_name(plan.boxes[key].block)} {value:.3g}"
              for key, value in (values or {}).items()]
    return " ".join([*(sentence for sentence in ends if sentence), *said] + (
        [f"Colours show {value_label or 'values'}: {_listed(shades)}."] if shades else []))


def _listed(items: Sequence[str]) -> str:
    return ", ".join(items[:-1]) + f" and {items[-1]}" if len(items) > 1 else "".join(items)


def _ends(boxes: Sequence[Box], kind: str) -> str:
    names = [box.block.name for box in boxes if box.block.kind == kind and box.depth == 0]
    return f"{kind.capitalize()}{'s' * (len(names) > 1)}: {_listed(names)}." if names else ""


def _takes(block: Block, plan: Layout, source: Mapping[Pin, Pin]) -> str:
    """One sentence: a block and what drives its ports."""
    signs = block.signs if block.kind == "sum" else ()
    terms = [("minus " if k < len(signs) and signs[k] != "+" else "")
             + _signal(plan, source[block.key, port])
             for k, port in enumerate(block.inputs) if (block.key, port) in source]
    verb = {"output": "shows", "sum": "adds"}.get(block.kind, "takes")
    role = "Output " if block.kind == "output" else ""
    said = f"{role}{_name(block)} {verb} {_listed(terms) if terms else 'nothing'}."
    return said if block.name else said[0].upper() + said[1:]


def _signal(plan: Layout, pin: Pin) -> str:
    block = plan.boxes[pin[0]].block
    if block.kind == "input":
        return block.name
    return f"{pin[1]} of {_name(block)}" if block.name else _name(block)


def _name(block: Block) -> str:
    """Name of a block as a text has it; sums and gains on wires have none."""
    return block.name.replace("\n", " ") or {"sum": "a sum", "gain": "a gain"}.get(
        block.kind, "a block")
