"""Which modules a command imports: start-up time is made of that, and modules can be counted without a clock."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

SLOW = (
    "numba", "numba.np.arrayobj", "llvmlite", "scipy", "scipy.linalg", "matplotlib", "jinja2", "rosbags", "sqlite3",
    "exudyn", "rclpy",
)  # fmt: skip
BAG = Path(__file__).parents[2] / "bags" / "arch_session"
PROGRAM = """
import contextlib, io, json, sys
from boom_twin.cli.main import main
with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
    try:
        code = main(json.loads(sys.argv[1]))
    except SystemExit as end:
        code = end.code
print(json.dumps([code, sorted(sys.modules)]))
"""


def imported_by(*arguments: str) -> tuple[int, set[str]]:
    """Exit code of a command in a fresh process, and those of the slow modules that it has imported."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, json.dumps(arguments)], capture_output=True, text=True, check=True, timeout=300
    )
    code, modules = json.loads(done.stdout)
    return code, {*SLOW} & set(modules)


@pytest.mark.parametrize("arguments", [["check"], ["check", "--json"], ["scene"], ["urdf"], ["--help"], ["statics", "--help"]])
def test_what_does_not_step_needs_no_compiler(arguments: list[str]) -> None:
    assert imported_by(*arguments) == (0, set())


def test_compiled_kernels_and_a_replay_import_what_they_need(tmp_path: Path) -> None:
    """Compiled kernels are loaded without numba's own functions; a replay of a .mcap has no other storage and no report."""
    for _ in range(2):  # the first one may compile
        statics = imported_by("statics", "--posture", "arch")
    assert statics == (0, {"numba", "llvmlite", "scipy"})  # numba looks for scipy
    replay = ["replay", str(BAG), "--duration", "1", "--no-pictures", "--out"]
    for each in "ab":
        found = imported_by(*replay, str(tmp_path / each))
    assert found == (0, {"numba", "llvmlite", "scipy", "rosbags"})
