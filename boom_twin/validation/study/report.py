"""Writer of a study's report: tables, files, machine and versions."""

from __future__ import annotations

import math
import platform
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from ...system.files import write_atomic
from ...system.processes import usable_cores
from ...system.result_text import json_text

PACKAGES = ("numpy", "scipy", "numba", "exudyn", "boom_twin")


def machine() -> dict[str, str | int | None]:
    """Return date (UTC), CPU model, usable cores and versions. The version of a missing package is None."""
    versions = {package: _version(package) for package in PACKAGES}
    return {
        "date": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "cpu": _cpu(),
        "cores": usable_cores(),
        "python": platform.python_version(),
        **versions,
    }


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _cpu() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


SYNTHETIC = "Scene parameters are surrogates; nothing here was measured on a rig."


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a Markdown table with a final newline. Floats have 3 digits or no decimals. None and NaN are dashes."""
    lines = [f"| {' | '.join(line)} |\n" for line in (head, *([_text(value) for value in row] for row in rows))]
    return "".join((lines[0], f"|{'---|' * len(head)}\n", *lines[1:]))


def page(parts: Iterable[str]) -> str:
    """Return a Markdown page of the parts. Its last line gives date, machine and versions, and calls the data surrogates."""
    made = ", ".join(f"{name} {value}" for name, value in machine().items() if value is not None)
    return "\n\n".join(part.rstrip("\n") for part in (*parts, f"{made}. {SYNTHETIC}") if part) + "\n"


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write the numbers of a study and the machine as JSON; make the folder if it is missing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomic(path, json_text({"machine": machine(), **content}, indent=1) + "\n")


def _text(value: object) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "-"
    if isinstance(value, float):
        return f"{value:.0f}" if 1e3 <= abs(value) < 1e6 else f"{value:.3g}"
    return str(value).replace("|", "\\|")
