"""The actuator from the side at full pressure, with the support it is clamped to, the rigid arm and the spring."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Arc, Polygon, Rectangle
from numpy.typing import NDArray

from actuator.arrays import Floats
from actuator.geometry.zero_set import Surface
from pipeline.figures.offscreen import BODY
from pipeline.figures.shading import Direction, draw_solid
from pipeline.figures.sheet import Place, padded, sheet
from pipeline.results.design import OptimisedDesign
from pipeline.results.simulation import rig_units

#: Direction to the eye: X1 to the right, X3 upwards.
SIDE: Direction = (0.0, -1.0, 0.0)
ARM, GROUND, SPRING, GHOST, SIZE = "#5b6470", "#3a3f45", "#c55a11", "#70777f", "#1f4e79"
#: Coils of the spring as it is drawn.
COILS = 9


def arm(design: OptimisedDesign) -> Figure:
    """Side view: the deformed actuator, arm and spring, and where they were without pressure, dashed."""
    domain, (_, load, _) = design.domain, design.case.optimize.parameters()
    size, length, reach = domain.size, domain.length, load.arm_length
    shape = design.shape
    _, moved = design.fields_at(shape.vertices)
    bent = Surface(shape.vertices + moved, shape.triangles)
    ends = _placed(design.arm, length, np.array([[reach, 0.0]]))[0], np.array([length + reach, 0.0])
    spring = load.spring_stiffness > 0.0
    top = max(0.85 * size, ends[0][1] + 0.6 * size)
    below, right = -1.18 * size, max(ends[0][0], ends[1][0])
    corners = [
        bent.vertices[:, [0, 2]],
        shape.vertices[:, [0, 2]],
        *(_placed(each, length, _outline(size, reach)) for each in (design.arm, np.zeros(3))),
        # The support, and the size below it.
        np.array([(-0.3 * size, 1.15 * size), (0.0, below - 0.25 * size)]),
    ]
    if spring:  # and what is written beside it
        corners.append(np.array([(right + 1.3 * size, top + 0.16 * size)]))
    every = np.concatenate(corners)
    extent = np.array([*every.min(axis=0), *every.max(axis=0)])[[0, 2, 1, 3]]
    found = sheet([Place(padded(extent), "", ("x1 [mm]", "x3 [mm]"))], design.name)
    (axes,) = found.panels
    draw_solid(axes, bent, SIDE, BODY, zorder=2)
    _silhouette(axes, shape.vertices[:, [0, 2]], shape.triangles)
    _support(axes, size)
    _arm(axes, np.zeros(3), size, length, reach, ghost=True)
    _arm(axes, design.arm, size, length, reach, ghost=False)
    end = ends[0]
    if spring:
        _spring(axes, end, top, size)
        _measure(axes, (right + 0.3 * size, 0.0), (right + 0.3 * size, end[1]))
        words = rig_units(design.case).both_lengths(-end[1], 2).replace(", ", "\n")
        axes.text(right + 0.38 * size, 0.5 * end[1], f"elongation\n{words}", color=SIZE, va="center")
    _measure(axes, (0.0, below), (length, below))
    axes.text(0.5 * length, below - 0.05 * size, f"L = {length:g} mm", color=SIZE, ha="center", va="top")
    over = 0.34 * size
    _measure(axes, (length, over), (length + reach, over))
    words = f"L_arm = {reach:g} mm"
    axes.text(length + 0.5 * reach, over + 0.05 * size, words, color=SIZE, ha="center", va="bottom")
    _angle(axes, design.arm, length, reach)
    rest = Line2D([], [], color=GHOST, linestyle="--", linewidth=0.9, label="without pressure")
    axes.legend(handles=[rest], frameon=False, loc="lower center")
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    return found.figure


def _outline(size: float, reach: float) -> Floats:
    """Corners of the arm as it is drawn, from its root, (n, 2)."""
    thick, half = 0.08 * size, 0.05 * size
    outline = [(0.0, size), (thick, size), (thick, half), (reach, half), (reach, -half), (thick, -half)]
    return np.array([*outline, (thick, -size), (0.0, -size)])


def _placed(arm: Floats, length: float, local: Floats) -> Floats:
    """Points of the arm, (n, 2) as (x1, x3), moved rigidly; ``local`` is measured from its root (Section 2.2)."""
    t1, t3, theta = arm
    turn = np.array([[math.cos(theta), math.sin(theta)], [-math.sin(theta), math.cos(theta)]])
    return np.asarray(local @ turn.T + np.array([length + t1, t3]))


def _arm(axes: Axes, arm: Floats, size: float, length: float, reach: float, *, ghost: bool) -> None:
    corners = _placed(arm, length, _outline(size, reach))
    if ghost:
        axes.add_patch(
            Polygon(corners, closed=True, fill=False, edgecolor=GHOST, linestyle="--", linewidth=0.9, zorder=4)
        )
    else:
        axes.add_patch(Polygon(corners, closed=True, facecolor=ARM, edgecolor=GROUND, linewidth=0.8, zorder=3))
        x, z = _placed(arm, length, np.array([[reach, 0.0]]))[0]
        axes.plot(x, z, "o", color="white", markeredgecolor=GROUND, markersize=5, zorder=5)


def _silhouette(axes: Axes, plane: Floats, triangles: NDArray[np.int64]) -> None:
    """Outline of what the undeformed surface covers: the edge of its shadow on a grid of 400 points."""
    low, high = plane.min(axis=0), plane.max(axis=0)
    room = 0.03 * (high - low).max()
    low, high = low - room, high + room
    pitch = float((high - low).max()) / 400.0
    x, z = (np.arange(a, b, pitch) for a, b in zip(low, high, strict=True))
    shadow = _shadow(plane, triangles, x, z)
    axes.contour(x, z, shadow, levels=[0.5], colors=GHOST, linestyles="--", linewidths=0.9, zorder=4)


def _shadow(plane: Floats, triangles: NDArray[np.int64], x: Floats, z: Floats) -> Floats:
    """1 where the grid lies in a triangle, else 0, (len(z), len(x))."""
    from PIL import Image, ImageDraw

    image = Image.new("L", (len(x), len(z)))
    brush = ImageDraw.Draw(image)
    pixels = (plane - (x[0], z[0])) / (x[1] - x[0])
    for triangle in pixels[triangles]:
        brush.polygon([tuple(corner) for corner in triangle], fill=1)
    return np.asarray(image, dtype=np.float64)


def _support(axes: Axes, size: float) -> None:
    deep, high = 0.22 * size, 1.15 * size
    _hatched(axes, (-deep, -high), deep, 2.0 * high)
    axes.plot([0.0, 0.0], [-high, high], color=GROUND, linewidth=1.6, zorder=4)


def _hatched(axes: Axes, corner: tuple[float, float], width: float, height: float) -> None:
    """What does not move."""
    ground = Rectangle(corner, width, height, facecolor="#d9dde2", edgecolor=GROUND, linewidth=0.0, hatch="////")
    axes.add_patch(ground)


def _spring(axes: Axes, end: Floats, top: float, size: float) -> None:
    """A spring straight above a point, since the one of the model resists the motion along X3 only."""
    wide, straight = 0.11 * size, 0.12 * (top - end[1])
    along = np.linspace(end[1] + straight, top - straight, 2 * COILS + 1)
    across = np.where(np.arange(2 * COILS + 1) % 2 == 0, -wide, wide)
    across[[0, -1]] = 0.0
    z, x = np.concatenate([[end[1]], along, [top]]), end[0] + np.concatenate([[0.0], across, [0.0]])
    axes.plot(x, z, color=SPRING, linewidth=1.3, zorder=4)
    _hatched(axes, (end[0] - 0.4 * size, top), 0.8 * size, 0.14 * size)
    axes.plot([end[0] - 0.4 * size, end[0] + 0.4 * size], [top, top], color=GROUND, linewidth=1.6)
    axes.text(end[0] + 0.18 * size, 0.55 * top, "k_sp", color=SPRING, ha="left", va="center")


def _measure(axes: Axes, one: tuple[float, float], other: tuple[float, float]) -> None:
    arrow = {"arrowstyle": "<->", "color": SIZE, "linewidth": 0.9, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", xy=other, xytext=one, arrowprops=arrow)


def _angle(axes: Axes, arm: Floats, length: float, reach: float) -> None:
    """The arc from the arm's axis at rest to its axis under pressure, about where the two cross, with the angle."""
    theta = float(arm[2])
    if abs(theta) < 1e-3:
        return
    root = _placed(arm, length, np.array([[0.0, 0.0]]))[0]
    crossing = root[0] + root[1] / math.tan(theta)
    far = 0.62 * reach
    turn = -math.degrees(theta)
    arc = Arc(
        (crossing, 0.0), 2 * far, 2 * far, theta1=min(turn, 0.0), theta2=max(turn, 0.0), color=SIZE, linewidth=1.0
    )
    axes.add_patch(arc)
    at = crossing + (far + 0.02 * reach) * math.cos(0.5 * theta), -(far + 0.02 * reach) * math.sin(0.5 * theta)
    axes.text(*at, f"θ2 = {math.degrees(theta):.2f}°", color=SIZE, va="center")
