"""Two replays with everything: 24 s of the bundled session as they are, and with an encoder that is wrong from 12 s on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from drive_twin import ARCH_DRIVES, note_drives
from made_once import MadeOnce

from boom_twin import Stream
from boom_twin.bag.reader import read, scan
from boom_twin.bag.session_files import write_session
from boom_twin.cli.main import main
from boom_twin.messages.sample_decoder import SampleDecoder, stamp_of
from boom_twin.messages.topic_table import load_topics

SECONDS, WRONG_FROM, WRONG_BY = 24.0, 12.0, 0.0035

RECORDED = (Stream.STROKES, Stream.ANGLES, Stream.IMU)


def samples() -> dict[Stream, tuple[np.ndarray, np.ndarray]]:
    """Stamps (k,) and values of every stream, up to `SECONDS`; all streams have the same stamps."""
    inputs, intake = load_topics().inputs, SampleDecoder(4)
    roles = {inputs[stream].name: stream for stream in RECORDED}
    found: dict[Stream, list] = {stream: [] for stream in RECORDED}
    for name, _, message in read(scan(ARCH_DRIVES), {inputs[stream].name: inputs[stream].type for stream in RECORDED}):
        sample = intake.put(roles[name], stamp_of(message), message)
        found[sample.stream].append(sample)
        if sample.stamp - found[Stream.STROKES][0].stamp > SECONDS * 1e9:
            break
    count = min(map(len, found.values()))
    return {
        stream: (np.array([each.stamp for each in rows[:count]]), np.array([each.values for each in rows[:count]]))
        for stream, rows in found.items()
    }


def write_sessions(folder: Path) -> None:
    """``healthy`` and ``faulty`` into a folder."""
    found = samples()
    (stamps, strokes), (_, joints), (_, imu) = (found[stream] for stream in RECORDED)
    notes = {"origin": "synthetic session <of a test> & more"}
    write_session(folder / "healthy", stamps, strokes, joints, imu, notes)
    wrong = joints + WRONG_BY * np.array([0.0, 0.0, 1.0, 0.0]) * (stamps - stamps[0] > WRONG_FROM * 1e9)[:, None]
    write_session(folder / "faulty", stamps, strokes, wrong, imu, notes)
    for name in ("healthy", "faulty"):
        note_drives(folder / name)


@pytest.fixture(scope="session")
def sessions(made_once: MadeOnce, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Healthy, and faulty."""
    folder = made_once.folder("report_sessions", write_sessions, tmp_path_factory.mktemp("sessions"))
    return folder / "healthy", folder / "faulty"


@pytest.fixture(scope="session")
def replays(sessions: tuple[Path, Path], made_once: MadeOnce, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Of both, with report."""

    def make(folder: Path) -> None:
        for session in sessions:
            assert main(["replay", str(session), "--out", str(folder / session.name), "--report", "--fatigue", "80"]) == 0

    folder = made_once.folder("report_replays", make, tmp_path_factory.mktemp("replays"))
    return folder / "healthy", folder / "faulty"
