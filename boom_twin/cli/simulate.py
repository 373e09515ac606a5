"""``boom_twin simulate``: response of the boom to drives or cylinder lengths."""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import UsageError
from ..loggers.log_table import CsvLogTable, columns_of
from ..scene import Scene
from ..system.files import check_target, write_atomic
from ..system.result_text import csv_text, numbers
from ..types import Array
from .arguments import add_json, add_scene, files_of, not_negative
from .output import open_scene, print_result, warn

if TYPE_CHECKING:
    from ..analysis.simulate import Simulation

FORCE_COLUMNS = ("t_s", "tip_fx_N", "tip_fy_N")


def add_arguments(parser: ArgumentParser) -> None:
    add_scene(parser)
    purpose = "posture that the first row must be in: a name, or section angles, deg (default: any)"
    parser.add_argument("--posture", metavar="NAME", help=purpose)
    followed = parser.add_mutually_exclusive_group(required=True)
    followed.add_argument("--drive", metavar="IN.csv", help="strokes of the drives: t_s,stroke_1_m,..")
    lengths = "cylinder lengths, as transducers read them: t_s,length_1_m,.. or t_s,stroke_1_m,.."
    followed.add_argument("--lengths", metavar="IN.csv", help=lengths)
    pushed = "t_s,tip_fx_N,tip_fy_N: a force at the tip, in the axes of the base; constant before and after its rows"
    parser.add_argument("--force", metavar="IN.csv", help=pushed)
    parser.add_argument("--out", required=True, metavar="OUT.csv", help="results, one row per row of IN.csv")
    parser.add_argument("--dt", type=float, default=1e-3, metavar="S", help="longest step, s (default 0.001)")
    add_json(parser)
    quick = "skip the error estimate: four to seven times as fast"
    parser.add_argument("--no-error-estimate", action="store_true", help=quick)
    damping = "spectral radius: share of the fastest vibrations left after a step, 0 to below 1 (default 0.8)"
    parser.add_argument("--rho", type=_share, metavar="RHO", help=damping)


def _share(text: str) -> float:
    if (value := not_negative(text)) >= 1.0:
        raise ArgumentTypeError(f"{text}: must be below 1: closed loops need numerical damping")
    return value


def run(args: Namespace) -> int:
    from ..analysis.simulate import RHO, simulate

    scene = open_scene(args.scene)
    sources = files_of(args, "drive", "lengths", "force", "scene")
    check_target(Path(args.out), sources, _holds_simulation)
    times, strokes, stem = read_history(sources[0], len(scene.joints), ("length", "stroke") if args.lengths else ("stroke",))
    pushed = None if args.force is None else columns_of(CsvLogTable(Path(args.force)), FORCE_COLUMNS)
    for oddity in odd_in_drive(times, strokes, stem):
        warn(f"{sources[0]}: {oddity}")
    angles = None if args.posture is None else _angles_near(scene, args.posture, strokes[0], bool(args.lengths))
    rho = RHO if args.rho is None else args.rho
    drives, lengths = (None, strokes) if args.lengths else (strokes, None)
    result = simulate(scene, times, drives, args.dt, angles, rho, not args.no_error_estimate, lengths=lengths, force=pushed)
    for doubt in result.doubts:
        warn(f"{doubt}.")
    write_atomic(Path(args.out), csv_text(result.columns()))
    print_result(args.json, as_json(result, args.out), as_text(result, args.out))
    return 0


def as_json(result: Simulation, out: str) -> dict[str, object]:
    x, y = result.tip[:, 0], result.tip[:, 1]
    return {
        "out": out,
        "rows": len(result.times),
        "duration_s": float(result.times[-1] - result.times[0]),
        "stroke_m": result.strokes[0],
        "tip_start_m": [x[0], y[0]],
        "tip_end_m": [x[-1], y[-1]],
        "tip_travel_m": float(np.hypot(np.diff(x), np.diff(y)).sum()),
        "tip_acceleration_max_m_s2": float(np.hypot(*result.tip_acceleration[:, :2].T).max()),
        "cylinder_force_max_N": np.abs(result.cylinder_forces).max(axis=0),
        "lost_contacts": [f"{name}: {lost}" for name, lost in zip(result.pin_names, result.lost_contacts, strict=True)],
        "warnings": result.doubts,
    }


