"""What `simulate` says of a drive that is likely meant otherwise, before it simulates it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from boom_twin import load_scene
from boom_twin.cli.main import main
from boom_twin.cli.simulate import odd_in_drive
from boom_twin.scene.kinematics import strokes_of_posture

TIMES = np.arange(0.0, 2.0, 0.01)
STROKES = strokes_of_posture(load_scene(), "arch") + 0.01 * np.sin(np.pi * TIMES)[:, None]


def test_an_ordinary_drive_is_not_odd() -> None:
    assert odd_in_drive(TIMES, STROKES) == []
    assert odd_in_drive(TIMES[:1], STROKES[:1]) == [] == odd_in_drive(TIMES[::-1], STROKES)


def test_times_in_ms_and_jumps_are_told_with_their_place() -> None:
    (told,) = odd_in_drive(1000.0 * TIMES, STROKES)
    assert "t_s goes on by 10 s from row to row, 1990 s in all" in told and "divide them by 1000" in told
    jump = STROKES.copy()
    jump[100:, 2] += 0.2
    (told,) = odd_in_drive(TIMES, jump)
    assert told.startswith("line 102: stroke_3_m goes ") and "within 0.01 s, 20 m/s" in told


def test_simulate_says_it_first(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """And then follows the drive as it is."""
    drive, jump = tmp_path / "drive.csv", STROKES[:20].copy()
    jump[10:, 0] += 0.02
    rows = "\n".join(",".join(map(repr, row)) for row in np.column_stack([TIMES[:20], jump]).tolist())
    drive.write_text(f"t_s,stroke_1_m,stroke_2_m,stroke_3_m,stroke_4_m\n{rows}\n", encoding="utf-8")
    assert main(["simulate", "--drive", str(drive), "--out", str(tmp_path / "out.csv"), "--no-error-estimate"]) == 0
    assert f"warning: {drive}: line 12: stroke_1_m goes " in capsys.readouterr().err
