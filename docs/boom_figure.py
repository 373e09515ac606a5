"""Side view of a boom in equilibrium, with tables of its cylinders and frequencies and an enlarged joint."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from boom_twin import Scene
from boom_twin.analysis.equilibrium import Equilibrium
from boom_twin.analysis.undeflected import UndeflectedBoom
from boom_twin.compiler.compile import compile_scene
from boom_twin.plots.boom import draw_cylinder, draw_link, draw_section, section_parts
from boom_twin.plots.style import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, draw_base, draw_pin, picture, side_view
from boom_twin.scene.kinematics import Skeleton, joint_angles_of_strokes, skeleton
from boom_twin.types import Array

EXAGGERATION = 10.0
TIMES = "\N{MULTIPLICATION SIGN}"


def draw_boom(axes: Any, scene: Scene, bones: Skeleton, alpha: float = 0.55) -> None:
    """Draw base, sections, cylinders, links and pins of an undeformed boom."""
    size = 0.035 * float(sum(section.length for section in scene.sections))
    for i in range(len(scene.sections)):
        draw_section(axes, section_parts(scene, bones, i), scene.sections[i].depth, alpha)
    for joint, part in zip(bones.joints, scene.joints, strict=True):
        draw_cylinder(axes, joint.barrel_pin, joint.rod_pin, part.cylinder.closed_length, 0.22 * size)
        for corners, colour in zip(joint.links, (GREEN, PURPLE), strict=False):
            draw_link(axes, corners, colour, 3.0)
        for pin in joint.named.values():
            draw_pin(axes, pin, 4.0)
    draw_base(axes, bones.pivots[0], size)
    draw_base(axes, bones.joints[0].barrel_pin, 0.5 * size)


def boom_picture(scene: Scene, equilibrium: Equilibrium, path: Path, title: str, note: str) -> None:
    """Draw a boom in equilibrium into a PNG file, with `note` in small print."""
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


def _deflected(axes: Any, straight: Array, equilibrium: Equilibrium) -> None:
    bent = equilibrium.outline
    large = straight + EXAGGERATION * (bent - straight)
    axes.plot(straight[:, 0], straight[:, 1], color=GREY, linestyle=(0, (5, 3)), label="undeformed", zorder=9)
    axes.plot(bent[:, 0], bent[:, 1], color=BLUE, linewidth=2.6, label="deflected, true to scale", zorder=9)
    label = f"deflected, displacements {TIMES} {EXAGGERATION:g}"
    axes.plot(large[:, 0], large[:, 1], color=ORANGE, linewidth=1.6, label=label, zorder=9)
    axes.plot(*bent[-1], "o", color=BLUE, markersize=7, zorder=10)


def _lengths(axes: Any, scene: Scene, bones: Skeleton) -> None:
    """Draw number and length of every section, beside its middle."""
    for i, section in enumerate(scene.sections):
        lift = scene.sections[i].depth + 0.012 * float(np.ptp(bones.pivots, axis=0).max())
        where = bones.point(i, 0.5 * section.length, lift)
        degrees = float(np.degrees(bones.headings[i]))
        axes.text(
            where[0], where[1], f"{i + 1}: {section.length:.2f} m", rotation=degrees, rotation_mode="anchor",
            ha="center", va="bottom", fontsize=12, color=INK, zorder=11,
        )  # fmt: skip


def _detail(axes: Any, scene: Scene, bones: Skeleton) -> None:
    """Draw the joint in the middle of the boom, enlarged."""
    i = len(bones.joints) // 2
    joint = bones.joints[i]
    draw_boom(axes, scene, bones)
    pins = list(joint.named.values())
    low, high = np.min(pins, axis=0), np.max(pins, axis=0)
    middle, reach = 0.5 * (low + high), 0.58 * float(max(high - low)) + scene.sections[i].depth
    axes.set(xlim=middle[0] + np.array([-reach, reach]), ylim=middle[1] + 0.8 * np.array([-reach, reach]))
    axes.set(aspect="equal", xticks=[], yticks=[])
    axes.spines[:].set_visible(True)
    axes.set_title(f"joint {i + 1}, kind {joint.kind}, enlarged")


def _numbers(side: Any, equilibrium: Equilibrium) -> None:
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
