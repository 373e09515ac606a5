"""Picture of every joint over its range: all pins, links and the cylinder from end to end, and the stroke by the angle."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..scene.kinematics import Skeleton, skeleton, stroke_curve
from ..scene.schema import Scene
from ..types import Array
from .boom import draw_cylinder, draw_link, draw_pin, draw_section, named_pins, section_parts
from .style import BLUE, GREEN, GREY, INK, ORANGE, PALE, PURPLE, picture, side_view

if TYPE_CHECKING:
    from matplotlib.axes import Axes

POSITIONS = 5  # of a joint, ends of its range included
CURVE = 361  # angles
COLUMNS = 3
FAN = 0.4  # radius of the sector that a section sweeps in the panel of the boom, over its length
ASIDE = 0.035  # of the reach, by which a section that is folded back is drawn beside the one that it lies on
SLENDER = 0.07  # width of a drawn barrel over its closed length
NOTE = "blue: lowest angle, orange: highest; section before along x"
ENDS = ((BLUE, "lowest"), (ORANGE, "highest"))


def joint_ranges_picture(path: Path, scene: Scene, name: str) -> Path:
    """Draw a pair of panels for each joint, and one of the boom with every joint at the ends of its range; return `path`."""
    count = len(scene.joints)
    columns = min(COLUMNS, count + 1)
    rows = -(-(count + 1) // columns)
    with picture(path, f"{name}: all pins over the range of each joint", NOTE, (18.0, 8.0 * rows)) as figure:
        grid = figure.add_gridspec(2 * rows, columns, height_ratios=[3.0, 1.0] * rows)
        _boom(figure.add_subplot(grid[0:2, 0]), scene)
        for i in range(count):
            row, column = divmod(i + 1, columns)
            _joint(figure.add_subplot(grid[2 * row, column]), scene, i)
            _stroke(figure.add_subplot(grid[2 * row + 1, column]), scene, i)
    return path


def _straight(scene: Scene) -> Array:
    """Return the joint angles (rad) of the boom as straight as its ranges allow."""
    return np.asarray(np.radians(np.clip(0.0, *np.transpose([joint.range_deg for joint in scene.joints]))))


def _boom(axes: Axes, scene: Scene) -> None:
    """Draw the straight boom, each section with only its own joint turned to its ends, and the fan that it sweeps."""
    from matplotlib.patheffects import withStroke

    side_view(axes)
    angles = _straight(scene)
    with np.errstate(invalid="ignore"):
        bones = skeleton(scene, angles)
    for i in range(len(scene.sections)):
        draw_section(axes, section_parts(scene, bones, i), scene.sections[i].depth)
    for i, joint in enumerate(scene.joints):
        before = float(bones.headings[i] - angles[i])
        _fan(axes, bones.pivots[i], before + np.radians(joint.range_deg), FAN * scene.sections[i].length)
        for degrees, (colour, word) in zip(joint.range_deg, ENDS, strict=True):
            line = folded_section(bones.pivots[i], before, np.radians(degrees), scene.sections[i].length, ASIDE * scene.reach)
            axes.plot(*line.T, "-", color=colour, linewidth=2.2, label="" if i else f"{word} angle of its joint", zorder=9)
            axes.plot(*line[-1], "o", color=colour, markersize=4.0, zorder=9)
        middle = bones.point(i, 0.5 * scene.sections[i].length)
        halo = [withStroke(linewidth=3.0, foreground="white")]
        axes.annotate(str(i + 1), (middle[0], middle[1]), ha="center", va="center", fontsize=12, zorder=10, path_effects=halo)
    for pivot in bones.pivots:
        draw_pin(axes, pivot, 4.0)
    axes.set_title("each section alone at the ends of its joint's range")
    axes.set_xlabel("x forward, m; folded sections are drawn aside")
    axes.legend(loc="lower left", fontsize=11)


def folded_section(pivot: Array, before: float, angle: float, length: float, aside: float) -> Array:
    """Return the line of a section that its joint turns by `angle` (rad) from the heading `before`, shape (3, 2), m.

    A folded section would lie on the section before. So it is moved to the side from which it came, by up to `aside` (m) at
    180 degrees, and not at all up to 90 degrees.
    """
    along = np.array([np.cos(before), np.sin(before)])
    across = np.sign(angle) * np.array([-along[1], along[0]])
    away = max(0.0, -np.cos(angle)) * aside * across
    end = length * np.array([np.cos(before + angle), np.sin(before + angle)])
    return np.array([pivot, pivot + away, pivot + away + end])


def _fan(axes: Axes, pivot: Array, ends: Array, radius: float) -> None:
    turn = np.linspace(ends[0], ends[1], 60)
    rim = pivot + radius * np.column_stack([np.cos(turn), np.sin(turn)])
    axes.fill(*np.vstack([pivot, rim]).T, facecolor=PURPLE, alpha=0.18, linewidth=0, zorder=3)


def _joint(axes: Axes, scene: Scene, i: int) -> None:
    """Draw sections before and after, links and cylinder: the ends of the range in full, positions between as a shadow."""
    axes.set_aspect("equal", adjustable="box")
    straight, pins = _straight(scene), list[Array]()
    for place, degrees in enumerate(np.linspace(*scene.joints[i].range_deg, POSITIONS)):
        angles = straight.copy()
        angles[: i + 1] = 0.0
        angles[i] = np.radians(degrees)
        with np.errstate(invalid="ignore"):
            bones = skeleton(scene, angles)
        joint = bones.joints[i]
        if np.isfinite(joint.rod_pin).all():
            pins += named_pins(joint).values()
            _mechanism(axes, scene, bones, i, {0: BLUE, POSITIONS - 1: ORANGE}.get(place))
    low, high = np.min(pins or [np.zeros(2)], axis=0), np.max(pins or [np.ones(2)], axis=0)
    middle, reach = 0.5 * (low + high), 0.62 * max(*(high - low), 0.05 * scene.reach)
    axes.set(xlim=middle[0] + np.array([-reach, reach]), ylim=middle[1] + np.array([-reach, reach]))
    axes.locator_params(nbins=5)
    joint_range = " to ".join(f"{degrees:g}" for degrees in scene.joints[i].range_deg)
    axes.set_title(f"joint {i + 1}, kind {scene.joints[i].kind}: {joint_range} deg")


def _mechanism(axes: Axes, scene: Scene, bones: Skeleton, i: int, colour: str | None) -> None:
    """Draw one position of a joint's mechanism; name its pins, with a bright outline, if `colour` is given."""
    from matplotlib.patheffects import withStroke

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
    draw_cylinder(axes, joint.barrel_pin, joint.rod_pin, length, SLENDER * length)
    for name, pin in named_pins(joint).items():
        draw_pin(axes, pin, 5.0, colour)
        axes.annotate(
            name, (pin[0], pin[1]), (5, 5), textcoords="offset points", fontsize=10, color=colour, weight="bold", zorder=12,
            path_effects=[withStroke(linewidth=3.0, foreground="white")],
        )  # fmt: skip


def _stroke(axes: Axes, scene: Scene, i: int) -> None:
    joint = scene.joints[i]
    degrees = np.linspace(*joint.range_deg, CURVE)
    axes.axhspan(0.0, joint.cylinder.max_stroke, color=PALE, alpha=0.5, linewidth=0, label="0 to max_stroke")
    axes.plot(degrees, stroke_curve(scene, i, np.radians(degrees)), color=INK)
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    axes.set_xlabel(f"joint {i + 1}, deg")
    axes.set_ylabel("stroke, m")
    axes.legend(loc="best", fontsize=10)
