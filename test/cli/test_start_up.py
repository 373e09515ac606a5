"""Which modules a command imports: start-up time is made of that, and modules can be counted without a clock."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

SLOW = ("numba", "llvmlite", "scipy", "scipy.linalg", "matplotlib", "rosbags", "exudyn", "rclpy")
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
