"""A node that gets too much, or from two sources, answers, tells so, and goes on."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")

from rcl_interfaces.srv import GetParameters

LIVE = Path(__file__).parents[1] / "bench" / "live.py"
SECONDS = 5.0
PROMPT = 2.0
"""Seconds of the node for an answer; before messages were queued here, it took 4 to 12."""
ERROR = b"\x02"
FEW = ["-p", "raise_after:=0.0"]


@pytest.fixture
def send() -> Iterator[Callable[..., None]]:
    """Starts sources of strokes and angles, each with its rate and more words; back when all send, until the test is over."""
    with ExitStack() as stack:

        def start(*sources: list[str]) -> None:
            processes = []
            for words in sources:
                command = [sys.executable, str(LIVE), "source", *words]
                processes.append(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
                stack.callback(processes[-1].wait)
                stack.callback(processes[-1].kill)
            for process in processes:
                assert process.stdout is not None and "sending" in process.stdout.readline()

        yield start


@pytest.fixture
def active(spawn_node: Callable[..., Any], bench: Any) -> Iterator[Any]:
    """An active node that tells every level at once; the bench does not publish."""
    bench.node.destroy_publisher(bench.strokes)
    bench.node.destroy_publisher(bench.imu)
    made = spawn_node(*FEW)
    made.wait_for("active;")
    yield made
    made.close()


def answered(active: Any, ask: Callable[[], Any]) -> float:
    """Seconds that an answer took, of the clock or of the node's processor time, whichever is less.

    A node that waits for a core while the flood's senders have them is not slow.
    """
    before, worked = time.monotonic(), active.processor_s()
    assert ask()
    return min(time.monotonic() - before, float(active.processor_s() - worked))


def asked(active: Any, bench: Any, remote: Any) -> list[float]:
    """Seconds that answers took; the bench listens meanwhile."""
    bench.diagnostics.clear()
    delays, began = [], time.monotonic()
    while time.monotonic() < began + SECONDS:
        for ask in (remote.state, lambda: remote.call(GetParameters, "get_parameters", GetParameters.Request(names=["gap"]))):
            delays.append(answered(active, ask))
        heard = time.monotonic() + 0.2
        bench.until(lambda end=heard: time.monotonic() > end)
    return delays


def told(bench: Any, name: str) -> Any:
    """All that was said of a component."""
    found = [status for msg in bench.diagnostics for status in msg.status if status.name == f"boom_twin: {name}"]
    assert found
    return found


def test_two_sources(active: Any, bench: Any, remote: Any, send: Callable[..., None]) -> None:
    """With clocks that are 1000 s apart."""
    send(["200", "600"], ["200", "600", "later=1000"])
    delays = asked(active, bench, remote)
    assert len(delays) > 8 and max(delays) < PROMPT
    acknowledged = answered(active, lambda: remote.trigger("acknowledge").success)  # once the samples before it are read
    assert acknowledged < 2 * PROMPT
    assert len(bench.diagnostics) >= 3
    first = bench.diagnostics[-1].status[0]
    assert (first.name, first.level) == ("boom_twin: publishers", ERROR)
    assert "2 publishers of /cylinder_strokes: /source, /source" in first.message and "whose stamps go on" in first.message
    assert len({pair.value for pair in first.values if pair.key == "/cylinder_strokes gids"}.pop().split(", ")) == 2
    assert re.search(r"publishers: 2 publishers of /\w+: ", active.said())  # of the input that was looked up first
    lines = active.said().splitlines()
    assert len(lines) < 60, active.said()  # nothing is logged for each sample
    assert active.stop() == 0


def test_a_flood(active: Any, bench: Any, remote: Any, send: Callable[..., None]) -> None:
    """As fast as a source can send; a free machine keeps up with 5 kHz."""
    send(["20000", "6"])
    predicted = len(bench.answers)
    delays = asked(active, bench, remote)
    assert sorted(delays)[len(delays) // 2] < PROMPT and sorted(delays)[-2] < 2 * PROMPT  # one may wait for a busy machine
    assert len(bench.diagnostics) >= 3
    assert len(bench.answers) > predicted + 20  # predictions go on
    worst = max(told(bench, "reception"), key=lambda status: status.level)
    assert worst.level >= b"\x01"
    values = {pair.key: pair.value for pair in worst.values}
    assert int(values["cylinder_strokes dropped"]) + int(values["cylinder_strokes lost"]) > 0, values
    shed = [pair.value for status in told(bench, "reception") for pair in status.values if pair.key == "shapes left_out"]
    assert sum(map(int, shed)) > 0  # and they are told
    bench.until(lambda: told(bench, "reception")[-1].level == b"\x00")
    assert active.stop() == 0
    assert active.ended_after < 4.0
    assert len(active.said().splitlines()) < 60, active.said()
