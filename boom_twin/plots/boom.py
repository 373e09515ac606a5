"""Side view of a boom with the symbols of an engineering sketch, and the picture of every joint over its range."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..scene.kinematics import Skeleton, skeleton, stroke_curve
from ..scene.schema import Scene
from ..types import Array
from .style import BLUE, GREEN, GREY, INK, ORANGE, PALE, PURPLE, draw_pin, picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes


STEEL, RIGID, BARREL, ROD = "#C9D6E2", "#8FA3B5", "#E6B98A", "#B9742F"


def draw_link(axes: Axes, points: list[Array], colour: str = BLUE, width: float = 5.0) -> None:
    """Draw a link through two pins, or a plate through three."""
    x, y = np.array(points).T
    if len(points) > 2:
        axes.fill(x, y, facecolor=colour, alpha=0.35, linewidth=0, zorder=5)
        axes.fill(x, y, fill=False, edgecolor=colour, linewidth=0.7 * width, joinstyle="round", zorder=5)
    else:
        axes.plot(x, y, color=colour, linewidth=width, solid_capstyle="round", zorder=5)


def draw_cylinder(axes: Axes, barrel_pin: Array, rod_pin: Array, closed_length: float, width: float) -> None:
    """Draw barrel (0.9 `closed_length` long, `width` in m) and rod between two pins."""
    along = (rod_pin - barrel_pin) / np.hypot(*(rod_pin - barrel_pin))
    end = barrel_pin + 0.9 * closed_length * along
    _box(axes, barrel_pin, end, width, BARREL, 6.0)
    _box(axes, end, rod_pin, 0.5 * width, ROD, 5.5)


def draw_section(axes: Axes, corners: list[tuple[Array, Array, bool]], depth: float, alpha: float = 1.0) -> None:
    """Draw the parts of a section (m), `depth` (m) high. Flexible parts are light, rigid ones dark."""
    for start, stop, flexible in corners:
        if np.hypot(*(stop - start)) > 1e-9:
            _box(axes, start, stop, depth, STEEL if flexible else RIGID, 2.0, alpha)


def _box(axes: Axes, start: Array, stop: Array, width: float, colour: str, order: float, alpha: float = 1.0) -> None:
    along = (stop - start) / np.hypot(*(stop - start))
    across = 0.5 * width * np.array([-along[1], along[0]])
    x, y = np.array([start + across, stop + across, stop - across, start - across]).T
    axes.fill(x, y, facecolor=colour, edgecolor=GREY, linewidth=0.9, zorder=order, alpha=alpha)


def section_parts(scene: Scene, bones: Skeleton, i: int) -> list[tuple[Array, Array, bool]]:
    """Return root, beam and head of section `i` (0-based): start, end, True if flexible."""
    section = scene.sections[i]
    if section.beam is None:
        return [(bones.pivots[i], bones.pivots[i + 1], False)]
    x0, x1 = section.beam
    stops = [bones.point(i, x) for x in (0.0, x0, x1, section.length)]
    return [(stops[k], stops[k + 1], k == 1 and scene.is_flexible(i)) for k in range(3)]


POSITIONS = 5  # of a joint, ends of its range included
COLUMNS = 3
NOTE = "blue: lowest angle, orange: highest; section before along x"


def joint_ranges_picture(path: Path, scene: Scene, name: str) -> Path:
    """Draw a pair of panels for each joint: pins, links and cylinder over its range, and the stroke; return `path`."""
    count = len(scene.joints)
    rows = -(-count // COLUMNS)
    columns = -(-count // rows)
    size = min(12.0 * columns, 18.0), 8.0 * rows
    with picture(path, f"{name}: all pins over the range of each joint", NOTE, size) as figure:
        grid = figure.add_gridspec(2 * rows, columns, height_ratios=[3.0, 1.0] * rows)
        for i in range(count):
            row, column = divmod(i, columns)
            _joint(figure.add_subplot(grid[2 * row, column]), scene, i)
            _stroke(figure.add_subplot(grid[2 * row + 1, column]), scene, i)
    return path


def _joint(axes: Axes, scene: Scene, i: int) -> None:
    """Draw sections before and after, links and cylinder: the ends of the range in full, positions between as a shadow."""
    axes.set_aspect("equal", adjustable="box")
    straight, pins = np.radians(np.clip(0.0, *np.transpose([joint.range_deg for joint in scene.joints]))), list[Array]()
    for place, degrees in enumerate(np.linspace(*scene.joints[i].range_deg, POSITIONS)):
        angles = straight.copy()
        angles[: i + 1] = 0.0
        angles[i] = np.radians(degrees)
        with np.errstate(invalid="ignore"):
            bones = skeleton(scene, angles)
        joint = bones.joints[i]
        if np.isfinite(joint.rod_pin).all():
            pins += joint.named.values()
            _mechanism(axes, scene, bones, i, {0: BLUE, POSITIONS - 1: ORANGE}.get(place))
    low, high = np.min(pins or [np.zeros(2)], axis=0), np.max(pins or [np.ones(2)], axis=0)
    middle, reach = 0.5 * (low + high), 0.62 * max(*(high - low), 0.05 * scene.reach)
    around = np.array([-reach, reach])
    axes.set(xlim=middle[0] + around, ylim=middle[1] + around, xlabel="x, m", ylabel="y, m")
    axes.locator_params(nbins=5)
    joint_range = " to ".join(f"{degrees:g}" for degrees in scene.joints[i].range_deg)
    axes.set_title(f"joint {i + 1}, kind {scene.joints[i].kind}: {joint_range} deg")


def _mechanism(axes: Axes, scene: Scene, bones: Skeleton, i: int, colour: str | None) -> None:
    """Draw one position of a joint's mechanism; name its pins, with a bright outline, if `colour` is given."""
    from matplotlib.patheffects import withStroke

    slender = 0.07  # width of a drawn barrel over its closed length

    joint, alpha = bones.joints[i], 0.12 if colour is None else 0.4
    draw_section(axes, section_parts(scene, bones, i), scene.sections[i].depth, alpha)
    if i > 0:
        draw_section(axes, section_parts(scene, bones, i - 1), scene.sections[i - 1].depth, 0.12)
    for corners, own in zip(joint.links, (GREEN, PURPLE), strict=False):
        draw_link(axes, corners, PALE if colour is None else own, 2.0 if colour is None else 3.5)
    if colour is None:
        axes.plot(*np.transpose([joint.barrel_pin, joint.rod_pin]), color=PALE, linewidth=3.0, zorder=4)
        return
    length = scene.joints[i].cylinder.closed_length
    draw_cylinder(axes, joint.barrel_pin, joint.rod_pin, length, slender * length)
    for name, pin in joint.named.items():
        draw_pin(axes, pin, 5.0, colour)
        axes.annotate(
            name, (pin[0], pin[1]), (5, 5), textcoords="offset points", fontsize=10, color=colour, weight="bold", zorder=12,
            path_effects=[withStroke(linewidth=3.0, foreground="white")],
        )  # fmt: skip


def _stroke(axes: Axes, scene: Scene, i: int) -> None:
    curve = 361  # angles
    joint = scene.joints[i]
    degrees = np.linspace(*joint.range_deg, curve)
    axes.axhspan(0.0, joint.cylinder.max_stroke, color=PALE, alpha=0.5, linewidth=0, label="0 to max_stroke")
    axes.plot(degrees, stroke_curve(scene, i, np.radians(degrees)), color=INK)
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    axes.set_xlabel(f"joint {i + 1}, deg")
    axes.set_ylabel("stroke, m")
    axes.legend(loc="best", fontsize=10)
