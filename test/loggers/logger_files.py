"""The bundled session as loggers would have written it, in files of several styles."""

from __future__ import annotations

from datetime import datetime, timedelta
from functools import cache
from pathlib import Path
from zoneinfo import ZoneInfo

import numpy as np
from session_readings import arrays_in

from boom_twin.sensor_kinds import G
from boom_twin.types import SECOND

SESSION = Path(__file__).parents[2] / "bags" / "arch_session"
BERLIN = ZoneInfo("Europe/Berlin")
Readings = dict[str, tuple[np.ndarray, np.ndarray]]


@cache
def readings(seconds: float) -> Readings:
    """Stamps (ns) and values (rows, channels) in SI units of each topic, from the start of the bundled session."""
    return {stream.value: own for stream, own in arrays_in(SESSION, seconds).items()}


def german(stamp: int) -> str:
    """Local date and time in Berlin to the microsecond, with a decimal comma."""
    local = datetime.fromtimestamp(stamp // SECOND, BERLIN) + timedelta(microseconds=stamp % SECOND // 1000)
    return f"{local:%d.%m.%Y %H:%M:%S},{local.microsecond:06d}"


def lines(stamps: np.ndarray, values: np.ndarray) -> list[str]:
    """Rows of text, an empty cell for NaN."""
    cells = [["" if value != value else f"{value:.9f}".replace(".", ",") for value in row] for row in values.tolist()]
    return [";".join([german(stamp), *row]) for stamp, row in zip(stamps.tolist(), cells, strict=True)]


def three_german_files(folder: Path, seconds: float = 20.0) -> tuple[list[Path], Readings]:
    """Cylinders at 100 Hz, angles at 50 Hz, IMU at 200 Hz, with gaps; and their content in SI units, stamps in us."""
    found = {}
    for name, every in (("cylinder_strokes", 2), ("joint_angles", 4), ("tip_imu", 1)):
        stamps, values = (array[::every] for array in readings(seconds)[name])
        found[name] = (stamps // 1000 * 1000, values.copy())
    found["joint_angles"][1][100:120, 1] = np.nan
    stamps, values = found["tip_imu"]
    found["tip_imu"] = np.delete(stamps, slice(700, 900)), np.delete(values, slice(700, 900), axis=0)
    (stamps, strokes), (angle_stamps, angles), (imu_stamps, imu) = found.values()
    head = "Zeit;" + ";".join(f"Zylinder {i} [mm]" for i in range(1, 5))
    extra = np.column_stack([1e3 * strokes, np.linspace(20.0, 30.0, len(strokes))])
    zylinder = ["Messung Mast 4", "Bediener: Müller", "", head + ";Öltemperatur [°C]", *lines(stamps, extra)]
    names = "Zeit;" + ";".join(f"Gelenkwinkel {i} (°)" for i in range(1, 5))
    winkel = [names, *lines(angle_stamps, np.degrees(angles))]
    beschl = ["Zeit;Beschl. X in g;Beschl. Z in g", *lines(imu_stamps, imu / G)]
    files = [folder / "zylinder.csv", folder / "winkel.csv", folder / "beschleunigung.csv"]
    for file, text, encoding in zip(files, (zylinder, winkel, beschl), ("cp1252", "utf-8-sig", "utf-16"), strict=True):
        file.write_bytes("\r\n".join([*text, ""]).encode(encoding))
    return files, found
