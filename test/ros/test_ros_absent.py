"""Without rclpy, or what it needs: everything else works, and what needs it says so."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.util import find_spec

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


@pytest.mark.skipif(find_spec("rclpy") is None, reason="rclpy is not installed")
@pytest.mark.parametrize(
    ("environment", "told"),
    [
        (
            {"RMW_IMPLEMENTATION": "rmw_none"},
            "RMW_IMPLEMENTATION=rmw_none: rclpy cannot load this middleware. Install its package,",
        ),
        ({"HOME": None}, "Failed to get logging directory. Set HOME, or ROS_LOG_DIR, to a folder that can be written."),
        ({"ROS_LOG_DIR": "/proc/none"}, "'/proc/none': 2. Set HOME, or ROS_LOG_DIR, to a folder that can be written."),
        ({"ROS_DOMAIN_ID": "one"}, "ROS_DOMAIN_ID is not an integral number. Check the environment variables ROS_*."),
    ],
)
def test_an_environment_that_ros_cannot_use_is_told_with_its_reason(environment: dict[str, str | None], told: str) -> None:
    own = {name: text for name, text in (os.environ | environment).items() if text is not None and name != "ROS_LOG_DIR"}
    own |= {name: text for name, text in environment.items() if text is not None}
    command = [sys.executable, "-m", "boom_twin.ros.node.main"]
    done = subprocess.run(command, env=own, capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "Traceback" not in done.stderr
    assert told in done.stderr.splitlines()[-1]
