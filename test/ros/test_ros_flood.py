"""A node that gets too much, or from two sources, or for long: it answers, tells so, and does not grow."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from pathlib import Path
from threading import Event
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("rclpy")

from ros_rig import Rig

from boom_twin.ros.node.main import _live

LIVE = Path(__file__).parents[1] / "bench" / "live.py"
FEW = 60
"""Lines in the log of a node that logs nothing for each sample."""


@contextmanager
def sources(*each: list[str]) -> Iterator[None]:
    """Sources of strokes and angles, each with its rate and more words; all send."""
    with ExitStack() as stack:
        for words in each:
            process = subprocess.Popen([sys.executable, str(LIVE), "source", *words], stdout=subprocess.PIPE, text=True)
            stack.callback(process.wait)
            stack.callback(process.kill)
            assert process.stdout is not None and "sending" in process.stdout.readline()
        yield


def test_python_code_of_another_thread_is_interrupted_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """While the node lives, no thread keeps the interpreter's lock for Python's usual 5 ms."""
    found, usual = list[float](), sys.getswitchinterval()

    def serve(_: Any) -> None:
        found.append(sys.getswitchinterval())
        node.finished = True

    node: Any = SimpleNamespace(autostart=False, finished=False, failed=False, queue=SimpleNamespace(serve=serve))
    monkeypatch.setattr("boom_twin.ros.receive.CallbackTurns", lambda *_: nullcontext())
    assert _live(node, Event()) == 0
    assert found[0] < 1e-4 < usual == sys.getswitchinterval()


def test_a_flood(spawn_node: Callable[..., Any], new_rig: Callable[..., Rig], remote: Any) -> None:
    node = spawn_node("-p", "raise_after:=0.0", "-p", "clear_after:=0.0")
    node.wait_for("active;")
    rig = new_rig()
    for publisher in rig.publishers.values():
        rig.node.destroy_publisher(publisher)
    rig.until(lambda: rig.level("reception") == 0)

    def are_told() -> bool:
        values = rig.values("reception")
        gone = [values.get(f"cylinder_strokes {word}", "") for word in ("dropped", "lost")]
        return rig.level("reception") > 0 and any(number not in ("", "0") for number in gone)

    answered = len(rig.answers)
    with sources(["20000", "6"]):  # seconds, as fast as it can send; a free machine keeps up with 5 kHz
        assert remote.state() == "active"
        rig.until(are_told)
        rig.until(lambda: len(rig.answers) > answered + 20)  # predictions go on
    rig.until(lambda: rig.level("reception") == 0)
    assert node.stop() == 0 and len(node.said().splitlines()) < FEW, node.said()
