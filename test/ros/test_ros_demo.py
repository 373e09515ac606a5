"""The demonstration as a process of three."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")

from boom_twin.io.session import write_session


def test_a_short_demonstration(spawn: Callable[..., Any], bag: Path, tmp_path: Path) -> None:
    demo = spawn("boom_twin.ros.demo", "--bag", str(bag), "--duration", "2", "--out", str(tmp_path / "out"))
    assert demo.end() == 0, demo.said()
    rows = dict(
        line.split("  ", 1) for line in demo.said().splitlines() if line.startswith(("stroke", "pred", "equal"))
    )
    sent, arrived = int(rows["stroke samples sent"]), int(rows["predictions received"])
    assert 0.98 * sent < arrived <= sent == pytest.approx(400, abs=1)
    assert (tmp_path / "out" / "tip.png").stat().st_size > 10_000
    assert (tmp_path / "out" / "recorded" / "metadata.yaml").is_file()


def test_no_output_is_a_failure(spawn: Callable[..., Any], motion: dict[str, Any], tmp_path: Path) -> None:
    """Strokes that no cylinder has give no prediction."""
    far = {**motion, "strokes": np.full_like(motion["strokes"], 50.0)}
    write_session(tmp_path / "far", **far, description={})
    demo = spawn(
        "boom_twin.ros.demo", "--bag", str(tmp_path / "far"), "--duration", "1", "--out", str(tmp_path / "out")
    )
    assert demo.end() == 1
    assert "the node published no prediction" in demo.said() and "Traceback" not in demo.said()


def test_no_session_is_a_failure(spawn: Callable[..., Any], tmp_path: Path) -> None:
    demo = spawn("boom_twin.ros.demo", "--bag", str(tmp_path / "absent"), "--out", str(tmp_path / "out"))
    assert demo.end() == 1
    assert "absent" in demo.said() and "Traceback" not in demo.said()
