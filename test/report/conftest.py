"""Two replays with everything: 24 s of the bundled session as they are, and with an encoder that is wrong from 12 s on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command import main
from drive_twin import ARCH_DRIVES, note_drives
from made_once import MadeOnce
from recordings import write_session
from session_readings import rows_in

SECONDS, WRONG_FROM, WRONG_BY = 24.0, 12.0, 0.0035


def write_sessions(folder: Path) -> None:
    """``healthy`` and ``faulty`` into a folder; all streams have the same stamps."""
    stamps, strokes, joints, imu = rows_in(ARCH_DRIVES, SECONDS)
    notes = {"origin": "synthetic session <of a test> & more"}
    write_session(folder / "healthy", stamps, strokes, joints, imu, notes)
    wrong = joints + WRONG_BY * np.array([0.0, 0.0, 1.0, 0.0]) * (stamps - stamps[0] > WRONG_FROM * 1e9)[:, None]
    write_session(folder / "faulty", stamps, strokes, wrong, imu, notes)
    for name in ("healthy", "faulty"):
        note_drives(folder / name)


@pytest.fixture(scope="session")
def sessions(made_once: MadeOnce, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = made_once.folder("report_sessions", write_sessions, tmp_path_factory.mktemp("sessions"))
    return folder / "healthy", folder / "faulty"


@pytest.fixture(scope="session")
def replays(sessions: tuple[Path, Path], made_once: MadeOnce, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    def make(folder: Path) -> None:
        for each in sessions:
            assert main(["replay", str(each), "--out", str(folder / each.name), "--report", "--fatigue", "80"]) == 0

    folder = made_once.folder("report_replays", make, tmp_path_factory.mktemp("replays"))
    return folder / "healthy", folder / "faulty"