def as_text(result: Simulation, out: str) -> list[str]:
    figures = as_json(result, out)
    (x, y), (end_x, end_y) = result.tip[0, :2], result.tip[-1, :2]
    lines = [
        f"started at rest   strokes {numbers(result.strokes[0])} m, tip x {x:.4f} m, y {y:.4f} m",
        f"followed          {figures['rows']} rows, {figures['duration_s']:g} s; the way of the tip is "
        f"{figures['tip_travel_m']:.3f} m long and ends at x {end_x:.4f} m, y {end_y:.4f} m",
        f"tip acceleration  {figures['tip_acceleration_max_m_s2']:.3g} m/s^2 at most",
        f"cylinder forces   {numbers(figures['cylinder_force_max_N'], 1e-3)} kN at most",
    ]
    lines += [f"{name}: contact lost {lost} times" for name, lost in zip(result.pin_names, result.lost_contacts, strict=True)]
    return [*lines, out]


def _holds_simulation(start: bytes) -> bool:
    names = start.partition(b"\n")[0].decode(errors="replace").split(",")
    is_replay = any(name.startswith("measured_") for name in names)
    return names[0] == "t_s" and not is_replay and any(name.startswith("tip_x_m") for name in names)


def read_history(path: Path, n: int, stems: Sequence[str]) -> tuple[Array, Array, str]:
    """Return times (m,) in s, strokes or lengths (m, n) in m, and their column stem from a CSV file.

    BagError for another file. The stem is the first of `stems` in the header.
    """
    table = CsvLogTable(path)
    stem = next((stem for stem in stems if f"{stem}_1_m" in table.headers), stems[0])
    if (more := f"{stem}_{n + 1}_m") in table.headers:
        raise UsageError(f"{path}: column {more}, but the scene has {n} cylinders. Give another scene, or remove the column.")
    found = columns_of(table, ("t_s", *(f"{stem}_{i + 1}_m" for i in range(n))))
    return found[:, 0], found[:, 1:], stem


def odd_in_drive(times: Array, strokes: Array, stem: str = "stroke") -> list[str]:
    """Return warnings, with place and remedy, of probable input errors: times in ms, strokes that jump."""
    sparse_rows = 1.0  # s between rows, above which a warning comes
    fastest_cylinder = 0.5  # m/s, speed above which a warning comes; booms stay below 0.3
    steps, found = np.diff(times), []
    if not len(steps) or not (steps > 0.0).all():
        return []  # `simulate` refuses it
    if (usual := float(np.median(steps))) >= sparse_rows:
        found.append(
            f"t_s grows by {usual:g} s from row to row, {times[-1] - times[0]:g} s in all, with smooth strokes between. "
            "If these are ms, divide them by 1000: t_s is in seconds."
        )
    speeds = np.abs(np.diff(strokes, axis=0)) / steps[:, None]
    row, i = np.unravel_index(np.argmax(speeds), speeds.shape)
    if speeds[row, i] > fastest_cylinder:
        found.append(
            f"line {row + 3}: {stem}_{i + 1}_m goes {strokes[row, i]:g} to {strokes[row + 1, i]:g} within {steps[row]:g} s, "
            f"{speeds[row, i]:.3g} m/s; cylinders of booms move at less than 0.3 m/s. Check the value and the times."
        )
    return found


def _angles_near(scene: Scene, posture: str, first: Array, are_lengths: bool) -> Array:
    """Return the posture's joint angles; UsageError unless the first row matches its drives."""
    from ..analysis.equilibrium import drives_at_rest
    from ..scene.kinematics import posture_angles, strokes_of_posture

    posture_deviation = 1e-3  # m, largest deviation of the first row from the posture's strokes

    expected, angles = strokes_of_posture(scene, posture), posture_angles(scene, posture)
    drives = drives_at_rest(scene, first, angles) if are_lengths else first
    off = np.abs(expected - drives)
    if not np.max(off) <= posture_deviation:
        i = int(np.argmax(off))
        at_rest = " at rest" if are_lengths else ""
        raise UsageError(
            f"stroke_{i + 1}_m = {drives[i]:.6g} in the first row{at_rest}: posture {posture} has {expected[i]:.6g} m, and the "
            f"difference may be {posture_deviation:g} m. Start in the posture, or name another."
        )
    return angles
