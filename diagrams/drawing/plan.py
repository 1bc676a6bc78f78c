"""The finished plan of a picture: boxes, wires and texts with their positions, in points.

Everything that `paint` draws is here, so that tests can read geometry instead of pixels.
"""

from dataclasses import dataclass, field

from clie_blocks.diagrams.drawing.graph import Block, Pin

Point = tuple[float, float]
Piece = tuple[Point, Point]
Arrow = tuple[float, float, float, float]  # x, y, dx, dy: tip and direction


@dataclass(frozen=True)
class Box:
    """Outline of a block: left, top, width and height, y downwards."""

    block: Block
    x: float
    y: float
    width: float
    height: float
    depth: int = 0
    column: int = 0
    left: tuple[str, ...] = ()  # its ports from top to bottom
    right: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """Key of the block."""
        return self.block.key

    @property
    def middle(self) -> Point:
        """Point in its middle."""
        return self.x + self.width / 2, self.y + self.height / 2

    @property
    def is_frame(self) -> bool:
        """Whether it is an opened diagram."""
        return self.block.inner is not None


@dataclass(frozen=True)
class Label:
    """A text with its middle and the room it takes."""

    text: str
    x: float
    y: float
    width: float
    height: float
    size: float
    bold: bool = False
    owner: str = ""


@dataclass(frozen=True)
class Run:
    """All wires from one output port: straight pieces that meet at their ends."""

    source: Pin
    targets: tuple[Pin, ...]
    width: int
    pieces: tuple[Piece, ...]
    arrows: tuple[Arrow, ...]


@dataclass
class Layout:
    """A plan: everything by key or in painting order, inside ``[0, width] x [0, height]``."""

    width: float = 0.0
    height: float = 0.0
    boxes: dict[str, Box] = field(default_factory=dict)
    labels: list[Label] = field(default_factory=list)
    runs: list[Run] = field(default_factory=list)
