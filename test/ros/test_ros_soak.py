"""The node's memory stays where it is; `make soak` looks for longer."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("rclpy")

SOAK = Path(__file__).parents[1] / "bench" / "soak.py"


@pytest.mark.slow
def test_two_minutes_of_full_buffers_at_200_hz() -> None:
    done = subprocess.run([sys.executable, str(SOAK), "--duration", "460"], capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stdout + done.stderr
