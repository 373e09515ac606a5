"""What the node cannot start with is refused in one line, with its name and a remedy."""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest
from default_boom import default_text

from boom_twin.ros.node.main import main

HAS_ROS = pytest.mark.skipif(find_spec("rclpy") is None, reason="rclpy is not installed")
WITHOUT = """
import sys
sys.modules["rclpy"] = None
import boom_twin.ros.node.main, boom_twin.cli.main, boom_twin.offline.replay
codes = [boom_twin.ros.node.main.main([])]
codes += [boom_twin.cli.main.main([*words, "never"]) for words in (["record", "--out"], ["play"])]
sys.exit(codes != [1, 1, 1])
"""


def test_without_rclpy_all_else_works_and_what_needs_it_says_so() -> None:
    done = subprocess.run([sys.executable, "-c", WITHOUT], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "Traceback" not in done.stderr, done.stderr
    assert done.stderr.count('pip install "boom_twin[ros]"') == len(done.stderr.splitlines()) == 3


@pytest.fixture
def quiet_signals() -> Iterator[None]:
    """What signals do is as before after the test, and nodes that were refused are gone: other tests count them."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    yield
    gc.collect()
    signal.set_wakeup_fd(-1)
    for number, act in before.items():
        signal.signal(number, act)


CASES = [
    (["-p", "payload:=40.0"], "-p payload:=40.0: unknown. Parameters and remappings follow --ros-args"),
    (["--ros-args", "-p", "look_step:=0.03"], "look_step: unknown. The nearest is"),
    (["--ros-args", "--params-file", "/nowhere.yaml"], "/nowhere.yaml"),
    (["--ros-args", "-p", "strok_rate:=0.4"], "strok_rate: unknown. The nearest is `stroke_rate`"),
    (["--ros-args", "-p", "frame_prefix:=/front/"], "names of frames have no leading slash (tf2). Give 'front/'"),
    (["--ros-args", "-p", "scene:=scene.yaml"], "sections[0].rho_B = 52.0: unknown key"),
    (["--ros-args", "-p", "mapping:=mapping.yaml"], "sensors.cylinder_1.unit = 'furlong'"),
    (["--ros-args", "--params-file", "escapes.yaml"], r"sc\x1b[2Jene.yaml"),
]


@pytest.fixture
def callers_thread() -> Iterator[None]:
    """A daemon thread of the caller, for which the process must not be ended."""
    over = threading.Event()
    threading.Thread(target=over.wait, daemon=True).start()
    yield
    over.set()


@HAS_ROS
@pytest.mark.usefixtures("isolation", "quiet_signals", "callers_thread")
@pytest.mark.parametrize(("arguments", "words"), CASES, ids=[words[:20] for _, words in CASES])
def test_a_bad_argument_is_told_by_its_name(
    arguments: list[str], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scene.yaml").write_text(default_text().replace("rho_A:", "rho_B:"))
    Path("mapping.yaml").write_text("sensors: {cylinder_1: {unit: furlong}}\n")
    Path("escapes.yaml").write_text('/**: {ros__parameters: {scene: "sc\\e[2Jene.yaml"}}\n')
    try:
        code = main(arguments)
    except SystemExit as end:
        code = int(end.code or 0)
    told = "".join(capfd.readouterr())
    assert code == (2 if "unknown. Parameters" in words else 1)
    assert words in told and "Traceback" not in told and "\x1b[2J" not in told


@HAS_ROS
@pytest.mark.parametrize(
    ("environment", "told"),
    [
        ({"RMW_IMPLEMENTATION": "rmw_none"}, "=rmw_none: rclpy cannot load this middleware. Install its package,"),
        ({"ROS_DOMAIN_ID": "one"}, "ROS_DOMAIN_ID is not an integral number. Check the environment variables ROS_*."),
    ],
)
def test_an_environment_that_ros_cannot_use_is_told_with_its_reason(environment: dict[str, str | None], told: str) -> None:
    given = {name: text for name, text in os.environ.items() if name != "ROS_LOG_DIR"} | environment
    own = {name: text for name, text in given.items() if text is not None}
    command = [sys.executable, "-m", "boom_twin.ros.node.main"]
    done = subprocess.run(command, env=own, capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "Traceback" not in done.stderr
    assert told in done.stderr.splitlines()[-1]
