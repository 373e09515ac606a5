"""Draws the pictures of the guide from the geometry of the default scene: `python docs/figures.py [FOLDER]`."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from boom_figure import boom_picture
from dimensions import angle, dimension, frame, leader, mass_centre, name, span
from page_figure import CHROMIUM, page_picture

from boom_twin.analysis.equilibrium import statics
from boom_twin.cli.main import main as command
from boom_twin.plots.boom import draw_cylinder, draw_link, draw_section, section_parts
from boom_twin.plots.style import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, draw_base, draw_pin, picture
from boom_twin.scene import Scene, load_scene
from boom_twin.scene.kinematics import JointPins, Skeleton, skeleton, stroke_curve
from boom_twin.scene.load import examine_text, example_text
from boom_twin.scene.schema import Joint

SURROGATE = "drawn from the default scene (surrogate parameters)"


Range = tuple[float, float]


@contextmanager
def sheet(path: Path, title: str, panels: list[tuple[Range, Range]], height: float) -> Iterator[list[Any]]:
    """Equal axes side by side, for the ranges (m) of x and y in `panels`, all `height` hundreds of pixels high."""
    widths = [height * (x[1] - x[0]) / (y[1] - y[0]) for x, y in panels]
    with picture(path, title, SURROGATE, (sum(widths) + 0.3, height + 0.75)) as figure:
        found = np.ravel(figure.subplots(1, len(panels), squeeze=False, gridspec_kw={"width_ratios": widths}))
        for axes, (x, y) in zip(found, panels, strict=True):
            axes.set_aspect("equal")
            axes.set_xlim(*x)
            axes.set_ylim(*y)
            axes.axis("off")
        yield list(found)


def draw_pins(axes: Any, joint: JointPins) -> None:
    """All pins of a joint."""
    for pin in joint.named.values():
        draw_pin(axes, pin, 9.0)


def stroke_lines(axes: Any, joint: JointPins, closed: float, shift: float, at: float = 0.5) -> None:
    """Closed length and stroke along a cylinder, beside it."""
    whole = joint.rod_pin - joint.barrel_pin
    end = joint.barrel_pin + closed * whole / np.hypot(*whole)
    dimension(axes, joint.barrel_pin, end, "closed_length", shift)
    dimension(axes, end, joint.rod_pin, "stroke (+)", shift, ORANGE, at)


def section_figure(scene: Scene, path: Path) -> None:
    """Section 1 in its own frame."""
    bones, section = skeleton(scene, np.zeros(len(scene.sections))), scene.sections[0]
    assert section.beam and section.root and section.head and section.rod_pin
    title = "A section: everything is measured from its inboard pivot"
    with sheet(path, title, [((-0.5, 4.35), (-0.58, 0.78))], 4.4) as (axes,):
        draw_section(axes, section_parts(scene, bones, 0), scene.sections[0].depth)
        inboard, outboard, (x0, x1) = bones.point(0, 0), bones.point(0, section.length), section.beam
        rod, root, head = (bones.point(0, *p) for p in (section.rod_pin, section.root.com, section.head.com))
        axes.plot(*np.array([inboard, outboard]).T, color=GREY, linestyle=(0, (9, 3, 2, 3)), linewidth=1.0, zorder=3)
        frame(axes, inboard, 0.0, 0.42, ("x", "y"), BLUE)
        for pin in (inboard, outboard, rod):
            draw_pin(axes, pin, 10.0)
        mass_centre(axes, root)
        mass_centre(axes, head)
        name(axes, inboard, "inboard\npivot", (-14, 0))
        name(axes, outboard, "outboard\npivot", (14, 0))
        leader(axes, root, "root: mass, com, inertia (rigid)", (-62, -112))
        leader(axes, head, "head: mass, com, inertia (rigid)", (-8, -112))
        leader(axes, rod, "rod_pin, on section 1 only", (96, -66))
        name(axes, bones.point(0, 2.1), "beam bends: A, I, rho_A, rho_I, beta, modes", (0, 0), weight="normal")
        span(axes, inboard, bones.point(0, x0), "beam[0]", 0.24)
        span(axes, inboard, bones.point(0, x1), "beam[1]", 0.38)
        span(axes, inboard, outboard, "length", 0.64)
        span(axes, inboard, rod, "rod_pin[0]", -0.28)
        span(axes, bones.point(0, section.rod_pin[0]), rod, "rod_pin[1] (−)", 0.85, across=True, at=1.42)


def joint_a_figure(scene: Scene, path: Path) -> None:
    """Joint 1 with its cylinder."""
    phi = np.radians(38.0)
    bones = skeleton(scene, np.concatenate([[phi], np.zeros(len(scene.sections) - 1)]))
    joint = bones.joints[0]
    title = "Joint 1, kind A"
    with sheet(path, title, [((-1.45, 2.0), (-1.6, 0.98))], 8.0) as (axes,):
        draw_section(axes, section_parts(scene, bones, 0), scene.sections[0].depth)
        draw_cylinder(axes, joint.barrel_pin, joint.rod_pin, scene.joints[0].cylinder.closed_length, 0.1)
        draw_base(axes, joint.named["the pivot"], 0.24)
        draw_base(axes, joint.barrel_pin, 0.18)
        frame(axes, joint.named["the pivot"], 0.0, 0.62, ("x", "y"), BLUE)
        draw_pins(axes, joint)
        axes.plot([0.7, 1.35], [0.0, 0.0], color=GREY, linewidth=0.9, linestyle=(0, (4, 3)))
        angle(axes, joint.named["the pivot"], 0.0, phi, 1.2, "joint_1 (+)", ORANGE)
        leader(axes, joint.named["the pivot"], "base.pivot", (-95, 34))
        leader(axes, joint.barrel_pin, "base.cylinder_pin", (150, -26))
        leader(axes, joint.rod_pin, "rod_pin", (-46, 80))
        stroke_lines(axes, joint, scene.joints[0].cylinder.closed_length, -0.3)
        span(axes, joint.named["the pivot"], joint.barrel_pin, "cylinder_pin[0] − pivot[0]", -1.54, at=-0.95)
        span(axes, joint.named["the pivot"], joint.barrel_pin, "cylinder_pin[1] − pivot[1]", -0.9, across=True)
        name(axes, bones.point(0, 1.45), "section 1", (0, 0), weight="normal")


def six_bar_figure(scene: Scene, i: int, phi: float, path: Path) -> None:
    """Joint `i` (0-based) at angle `phi` (rad) on a level section: the whole, and the links enlarged."""
    angles = np.zeros(len(scene.sections))
    angles[i] = phi
    bones = skeleton(scene, angles)
    joint, kind = bones.joints[i], scene.joints[i].kind
    x, y = joint.named["the pivot"]
    told = {"B1": "the rod pin is Q", "B2": "the rod pin is on link L", "B3": "the rod pin is on link R"}[kind]
    panels = [((x - 1.5, x + 0.62), (y - 0.46, y + 0.52)), ((x - 0.34, x + 0.42), (y - 0.34, y + 0.48))]
    with sheet(path, f"Joint {i + 1}, kind {kind}: {told}", panels, 5.3) as (whole, close):
        for axes in (whole, close):
            _linkage(axes, scene, bones, i)
        _whole(whole, scene, bones, i)
        _links(close, joint, phi)
        _rod_pin(close, joint)


def _linkage(axes: Any, scene: Scene, bones: Skeleton, i: int) -> None:
    joint = bones.joints[i]
    for k in (i - 1, i):
        draw_section(axes, section_parts(scene, bones, k), 0.75 * scene.sections[k].depth, 0.6)
    draw_link(axes, joint.links[0], GREEN, 7.0)
    draw_link(axes, joint.links[1], PURPLE, 7.0)
    draw_cylinder(axes, joint.barrel_pin, joint.rod_pin, scene.joints[i].cylinder.closed_length, 0.07)
    draw_pins(axes, joint)


def _stroke(joint: JointPins, part: Joint) -> float:
    return float(np.hypot(*(joint.rod_pin - joint.barrel_pin))) - part.cylinder.closed_length


def _whole(axes: Any, scene: Scene, bones: Skeleton, i: int) -> None:
    """Sections, cylinder, and the angle."""
    joint, part = bones.joints[i], scene.joints[i]
    x, y = joint.named["the pivot"]
    stroke_lines(axes, joint, part.cylinder.closed_length, 0.12, 1.0 + 0.1 / _stroke(joint, part))
    frame(axes, joint.named["the pivot"], 0.0, 0.26, ("x", "y"), BLUE)
    axes.plot([x + 0.3, x + 0.48], [y, y], color=GREY, linewidth=0.9, linestyle=(0, (4, 3)))
    angle(axes, joint.named["the pivot"], 0.0, float(bones.headings[i]), 0.42, f"joint_{i + 1} (−)", ORANGE)
    name(axes, np.array([x - 0.62, y]), f"section {i}", (0, 0), weight="normal")
    name(axes, bones.point(i, 0.56), f"section {i + 1}", (0, 0), weight="normal")
    name(axes, joint.barrel_pin, "C", (12, 20))
    name(axes, joint.named["the pivot"], "pivot", (-8, -24))
    span(axes, joint.barrel_pin, joint.named["the pivot"], "C[0] (−)", y - 0.34)
    span(axes, joint.named["the pivot"], joint.barrel_pin, "C[1]", joint.barrel_pin[0] - 0.12, across=True)


def _links(axes: Any, joint: JointPins, phi: float) -> None:
    """Pins D, E, Q and the lengths of the links."""
    assert joint.named["D"] is not None and joint.named["E"] is not None and joint.named["Q"] is not None
    y = joint.named["the pivot"][1]
    frame(axes, joint.named["the pivot"], 0.0, 0.3, ("x", ""), BLUE)
    frame(axes, joint.named["the pivot"], phi, 0.3, ("x'", "y'"), INK)
    across = np.array([-np.sin(phi), np.cos(phi)])
    foot = joint.named["E"] - across * float((joint.named["E"] - joint.named["the pivot"]) @ across)
    dimension(axes, joint.named["the pivot"], foot, "E[0]", -0.12)
    dimension(axes, foot, joint.named["E"], "E[1]", -0.115, at=1.62)
    span(axes, joint.named["D"], joint.named["the pivot"], "D[0] (−)", y - 0.24, at=-0.62)
    span(axes, joint.named["the pivot"], joint.named["D"], "D[1] (−)", joint.named["D"][0] - 0.06, across=True, at=2.1)
    name(axes, joint.named["D"], "D", (11, -10))
    name(axes, joint.named["E"], "E", (14, 8))
    name(axes, joint.named["Q"], "Q = rod pin" if joint.kind == "B1" else "Q", (14, 12) if joint.kind != "B3" else (16, -2))
    name(axes, 0.55 * joint.named["D"] + 0.45 * joint.named["Q"], "lL", (0, 0), GREEN)
    name(axes, 0.5 * (joint.named["E"] + joint.named["Q"]), "lR", (0, 0), PURPLE)


def _rod_pin(axes: Any, joint: JointPins) -> None:
    """How R is measured: along its link, then to the left of it."""
    if joint.kind == "B1":
        return
    assert joint.named["D"] is not None and joint.named["E"] is not None and joint.named["Q"] is not None
    start, stop = (joint.named["D"], joint.named["Q"]) if joint.kind == "B2" else (joint.named["Q"], joint.named["E"])
    along = (stop - start) / np.hypot(*(stop - start))
    foot = start + along * float((joint.rod_pin - start) @ along)
    axes.plot(*np.array([foot, joint.rod_pin]).T, color=INK, linewidth=1.3, linestyle=(0, (4, 3)), zorder=9)
    middle = 0.5 * (foot + joint.rod_pin)
    if joint.kind == "B2":
        dimension(axes, start, foot, "R[0]", -0.07)
        name(axes, joint.rod_pin, "R", (-14, 14))
        leader(axes, middle, "R[1], left of D→Q", (10, 62))
    else:
        name(axes, joint.rod_pin, "R", (-14, 16))
        leader(axes, 0.5 * (start + foot), "R[0], from Q along Q→E", (52, 62))
        leader(axes, middle, "R[1], left of Q→E (here −)", (-70, 92))


def side_figure(scene: Scene, i: int, phi: float, path: Path) -> None:
    """Joint `i` (0-based) at angle `phi` (rad), and the same turned over, at the opposite angle."""
    part = scene.joints[i]
    points = {key: (point[0], -point[1]) for key in ("C", "D", "E", "R") if (point := getattr(part, key)) is not None}
    joints = [*scene.joints[:i], part.model_copy(update=points | {"side": "right"}), *scene.joints[i + 1 :]]
    over = scene.model_copy(update={"joints": tuple(joints)})
    x = sum(section.length for section in scene.sections[:i])
    panels = [((x - 1.05, x + 0.75), (-0.72, 0.52)), ((x - 1.05, x + 0.75), (-0.52, 0.72))]
    title = "side: Q lies to the left of D→E, or to the right of it"
    with sheet(path, title, panels, 4.6) as both:
        for axes, drawn, turn, told in zip(both, (scene, over), (phi, -phi), ("left (default)", "right"), strict=True):
            angles = np.zeros(len(scene.sections))
            angles[i] = turn
            bones = skeleton(drawn, angles)
            _linkage(axes, drawn, bones, i)
            _side(axes, bones.joints[i], f"side: {told}", float(np.sign(-turn)))


def _side(axes: Any, joint: JointPins, told: str, up: float) -> None:
    """The arrow from D to E, and names; `up` is 1 where the links are above the section, -1 where they are below."""
    assert joint.named["D"] is not None and joint.named["E"] is not None and joint.named["Q"] is not None
    look = {"arrowstyle": "-|>", "color": ORANGE, "linewidth": 2.2, "shrinkA": 0, "shrinkB": 4, "mutation_scale": 20}
    axes.annotate("", tuple(joint.named["E"]), tuple(joint.named["D"]), arrowprops=look, zorder=11)
    for point, text, offset in (
        (joint.named["D"], "D", (-16, -14)),
        (joint.named["E"], "E", (15, -6)),
        (joint.named["Q"], "Q", (0, 18)),
    ):
        name(axes, point, text, (offset[0], up * offset[1]))
    name(axes, joint.barrel_pin, "C", (0, up * 20))
    name(axes, joint.named["the pivot"] + np.array([-0.45, -up * 0.35]), told, (0, 0), ORANGE)


def lengths_figure(scene: Scene, path: Path) -> None:
    """Cylinder 1 with unloaded oil, and pressed together: its drive and its length, the compression a hundred times as large."""
    closed, drive, pressed = scene.joints[0].cylinder.closed_length, 0.45, 0.17
    told = ((0.75, drive, "unloaded oil, F = 0"), (0.0, drive - pressed, "oil compressed, F < 0"))
    with sheet(path, "Length and drive", [((-0.3, 2.05), (-0.34, 1.1))], 5.2) as (axes,):
        for y, stroke, words in told:
            barrel, end, rod = np.array([0.0, y]), np.array([closed, y]), np.array([closed + stroke, y])
            draw_cylinder(axes, barrel, rod, closed, 0.13)
            for pin in (barrel, rod):
                draw_pin(axes, pin, 9.0)
            dimension(axes, barrel, end, "closed_length", -0.22)
            name(axes, np.array([0.05, y + 0.17]), words, (1, 0))
            if stroke == drive:
                dimension(axes, end, rod, "drive", -0.22)
                continue
            dimension(axes, end, rod, "length", -0.22, ORANGE)
            dimension(axes, rod, rod + [pressed, 0.0], "F / k", 0.22, GREEN, 1.7)
            for pin, far in ((barrel, -0.27), (rod, 0.27)):
                arrow = {"arrowstyle": "-|>", "color": BLUE, "linewidth": 2.2, "shrinkB": 6, "mutation_scale": 20}
                axes.annotate("", tuple(pin), (pin[0] + far, y), arrowprops=arrow, zorder=11)
            name(axes, np.array([rod[0] + 0.29, y]), "F", (2, 0), BLUE)
        axes.plot([closed + drive] * 2, [0.0, 0.75], color=GREY, linewidth=0.9, linestyle=(0, (4, 3)), zorder=1)


def response_figures(out: Path) -> None:
    """Frequency response, steady state and resonance map of the default scene, by the command itself."""
    for given, made, name in (
        (["--posture", "arch"], "response.png", "response.png"),
        (["--posture", "arch", "--pump", "0.35:130"], "steady_state.png", "response_steady_state.png"),
        (["--map", "all", "--pump", "0.4:130"], "resonance_map.png", "response_map.png"),
    ):
        with TemporaryDirectory() as folder:
            assert command(["response", *given, "--out", f"{folder}/out"]) == 0
            (out / name).write_bytes((Path(folder) / "out" / made).read_bytes())


def main() -> None:
    """Write every picture into the folder that is given, by default beside this script."""
    out = Path(sys.argv[1] if len(sys.argv) > 1 else __file__)
    out = out if out.is_dir() else out.parent
    scene = load_scene()
    title = "Default boom, posture arch: at rest under gravity"
    boom_picture(scene, statics(scene, posture="arch"), out / "boom.png", title, "surrogate parameters")
    section_figure(scene, out / "symbols_section.png")
    joint_a_figure(scene, out / "symbols_joint_a.png")
    lengths_figure(scene, out / "lengths_and_drives.png")
    for i, degrees in ((1, -42.0), (2, -42.0), (3, -42.0)):
        assert np.isfinite(stroke_curve(scene, i, np.radians([degrees]))).all()
        six_bar_figure(scene, i, float(np.radians(degrees)), out / f"symbols_b{i}.png")
    side_figure(scene, 1, float(np.radians(-42.0)), out / "symbols_side.png")
    example, _ = examine_text(example_text("five_section_z_fold"), "example")
    title = "Five-section Z-fold boom, posture arch: at rest under gravity"
    boom_picture(example, statics(example, posture="arch"), out / "z_fold_arch.png", title, "synthetic parameters")
    response_figures(out)
    if CHROMIUM.is_file():
        page_picture(out / "monitor.png")
    else:
        print("skipped: monitor.png, because chromium is not there (Debian: apt-get install chromium)", file=sys.stderr)


if __name__ == "__main__":
    main()
