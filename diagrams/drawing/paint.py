"""A finished plan as a Matplotlib figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot
from typing import TYPE_CHECKING, Any

import numpy as np

from clie_blocks.diagrams.drawing import shapes
from clie_blocks.diagrams.drawing.plan import Box, Layout, Piece, Point, Run
from clie_blocks.diagrams.drawing.texts import font
from clie_blocks.output import plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure
    from matplotlib.path import Path as MplPath

INK, FILL, FRAME, TERMINAL, QUIET = "#1f2933", "#eef3f9", "#f8fafc", "#ffffff", "#5b6b7c"
THIN, THICK, CORNER, DOT = 0.9, 1.9, 4.0, 2.8
MARGIN, BAR = 12.0, 84.0
LIGHT_TO_STRONG = ["#fff8ee", "#fbc490", "#e8604c"]  # light enough for the texts of a block


@dataclass(frozen=True)
class Shades:
    """Values by block key on one colour scale from `low` to `high`."""

    values: dict[str, float]
    low: float
    high: float

    def mappable(self) -> ScalarMappable:
        """Matplotlib's pair of scale and colours, for a colour bar."""
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import LinearSegmentedColormap, Normalize

        scale = LinearSegmentedColormap.from_list("share", LIGHT_TO_STRONG)
        return ScalarMappable(Normalize(self.low, self.high), scale)

    def colour(self, key: str) -> Any:
        """Colour of a block as Matplotlib takes it, or None if it has no value."""
        if key not in self.values:
            return None
        return self.mappable().to_rgba(np.asarray(self.values[key]))


def paint(plan: Layout, shades: Shades | None = None, value_label: str = "",
          title: str = "") -> Figure:
    """Paint a plan: one point of the plan is one point of the figure.

    `shades` colours the blocks that have a value; `value_label` stands at the colour bar.
    """
    from matplotlib.figure import Figure

    head = 24.0 if title else 0.0
    width = plan.width + 2 * MARGIN + (BAR if shades else 0.0)
    height = plan.height + 2 * MARGIN + head
    figure = Figure(figsize=(width / 72, height / 72), dpi=150, facecolor="white")
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(-MARGIN, width - MARGIN), ylim=(plan.height + MARGIN, -MARGIN - head))
    axes.axis("off")
    if title:
        axes.text(0, -head / 2 - 2, plain(title), fontproperties=font(11, True), color=INK,
                  va="center")
    for box in plan.boxes.values():
        _box(axes, box, shades)
    for run in plan.runs:
        _run(axes, run)
    for label in plan.labels:
        axes.text(label.x, label.y, label.text, fontproperties=font(label.size, label.bold),
                  color=QUIET if label.size == shapes.SMALL else INK, ha="center", va="center",
                  zorder=6, linespacing=1.1)
    if shades:
        _colour_bar(figure, shades, value_label, plan, width, height)
    return figure


def _box(axes: Axes, box: Box, shades: Shades | None) -> None:
    from matplotlib.patches import Circle, FancyBboxPatch, Polygon, Rectangle

    x, y, w, h = box.x, box.y, box.width, box.height
    colour = shades.colour(box.key) if shades else None
    style: dict[str, Any] = {"ec": INK, "lw": 1.0, "zorder": 3 + box.depth / 100}
    if box.is_frame:
        axes.add_patch(Rectangle((x, y), w, h, fc=colour or FRAME, ec=QUIET, lw=1.0,
                                 ls=(0, (5, 3)), zorder=1 + box.depth / 100))
    elif box.block.kind in ("input", "output"):
        shape = f"round,pad=0,rounding_size={h / 2}"
        axes.add_patch(FancyBboxPatch((x, y), w, h, boxstyle=shape, fc=TERMINAL, **style))
    elif box.block.kind == "sum" and len(box.block.inputs) <= 3:
        axes.add_patch(Circle(box.middle, w / 2, fc=colour or TERMINAL, **style))
    elif box.block.kind == "gain":
        corners = [(x, y), (x, y + h), (x + w, y + h / 2)]
        axes.add_patch(Polygon(corners, fc=colour or FILL, joinstyle="miter", **style))
    else:
        axes.add_patch(Rectangle((x, y), w, h, fc=colour or FILL, joinstyle="miter", **style))
        if box.block.kind == "diagram":
            axes.add_patch(Rectangle((x + 3, y + 3), w - 6, h - 6, fc="none", ec=INK, lw=0.5,
                                     zorder=3.5))
        if box.block.icon is not None and box.block.icon.kind == "curve":
            _curve(axes, box, *box.block.icon.content)


