"""`boom_twin check --sensors`: which accuracy of the tip which sensors give, by posture."""

from __future__ import annotations

from argparse import ArgumentParser
from itertools import combinations
from typing import Any

from ..deviation.accuracy import TipAccuracy, accuracy_at
from ..errors import BoomTwinError, UsageError
from ..scene.kinematics import strokes_of_posture
from ..scene.schema import Scene
from ..types import Stream

NAMES = {"angles": Stream.ANGLES, "imu": Stream.IMU, "forces": Stream.FORCES}


def add_arguments(parser: ArgumentParser) -> None:
    """Declare ``--sensors``."""
    parser.add_argument(
        "--sensors",
        metavar="NAME,..",
        help=f"also tell how accurate the estimate of the tip is with these and with fewer, at every posture of the scene: "
        f"{', '.join(NAMES)}; a name given twice is two such sensors (example: angles,imu,imu)",
    )


def sensors_of(text: str) -> list[Stream]:
    """Return the sensors named in `text`; raise UsageError for an unknown name."""
    names = [name.strip() for name in text.split(",") if name.strip()]
    for name in names:
        if name not in NAMES:
            raise UsageError(f"--sensors: {name!r} is no sensor. Known: {', '.join(NAMES)}.")
    return [NAMES[name] for name in names]


def sets_of(sensors: list[Stream]) -> list[tuple[Stream, ...]]:
    """Return every selection of sensors once, fewest first, the empty one included."""
    found = [chosen for count in range(len(sensors) + 1) for chosen in combinations(sensors, count)]
    return list(dict.fromkeys(found))


def words(chosen: tuple[Stream, ...]) -> str:
    """Return a selection as it is written on the command line."""
    names = {stream: name for name, stream in NAMES.items()}
    return ",".join(names[stream] for stream in chosen) or "strokes only"


def table(scene: Scene, sensors: list[Stream]) -> tuple[dict[str, Any], list[str]]:
    """Return the accuracy at every posture, as values for ``--json`` and as lines."""
    values: dict[str, Any] = {}
    acting = "an unknown load of 0.25 % of the boom's weight comes and goes at the tip"
    lines = ["", f"Accuracy of the estimate at rest, while {acting} (standard deviations)"]
    titles = f"{'tip x, y mm':>16} {'pitch mrad':>11} {'acceleration':>13} {'load N':>14}"
    lines.append(f"  {'posture':12} {'sensors beside strokes':24} {titles}")
    for posture in scene.postures:
        for chosen in sets_of(sensors):
            try:
                found = accuracy_at(scene, strokes_of_posture(scene, posture), chosen)
            except BoomTwinError as error:
                lines.append(f"  {posture:12} {words(chosen):24} {error}")
                continue
            values[f"accuracy_{posture}:{words(chosen)}"] = [
                *found.tip.tolist(),
                *found.acceleration.tolist(),
                *found.load.tolist(),
            ]
            lines.append(f"  {posture:12} {words(chosen):24} {_row(found)}")
    return values, lines


def _row(found: TipAccuracy) -> str:
    x, y, pitch = 1e3 * found.tip
    acceleration = float((found.acceleration**2).sum() ** 0.5)
    load = f"{found.load[0]:.0f}, {found.load[1]:.0f}"
    return f"{f'{x:.2f}, {y:.2f}':>16} {pitch:11.2f} {acceleration:7.3f} m/s² {load:>14}"
