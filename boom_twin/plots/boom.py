"""Side view of a boom in equilibrium, with the symbols of an engineering sketch."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analysis.equilibrium import Equilibrium
from ..analysis.undeflected import UndeflectedBoom
from ..compiler.compile import compile_scene
from ..scene.kinematics import JointPins, Skeleton, joint_angles_of_strokes, skeleton
from ..scene.schema import Scene, section_depth
from ..types import Array
from .style import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, picture, side_view

if TYPE_CHECKING:
    from matplotlib.axes import Axes


STEEL, RIGID, BARREL, ROD = "#C9D6E2", "#8FA3B5", "#E6B98A", "#B9742F"


def draw_base(axes: Axes, pivot: Array, size: float) -> None:
    """Draw a triangle under a pivot (m) on hatched ground; `size` is its height (m)."""
    x, y = pivot
    ground, half = y - size, 0.6 * size
    axes.fill([x - half, x, x + half], [ground, y, ground], facecolor="white", edgecolor=INK, zorder=1.5)
    axes.plot([x - size, x + size], [ground, ground], color=INK, zorder=1.5)
    for k in np.linspace(-0.85, 1.0, 7):
        dash = [x + k * size, x + (k - 0.25) * size]
        axes.plot(dash, [ground, ground - 0.25 * size], color=INK, linewidth=0.9, zorder=1.5)
    draw_pin(axes, pivot)


def draw_pin(axes: Axes, place: Array, size: float = 6.0, colour: str = INK) -> None:
    """Draw a pin as a small circle, `size` in points."""
    look: dict[str, Any] = {"markerfacecolor": "white", "markeredgecolor": colour, "markeredgewidth": 1.5}
    axes.plot(place[0], place[1], "o", markersize=size, zorder=8, **look)


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
    """Draw a rectangle about the line from start to stop."""
    along = (stop - start) / np.hypot(*(stop - start))
    across = 0.5 * width * np.array([-along[1], along[0]])
    x, y = np.array([start + across, stop + across, stop - across, start - across]).T
    axes.fill(x, y, facecolor=colour, edgecolor=GREY, linewidth=0.9, zorder=order, alpha=alpha)


EXAGGERATION = 10.0
TIMES = "\N{MULTIPLICATION SIGN}"


def boom_picture(scene: Scene, equilibrium: Equilibrium, path: Path, title: str = "Boom at rest", note: str = "") -> Path:
    """Draw a boom in equilibrium into a PNG file, with `note` in small print; return `path`."""
    angles = joint_angles_of_strokes(scene, equilibrium.strokes, near=equilibrium.joints)
    bones, straight = skeleton(scene, angles), UndeflectedBoom(scene, compile_scene(scene)).at(angles)
    with picture(path, title, note) as figure:
        grid = figure.add_gridspec(2, 2, width_ratios=[3.0, 1.0], height_ratios=[1.35, 1.0])
        axes, side, close = (figure.add_subplot(place) for place in (grid[:, 0], grid[0, 1], grid[1, 1]))
        side_view(axes)
        draw_boom(axes, scene, bones)
        _deflected(axes, straight, equilibrium)
        _lengths(axes, scene, bones)
        axes.margins(0.05)
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 0.0))
        _numbers(side, equilibrium)
        _detail(close, scene, bones)
    return path


def draw_boom(axes: Axes, scene: Scene, bones: Skeleton, alpha: float = 0.55) -> None:
    """Draw base, sections, cylinders, links and pins of an undeformed boom."""
    size = 0.035 * float(sum(section.length for section in scene.sections))
    for i in range(len(scene.sections)):
        draw_section(axes, section_parts(scene, bones, i), section_depth(scene, i), alpha)
    for joint, part in zip(bones.joints, scene.joints, strict=True):
        draw_cylinder(axes, joint.barrel_pin, joint.rod_pin, part.cylinder.closed_length, 0.22 * size)
        for corners, colour in zip(joint.links, (GREEN, PURPLE), strict=False):
            draw_link(axes, corners, colour, 3.0)
        for pin in named_pins(joint).values():
            draw_pin(axes, pin, 4.0)
    draw_base(axes, bones.pivots[0], size)
    draw_base(axes, bones.joints[0].barrel_pin, 0.5 * size)


def named_pins(joint: JointPins) -> dict[str, Array]:
    """Return the pins of a joint by the names that the scene gives them."""
    six_bar = {"D": joint.d, "E": joint.e, "Q": joint.q}
    ends = {"base pin": joint.barrel_pin, "rod_pin": joint.rod_pin} if joint.d is None else {"C": joint.barrel_pin}
    if joint.kind in ("B2", "B3"):
        ends["R"] = joint.rod_pin
    return {"pivot": joint.pivot, **ends, **{name: pin for name, pin in six_bar.items() if pin is not None}}


def section_parts(scene: Scene, bones: Skeleton, i: int) -> list[tuple[Array, Array, bool]]:
    """Return root, beam and head of section `i` (0-based): start, end, True if flexible."""
    section = scene.sections[i]
    if section.beam is None:
        return [(bones.pivots[i], bones.pivots[i + 1], False)]
    x0, x1 = section.beam
    stops = [bones.point(i, x) for x in (0.0, x0, x1, section.length)]
    return [(stops[k], stops[k + 1], k == 1 and scene.is_flexible(i)) for k in range(3)]


def _deflected(axes: Axes, straight: Array, equilibrium: Equilibrium) -> None:
    bent = equilibrium.outline
    large = straight + EXAGGERATION * (bent - straight)
    axes.plot(straight[:, 0], straight[:, 1], color=GREY, linestyle=(0, (5, 3)), label="undeformed", zorder=9)
    axes.plot(bent[:, 0], bent[:, 1], color=BLUE, linewidth=2.6, label="deflected, true to scale", zorder=9)
    label = f"deflected, displacements {TIMES} {EXAGGERATION:g}"
    axes.plot(large[:, 0], large[:, 1], color=ORANGE, linewidth=1.6, label=label, zorder=9)
    axes.plot(*bent[-1], "o", color=BLUE, markersize=7, zorder=10)


def _lengths(axes: Axes, scene: Scene, bones: Skeleton) -> None:
    """Draw number and length of every section, beside its middle."""
    for i, section in enumerate(scene.sections):
        lift = section_depth(scene, i) + 0.012 * float(np.ptp(bones.pivots, axis=0).max())
        where = bones.point(i, 0.5 * section.length, lift)
        degrees = float(np.degrees(bones.headings[i]))
        axes.text(
            where[0], where[1], f"{i + 1}: {section.length:.2f} m", rotation=degrees, rotation_mode="anchor",
            ha="center", va="bottom", fontsize=12, color=INK, zorder=11,
        )  # fmt: skip


def _detail(axes: Axes, scene: Scene, bones: Skeleton) -> None:
    """Draw the joint in the middle of the boom, enlarged."""
    i = len(bones.joints) // 2
    joint = bones.joints[i]
    draw_boom(axes, scene, bones)
    pins = list(named_pins(joint).values())
    low, high = np.min(pins, axis=0), np.max(pins, axis=0)
    middle, reach = 0.5 * (low + high), 0.58 * float(max(high - low)) + section_depth(scene, i)
    axes.set(xlim=middle[0] + np.array([-reach, reach]), ylim=middle[1] + 0.8 * np.array([-reach, reach]))
    axes.set(aspect="equal", xticks=[], yticks=[])
    axes.spines[:].set_visible(True)
    axes.set_title(f"joint {i + 1}, kind {joint.kind}, enlarged")


def _numbers(side: Axes, equilibrium: Equilibrium) -> None:
    """Draw tables of the cylinders and of the natural frequencies."""
    side.axis("off")
    sag = 1e3 * (equilibrium.tip - equilibrium.tip_rigid)
    lines = [f"tip deflection   x {sag[0]:+.0f} mm", f"                 y {sag[1]:+.0f} mm", ""]
    lines += ["joint   angle   stroke    force", "          deg        m       kN"]
    for i, (angle, stroke, force) in enumerate(
        zip(np.degrees(equilibrium.joints), equilibrium.strokes, equilibrium.cylinder_forces / 1e3, strict=True)
    ):
        lines.append(f"  {i + 1}   {angle:+8.2f}  {stroke:7.3f}  {force:+7.1f}")
    lines += ["force: tension positive", "", "natural frequencies, Hz, undamped"]
    lines += [f"  {k + 1}   {frequency:9.3f}" for k, frequency in enumerate(equilibrium.frequencies)]
    text = "\n".join(lines)
    side.text(0.0, 0.98, text, transform=side.transAxes, va="top", fontsize=12.5, family="monospace", color=INK)
