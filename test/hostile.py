"""A folder as an attacker would pack it: modules under the names that programs import, which leave a trace when they run."""

from __future__ import annotations

from pathlib import Path

NAMES = (
    *("boom_twin", "numpy", "mcap", "rosbags", "zstandard", "lz4", "ruamel", "pydantic", "numba", "scipy", "matplotlib"),
    *("aiohttp", "rclpy", "sensor_msgs", "diagnostic_msgs", "geometry_msgs", "rcl_interfaces", "lark", "yaml"),
    *("sitecustomize", "usercustomize", "runpy", "pickle", "struct", "typing", "argparse", "subprocess", "signal", "json"),
)


class Trap:
    """Hostile modules in a folder; `sprung` names those that ran."""

    def __init__(self, folder: Path, traces: Path) -> None:
        self._traces = traces
        folder.mkdir(parents=True, exist_ok=True)
        for name in NAMES:
            (folder / f"{name}.py").write_text(f"open({str(traces)!r}, 'a').write('{name} ')\nraise SystemExit('{name} ran')\n")

    def sprung(self) -> str:
        return self._traces.read_text() if self._traces.exists() else ""
