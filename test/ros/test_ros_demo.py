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
    (position, acceleration), (place, motion) = (
        map(float, re.findall(r"[\d.]+(?= mm| m/s)", rows[f"tip error, {source}"])) for source in ("prediction", "estimate")
    )
    assert place <= position < 5.0 and motion < acceleration < 1.0
    assert " N rms" in rows["residual cylinder_force_4"] and " mrad rms" in rows["residual joint_1"]
    sent, arrived = int(rows["stroke samples sent"]), int(rows["predictions received"])
    assert 0 < arrived <= sent == pytest.approx(400, abs=1)  # a busy machine loses some
    assert (tmp_path / "out" / "replay" / "tip.png").stat().st_size > 10_000
    assert (tmp_path / "out" / "recorded" / "metadata.yaml").is_file()


def test_no_output_is_a_failure(spawn: Callable[..., Any], motion: dict[str, Any], tmp_path: Path) -> None:
    """Strokes that no cylinder has give no prediction."""
    far = {**motion, "strokes": np.full_like(motion["strokes"], 50.0)}
    write_session(tmp_path / "far", **far, description={})
    demo = spawn("demo.demo", "--bag", str(tmp_path / "far"), "--duration", "1", "--out", str(tmp_path / "out"))
    absent = spawn("demo.demo", "--bag", str(tmp_path / "absent"), "--out", str(tmp_path / "other"))
    assert absent.end() == demo.end() == 1
    assert "the node published no prediction" in demo.said() and "Traceback" not in demo.said()
    assert "absent" in absent.said() and "Traceback" not in absent.said()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL], ids=["asked to end", "its monitor dies"])
def test_the_live_demonstration_shows_its_page_and_ends_in_order(
    spawn: Callable[..., Any], bag: Path, tmp_path: Path, number: signal.Signals
) -> None:
    demo = spawn("demo.demo_live", "--bag", str(bag), "--port", "0", "--out", str(tmp_path))
    url = demo.wait_for("in a browser").split("open ")[1].split()[0]
    assert b"boom twin" in urlopen(url).read()
    children = demo.children
    if number == signal.SIGINT:
        assert demo.stop(number) == 0, demo.said()
    else:
        os.kill(next(pid for pid in children if b"\0monitor\0" in Path(f"/proc/{pid}/cmdline").read_bytes()), number)
        assert demo.end() == 1 and "monitor ended with -9" in demo.said()
    assert len(children) == 3 and not any(Path(f"/proc/{pid}").exists() for pid in children)
    assert "Traceback" not in demo.said() and scan(tmp_path / "recorded").topics


def test_nothing_of_earlier_demonstrations_is_written_over(tmp_path: Path) -> None:
    """Nor what somebody else put there; the second of two that start at once is told so."""
    (tmp_path / "recorded").mkdir()
    (tmp_path / "recorded" / "session_0.mcap").write_bytes(b"a recording")
    (tmp_path / "recorded_2").mkdir()
    (tmp_path / "recorded_3.node.log").symlink_to(tmp_path / "recorded" / "session_0.mcap")
    for name in ("scene.yaml", "node.log", "recorder.log"):
        (tmp_path / name).write_text("mine")
    with open(os.devnull) as lock:
        running, second = (DemoProcesses(tmp_path, default_text(), lock.fileno()) for _ in range(2))
        running.begin("a test")
        try:
            with pytest.raises(BoomTwinError, match=r"recorded_4\.scene\.yaml: cannot be written \(File exists\)"):
                second.begin("a test")
        finally:
            running.end()
    assert running.recorded == tmp_path / "recorded_4"
    assert (tmp_path / "recorded" / "session_0.mcap").read_bytes() == b"a recording"
    assert {(tmp_path / name).read_text() for name in ("scene.yaml", "node.log", "recorder.log")} == {"mine"}
    assert (tmp_path / "recorded_4.scene.yaml").read_text() == default_text()
