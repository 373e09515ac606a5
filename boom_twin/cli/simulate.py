"""``boom_twin simulate``: the boom's answer to a stroke history."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

import numpy as np

from ..errors import UsageError
from ..scene import Scene
from ..system.atomic_files import check_new, check_target, write_atomic
from ..types import Array
from .csv_columns import columns_text, read_columns
from .main import add_scene, open_scene

FAR = 1e-3  # m, most that the first row may be away from the posture's strokes


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    add_scene(parser)
    parser.add_argument("--posture", required=True, metavar="NAME", help="the posture that the first row belongs to")
    parser.add_argument("--drive", required=True, metavar="IN.csv", help="t_s,stroke_1_m,.. (absolute strokes)")
    parser.add_argument("--out", required=True, metavar="OUT.csv", help="results, one row per row of the drive")
    parser.add_argument("--dt", type=float, default=1e-3, metavar="S", help="longest step, s (default 0.001)")
    quick = "step once and say nothing of errors: four to seven times as fast"
    parser.add_argument("--no-error-estimate", action="store_true", help=quick)
    parser.add_argument("--orbits", metavar="FILE.png", help="picture of the journals in their bushes, at the drive's rows")


def run(args: Namespace) -> int:
    """Read, simulate, write."""
    from ..analysis.simulate import simulate
    from ..compiler.compile import compile_scene

    scene = open_scene(args.scene)
    if args.orbits and not compile_scene(scene).pins:
        raise UsageError("--orbits: the scene has no pin with clearance. `boom_twin scene --clearance` prints one that has.")
    sources = [Path(path) for path in (args.drive, args.scene) if path is not None]
    check_target(Path(args.out), sources, _earlier(len(scene.joints)))
    if args.orbits:
        check_new(Path(args.orbits), sources)
    times, strokes = read_drive(Path(args.drive), len(scene.joints))
    angles = _angles_near(scene, args.posture, strokes[0])
    result = simulate(scene, times, strokes, args.dt, angles, estimate_errors=not args.no_error_estimate)
    for doubt in result.doubts:
        print(f"boom_twin simulate: warning: {doubt}.", file=sys.stderr)
    write_atomic(Path(args.out), columns_text(result.columns()))
    for name, lost in zip(result.pin_names, result.lost_contacts, strict=True):
        print(f"{name}: contact lost {lost} times")
    if args.orbits:
        from ..plots.history import Orbits
        from ..plots.posture import orbits_picture

        gaps = compile_scene(scene).tables.clearances.gap
        orbits = Orbits(result.times, result.pin_names, gaps, result.pins, result.lost_contacts)
        orbits_picture(Path(args.orbits), f"{Path(args.drive).name}: journals in their bushes", orbits)
    return 0


def _earlier(joints: int) -> bytes:
    """How a file of results begins, and no drive."""
    return ",".join(["t_s", *(f"stroke_{i + 1}_m" for i in range(joints)), "joint_1_rad,"]).encode()


def read_drive(path: Path, n: int) -> tuple[Array, Array]:
    """Times (m,) in s and strokes (m, n) in m of a CSV file with the header t_s,stroke_1_m,.. .

    Raises
    ------
    UsageError
        The file cannot be read, has another header, no rows, or a value that is not a number; says where.
    """
    wanted = ["t_s", *(f"stroke_{i + 1}_m" for i in range(n))]
    table = read_columns(path, wanted)
    return table[:, 0], table[:, 1:]


def _angles_near(scene: Scene, posture: str, first: Array) -> Array:
    """Joint angles of the posture, if the first row has its strokes."""
    from ..scene.kinematics import posture_angles, strokes_of_posture

    expected = strokes_of_posture(scene, posture)
    off = np.abs(expected - first)
    if not np.max(off) <= FAR:
        i = int(np.argmax(off))
        raise UsageError(
            f"stroke_{i + 1}_m = {first[i]:.6g} in the first row: posture {posture} has {expected[i]:.6g}, and they may "
            f"differ by {FAR:g} m. Start the drive in the posture, or name another."
        )
    return posture_angles(scene, posture)
