"""``boom_twin statics``: equilibrium under gravity, and small vibrations about it."""

from __future__ import annotations

import math
import sys
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from typing import TYPE_CHECKING

from .main import add_json, add_scene, open_scene, print_result

if TYPE_CHECKING:
    from ..analysis.equilibrium import Equilibrium


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    add_scene(parser)
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--posture", metavar="P", help="a posture of the scene, or section angles, deg: 60,-20,-30")
    where.add_argument("--strokes", type=numbers, metavar="S1,..,SN", help="absolute strokes of the drives, m")
    read = "cylinder lengths less closed_length, m: what stroke transducers read of the boom at rest"
    where.add_argument("--lengths", type=numbers, metavar="L1,..,LN", help=read)
    add_json(parser)


def numbers(text: str) -> list[float]:
    """Parse numbers between commas."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise ArgumentTypeError(f"{text!r} is not a list of numbers like 0.1,0.2") from None


def run(args: Namespace) -> int:
    """Solve and print."""
    from ..analysis.equilibrium import statics

    scene = open_scene(args.scene)
    found = statics(scene, strokes=args.strokes, posture=args.posture, lengths=args.lengths)
    for doubt in found.doubts:
        print(f"boom_twin statics: warning: {doubt}.", file=sys.stderr)
    print_result(args.json, as_json(found), as_text(found))
    return 0


def as_json(found: Equilibrium) -> dict[str, object]:
    """Return the keys of a result; `warnings` only if there are any."""
    told: dict[str, object] = {
        "stroke_m": found.strokes,
        "length_m": found.lengths,
        "tip_rigid_m": found.tip_rigid,
        "tip_m": found.tip,
        "joint_rad": found.joints,
        "cylinder_force_N": found.cylinder_forces,
        "frequencies_Hz": found.frequencies,
    }
    return told | {"warnings": found.doubts} if found.doubts else told


def as_text(found: Equilibrium) -> list[str]:
    """Return the lines of a short table, one joint a line."""
    (x, y), (dx, dy) = found.tip, found.tip - found.tip_rigid
    lines = [
        f"tip            x {x:.4f} m, y {y:.4f} m",
        f"deflection     x {1e3 * dx:+.1f} mm, y {1e3 * dy:+.1f} mm against rigid sections and cylinders",
        "",
        "joint    drive m    length m   angle deg   cylinder force kN",
    ]
    for i in range(len(found.strokes)):
        angle, force = math.degrees(found.joints[i]), 1e-3 * found.cylinder_forces[i]
        lines.append(f"{i + 1:5d} {found.strokes[i]:10.4f} {found.lengths[i]:11.4f} {angle:11.3f} {force:+19.3f}")
    frequencies = ", ".join(f"{value:.3f}" for value in found.frequencies) or "none: nothing in this model can vibrate"
    return [*lines, "", f"natural frequencies Hz   {frequencies}"]
