"""Without rclpy: everything else works, and what needs it says so."""

from __future__ import annotations

import subprocess
import sys

import pytest

BLOCK = "import sys; sys.modules['rclpy'] = None; sys.argv = ['x']; "


def _run(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", BLOCK + code], capture_output=True, text=True, check=False)


def test_the_package_never_imports_rclpy() -> None:
    done = _run("import boom_twin, boom_twin.twin.twin, boom_twin.offline.replay, boom_twin.cli.main, boom_twin.ros.node.main")
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    "call",
    [
        "from boom_twin.ros.node.main import main; sys.exit(main([]))",
        "from boom_twin.cli.main import main; sys.exit(main(['record', '--out', 'never']))",
        "from boom_twin.cli.main import main; sys.exit(main(['play', 'never']))",
    ],
)
def test_what_needs_ros_names_the_remedy(call: str) -> None:
    done = _run(call)
    assert done.returncode == 1
    assert 'pip install "boom_twin[ros]"' in done.stderr and "Traceback" not in done.stderr
