"""The live page that the node starts: it comes and goes with the node, and its death changes nothing there."""

from __future__ import annotations

import os
import re
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import pytest

pytest.importorskip("rclpy")
pytest.importorskip("aiohttp")

from sensor_msgs.msg import JointState

import boom_twin

LISTENING = "open http"


def children(process: Any) -> list[int]:
    return [int(pid) for pid in Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()]


def is_gone(pid: int) -> bool:
    try:
        return " Z " in Path(f"/proc/{pid}/stat").read_text()
    except FileNotFoundError:
        return True


def until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + 20.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)


def feed(bench: Any, motion: dict[str, Any], rows: range) -> None:
    """Send strokes, and wait for all their answers."""
    for row in rows:
        message = JointState(name=[f"cylinder_{i + 1}" for i in range(4)], position=motion["strokes"][row].tolist())
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(int(motion["stamps_ns"][row]), 10**9)
        bench.strokes.publish(message)
        bench.until(lambda: bool(bench.answers) and bench.answers[-1] == motion["stamps_ns"][row])  # noqa: B023


@pytest.fixture
def watched(spawn_node: Callable[..., Any]) -> Any:
    """An active node with its page, which listens."""
    node = spawn_node("-p", "monitor:=true")
    node.wait_for("active;")
    node.wait_for(LISTENING)
    yield node
    node.close()


def test_a_killed_page_changes_nothing_at_the_node(watched: Any, bench: Any, motion: dict[str, Any]) -> None:
    url = re.search(r"open (http\S+)", watched.said())[1]
    assert b"boom twin" in urlopen(url).read()
    (page,) = children(watched)
    bench.until_matched()
    feed(bench, motion, range(50))
    os.kill(page, signal.SIGKILL)
    feed(bench, motion, range(50, 400))
    watched.wait_for("the monitor ended with -9")
    feed(bench, motion, range(400, 500))
    assert len(bench.answers) == len(set(bench.answers)) == 500
    time.sleep(2.5)
    assert watched.said().count("the monitor ended") == 1 and watched.stop() == 0


def test_the_page_ends_with_the_node(watched: Any) -> None:
    (page,) = children(watched)
    assert watched.stop() == 0 and is_gone(page)


def test_the_page_ends_even_if_the_node_is_killed(watched: Any) -> None:
    (page,) = children(watched)
    watched.stop(signal.SIGKILL)
    until(lambda: is_gone(page))


def test_the_page_comes_and_goes_with_the_configuration(watched: Any, remote: Any) -> None:
    from lifecycle_msgs.msg import Transition

    (page,) = children(watched)
    assert remote.change(Transition.TRANSITION_DEACTIVATE) and not is_gone(page)
    assert remote.change(Transition.TRANSITION_CLEANUP)
    until(lambda: is_gone(page))
    assert remote.set("monitor", False).successful and remote.change(Transition.TRANSITION_CONFIGURE)
    assert not children(watched)


def test_the_page_hears_a_node_under_other_names(spawn_node: Callable[..., Any], motion: dict[str, Any]) -> None:
    scene = str(Path(boom_twin.__file__).parent / "msg_config" / "scene.yaml")
    node = spawn_node("-p", "monitor:=true", "-p", f"scene:={scene}", "-r", "__ns:=/crane", "-r", "tip_imu:=/rig/imu")
    node.wait_for(LISTENING)
    (page,) = children(node)
    arguments = Path(f"/proc/{page}/cmdline").read_text().split("\0")
    assert "__ns:=/crane" in arguments and "/crane/tip_imu:=/rig/imu" in arguments, arguments
    assert arguments[arguments.index("--scene") + 1] == scene  # it opens none that a message names
    assert not any("/diagnostics" in each for each in arguments)
    node.close()