def _curve(axes: Axes, box: Box, x: np.ndarray, y: np.ndarray) -> None:
    """Characteristic over a pair of thin axes."""
    wide, high = 36.0, 26.0
    middle_x, middle_y = box.middle
    reach_x, reach_y = max(abs(x)) or 1.0, max(abs(y)) or 1.0
    axes.plot([middle_x - wide / 2, middle_x + wide / 2], [middle_y] * 2, color=QUIET, lw=0.5,
              zorder=4)
    axes.plot([middle_x] * 2, [middle_y - high / 2, middle_y + high / 2], color=QUIET, lw=0.5,
              zorder=4)
    axes.plot(middle_x + x / reach_x * wide / 2, middle_y - y / reach_y * high / 2, color=INK,
              lw=1.4, zorder=4.5, solid_joinstyle="round")


def _run(axes: Axes, run: Run) -> None:
    from matplotlib.patches import Circle, PathPatch, Polygon

    thickness = THICK if run.width > 1 else THIN
    meets = joints(run.pieces)
    for points in chains(run.pieces, meets):
        axes.add_patch(PathPatch(_rounded(points), fc="none", ec=INK, lw=thickness, zorder=2,
                                 capstyle="butt", joinstyle="round"))
    for point, neighbours in meets.items():
        if len(neighbours) > 2:
            axes.add_patch(Circle(point, DOT, fc=INK, ec="none", zorder=2.5))
    for x, y, dx, dy in run.arrows:
        back, side = 7.5, 3.2 + thickness / 4
        axes.add_patch(Polygon(
            [(x, y), (x - back * dx - side * dy, y - back * dy - side * dx),
             (x - back * dx + side * dy, y - back * dy + side * dx)],
            fc=INK, ec="none", zorder=5))


def joints(pieces: Sequence[Piece]) -> dict[Point, list[Point]]:
    """Points where pieces end, each with its neighbours: ``{point: [point, ...]}``."""
    found: dict[Point, list[Point]] = {}
    for a, b in pieces:
        if a != b:
            found.setdefault(a, []).append(b)
            found.setdefault(b, []).append(a)
    return found


def chains(pieces: Sequence[Piece], meets: Mapping[Point, Sequence[Point]]) -> list[list[Point]]:
    """Pieces joined into polylines between ends and junctions, each piece once."""
    done: set[Piece] = set()
    found: list[list[Point]] = []
    ends = [point for point, neighbours in meets.items() if len(neighbours) != 2]
    for start in ends:
        for follower in meets[start]:
            if (start, follower) in done:
                continue
            points = [start, follower]
            while len(meets[points[-1]]) == 2:
                first, second = meets[points[-1]]
                points.append(second if first == points[-2] else first)
            done |= set(zip(points, points[1:])) | set(zip(points[1:], points))
            found.append(points)
    return found


def _rounded(points: list[Point]) -> MplPath:
    """Polyline with its corners rounded."""
    from matplotlib.path import Path

    points = _without_straight(points)
    vertices, codes = [points[0]], [Path.MOVETO]
    for a, b, c in zip(points, points[1:], points[2:]):
        for near, order in ((a, 0), (c, 1)):
            length = hypot(near[0] - b[0], near[1] - b[1])
            share = min(CORNER, length / 2) / length
            point = (b[0] + (near[0] - b[0]) * share, b[1] + (near[1] - b[1]) * share)
            vertices += [point] if order == 0 else [b, point]
            codes += [Path.LINETO] if order == 0 else [Path.CURVE3, Path.CURVE3]
    return Path([*vertices, points[-1]], [*codes, Path.LINETO])


def _without_straight(points: list[Point]) -> list[Point]:
    kept = [points[0]]
    for a, b, c in zip(points, points[1:], points[2:]):
        if not (a[0] == b[0] == c[0] or a[1] == b[1] == c[1]):
            kept.append(b)
    return [*kept, points[-1]]


def _colour_bar(figure: Figure, shades: Shades, label: str, plan: Layout, width: float,
                height: float) -> None:
    tall = min(plan.height, 180.0)
    bar = figure.add_axes((1 - (BAR - 18) / width, 0.5 - tall / 2 / height, 12 / width,
                           tall / height))
    painted = figure.colorbar(shades.mappable(), cax=bar)
    painted.set_label(plain(label), fontproperties=font(8.5))
    for tick in bar.get_yticklabels():
        tick.set_fontproperties(font(7.5))
    painted.outline.set_linewidth(0.6)
