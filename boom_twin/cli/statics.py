"""``boom_twin statics``: equilibrium under gravity, and small vibrations about it."""

from __future__ import annotations

import math
from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from .arguments import add_json, add_place, add_scene
from .output import open_scene, print_result, warn

if TYPE_CHECKING:
    from ..analysis.equilibrium import Equilibrium


def add_arguments(parser: ArgumentParser) -> None:
    add_scene(parser)
    add_place(parser)
    add_json(parser)


def run(args: Namespace) -> int:
    from ..analysis.equilibrium import statics

    scene = open_scene(args.scene)
    result = statics(scene, strokes=args.strokes, posture=args.posture, lengths=args.lengths)
    for doubt in result.doubts:
        warn(f"{doubt}.")
    print_result(args.json, as_json(result), as_text(result))
    return 0


def as_json(result: Equilibrium) -> dict[str, object]:
    """Return the keys of a result; `base_turn_rad` only of an elastic base, `warnings` only if there are any."""
    values: dict[str, object] = {
        "stroke_m": result.strokes,
        "length_m": result.lengths,
        "tip_rigid_m": result.tip_rigid,
        "tip_m": result.tip,
        "joint_rad": result.joints,
        "cylinder_force_N": result.cylinder_forces,
        "frequencies_Hz": result.frequencies,
    }
    if result.base_turn is not None:
        values["base_turn_rad"] = result.base_turn
    return values | {"warnings": result.doubts} if result.doubts else values


def as_text(result: Equilibrium) -> list[str]:
    (x, y), (dx, dy) = result.tip, result.tip - result.tip_rigid
    lines = [
        f"tip            x {x:.4f} m, y {y:.4f} m",
        f"deflection     x {1e3 * dx:+.1f} mm, y {1e3 * dy:+.1f} mm against rigid sections and cylinders",
        *([] if result.base_turn is None else [f"base           turned by {math.degrees(result.base_turn):+.4f} deg"]),
        "",
        "joint    drive m    length m   angle deg   cylinder force kN",
    ]
    for i in range(len(result.strokes)):
        angle, force = math.degrees(result.joints[i]), 1e-3 * result.cylinder_forces[i]
        lines.append(f"{i + 1:5d} {result.strokes[i]:10.4f} {result.lengths[i]:11.4f} {angle:11.3f} {force:+19.3f}")
    frequencies = ", ".join(f"{value:.3f}" for value in result.frequencies) or "none: nothing in this model can vibrate"
    return [*lines, "", f"natural frequencies Hz   {frequencies}"]
