"""SIGKILLs at random moments over the commands that write; `test/bench/kills.py` does as many as are wanted."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from bench.kills import kills


@pytest.mark.parametrize(("command", "count", "needs"), [("replay", 6, "numpy"), ("record", 12, "rclpy")])
def test_kills(command: str, count: int, needs: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    pytest.importorskip(needs)
    if needs == "rclpy":
        request.getfixturevalue("isolation")
    seed = time.time_ns() % 10**6
    print(f"seed {seed}")
    assert kills(command, count, tmp_path, seed).total() == count
