"""The demonstration as a process of three."""

from __future__ import annotations

import re
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import pytest

pytest.importorskip("rclpy")


from recordings import scan

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


def test_the_live_demonstration_shows_its_page_and_ends_in_order(spawn: Callable[..., Any], bag: Path, tmp_path: Path) -> None:
    demo = spawn("demo.demo_live", "--bag", str(bag), "--port", "0", "--out", str(tmp_path))
    url = demo.wait_for("in a browser").split("open ")[1].split()[0]
    assert b"boom twin" in urlopen(url).read()
    children = demo.children
    assert demo.stop(signal.SIGINT) == 0, demo.said()
    assert len(children) == 3 and not any(Path(f"/proc/{pid}").exists() for pid in children)
    assert "Traceback" not in demo.said() and scan(tmp_path / "recorded").topics
