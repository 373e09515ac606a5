"""Which modules a command imports: start-up time is made of that, and modules can be counted without a clock."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

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


INTERRUPTED = """
import os, signal, sys
class Finder:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name == "boom_twin.ros.startup":
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Finder)
from boom_twin.cli.main import main
sys.exit(main(["record", "--out", sys.argv[1]]))
"""


def test_an_interruption_while_modules_are_imported_is_one_line(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED, str(tmp_path / "bag")], capture_output=True, text=True, check=False, timeout=300
    )
    assert done.returncode == 1 and done.stderr == "boom_twin: stopped\n"
    assert not (tmp_path / "bag").exists()
