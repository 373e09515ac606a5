"""The demonstration as a process of three."""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import numpy as np
import pytest

pytest.importorskip("rclpy")

from demo.processes import DemoProcesses

from boom_twin.bag.reader import scan
from boom_twin.bag.session_files import write_session
from boom_twin.errors import BoomTwinError
from boom_twin.scene.load import default_text

PUMP = Path(__file__).parents[2] / "bags" / "pump_session"

pytestmark = pytest.mark.usefixtures("demo_path")


def test_a_short_demonstration(spawn: Callable[..., Any], tmp_path: Path) -> None:
    """Of the session that has every sensor."""
    demo = spawn("demo.demo", "--bag", str(PUMP), "--duration", "2", "--out", str(tmp_path / "out"))
    assert demo.end() == 0, demo.said()
    rows = dict(line.split("  ", 1) for line in demo.said().splitlines() if "  " in line)
    position, acceleration = re.findall(r"[\d.]+(?= mm| m/s)", rows["tip error, prediction"])
    place, motion = re.findall(r"[\d.]+(?= mm| m/s)", rows["tip error, estimate"])
    assert float(place) <= float(position) and float(motion) < float(acceleration)
    assert 0.0 < float(position) < 5.0 and 0.0 < float(acceleration) < 1.0
    assert " N rms" in rows["residual cylinder_force_4"] and " mrad rms" in rows["residual joint_1"]
    sent, arrived = int(rows["stroke samples sent"]), int(rows["predictions received"])
    assert 0.98 * sent < arrived <= sent == pytest.approx(400, abs=1)
    assert (tmp_path / "out" / "replay" / "tip.png").stat().st_size > 10_000
    assert (tmp_path / "out" / "recorded" / "metadata.yaml").is_file()


def test_no_output_is_a_failure(spawn: Callable[..., Any], motion: dict[str, Any], tmp_path: Path) -> None:
    """Strokes that no cylinder has give no prediction."""
    far = {**motion, "strokes": np.full_like(motion["strokes"], 50.0)}
    write_session(tmp_path / "far", **far, description={})
    demo = spawn("demo.demo", "--bag", str(tmp_path / "far"), "--duration", "1", "--out", str(tmp_path / "out"))
    assert demo.end() == 1
    assert "the node published no prediction" in demo.said() and "Traceback" not in demo.said()


def test_no_session_is_a_failure(spawn: Callable[..., Any], tmp_path: Path) -> None:
    demo = spawn("demo.demo", "--bag", str(tmp_path / "absent"), "--out", str(tmp_path / "out"))
    assert demo.end() == 1
    assert "absent" in demo.said() and "Traceback" not in demo.said()


def test_the_live_demonstration_shows_its_page_and_ends_in_order(spawn: Callable[..., Any], bag: Path, tmp_path: Path) -> None:
    demo = spawn("demo.demo_live", "--bag", str(bag), "--port", "0", "--out", str(tmp_path))
    demo.wait_for("in a browser")
    url = demo.said().split("open ")[1].split()[0]
    assert b"boom twin" in urlopen(url).read()
    children = Path(f"/proc/{demo.pid}/task/{demo.pid}/children").read_text().split()
    assert demo.stop(signal.SIGINT) == 0, demo.said()
    assert len(children) == 3 and not any(Path(f"/proc/{pid}").exists() for pid in children)
    assert "Traceback" not in demo.said()
    assert scan(tmp_path / "recorded").topics


def test_a_child_that_dies_ends_the_live_demonstration_at_once(spawn: Callable[..., Any], bag: Path, tmp_path: Path) -> None:
    demo = spawn("demo.demo_live", "--bag", str(bag), "--port", "0", "--out", str(tmp_path))
    demo.wait_for("in a browser")
    children = Path(f"/proc/{demo.pid}/task/{demo.pid}/children").read_text().split()
    monitor = next(int(pid) for pid in children if "monitor" in Path(f"/proc/{pid}/cmdline").read_text().split("\0"))
    os.kill(monitor, signal.SIGKILL)
    assert demo.end(60.0) == 1 and demo.ended_after < 15.0  # the recorder completes its files
    assert "monitor ended with -9" in demo.said()


def test_nothing_of_earlier_demonstrations_is_written_over(tmp_path: Path) -> None:
    """Nor what somebody else put there."""
    (tmp_path / "recorded").mkdir()
    (tmp_path / "recorded" / "session_0.mcap").write_bytes(b"a recording")
    (tmp_path / "recorded_2").mkdir()
    (tmp_path / "recorded_3.node.log").symlink_to(tmp_path / "recorded" / "session_0.mcap")
    for name in ("scene.yaml", "node.log", "recorder.log"):
        (tmp_path / name).write_text("mine")
    with open(os.devnull) as lock:
        running = DemoProcesses(tmp_path, default_text(), lock.fileno())
        running.begin("a test")
        running.end()
    assert running.recorded == tmp_path / "recorded_4"
    assert (tmp_path / "recorded" / "session_0.mcap").read_bytes() == b"a recording"
    assert {(tmp_path / name).read_text() for name in ("scene.yaml", "node.log", "recorder.log")} == {"mine"}
    assert (tmp_path / "recorded_4.scene.yaml").read_text() == default_text()


def test_the_second_of_two_that_start_at_once_is_told_so(tmp_path: Path) -> None:
    with open(os.devnull) as lock:
        first, second = (DemoProcesses(tmp_path, default_text(), lock.fileno()) for _ in range(2))
        first.begin("a test")
        try:
            with pytest.raises(BoomTwinError, match=r"recorded\.scene\.yaml: cannot be written \(File exists\)"):
                second.begin("a test")
        finally:
            first.end()


def test_a_duration_that_is_no_number_is_refused(spawn: Callable[..., Any], tmp_path: Path) -> None:
    demo = spawn("demo.demo", "--duration", "nan", "--out", str(tmp_path))
    assert demo.end() == 2
    assert "must be > 0 and finite" in demo.said() and "Traceback" not in demo.said()
