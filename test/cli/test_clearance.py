"""Commands on scenes with play in their pins."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command import main
from default_boom import strokes_of_posture

from boom_twin import load_scene


@pytest.fixture
def scene_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    assert main(["scene", "--clearance"]) == 0
    path = tmp_path / "play.yaml"
    path.write_text(capsys.readouterr().out)
    return path


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    strokes = strokes_of_posture(load_scene(), "arch")
    rows = np.column_stack([np.linspace(0.0, 0.05, 6), np.tile(strokes, (6, 1))])
    path = tmp_path / "drive.csv"
    np.savetxt(path, rows, delimiter=",", header="t_s," + ",".join(f"stroke_{i + 1}_m" for i in range(4)), comments="")
    return path


def test_simulate_tells_lost_contacts(
    scene_file: Path, drive: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out.csv"
    given = ["simulate", str(scene_file), "--posture", "arch", "--drive", str(drive), "--out", str(out)]
    assert main(given) == 0
    told = capsys.readouterr().out.splitlines()
    assert told[4:] == [*(f"cylinder_{i}.rod: contact lost 0 times" for i in range(1, 5)), str(out)]
    header, *rows = out.read_text().splitlines()
    names = [f"cylinder_{i}_rod_{what}" for i in range(1, 5) for what in ("dx_m", "dy_m", "force_N", "contact")]
    assert header.split(",")[-20:] == [*names, *(f"length_{i}_m" for i in range(1, 5))] and len(rows) == 6
    still = dict(zip(header.split(","), map(float, rows[-1].split(",")), strict=True))
    assert still["cylinder_1_rod_contact"] == 1.0
    assert np.hypot(still["cylinder_1_rod_dx_m"], still["cylinder_1_rod_dy_m"]) > 1e-4
