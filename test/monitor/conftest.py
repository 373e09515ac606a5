"""A session with faults in it, what a replay says of it, and the live page as a process."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from drive_twin import ARCH_DRIVES, note_drives
from made_once import MadeOnce
from recordings import write_session
from session_readings import rows_in

from boom_twin import Settings, load_scene, replay
from boom_twin.monitor.data.bag_feed import BagFeed, bag_feed
from boom_twin.monitor.data.feed import Feed

SECONDS, WRONG_FROM, GAP = 40.0, 15.0, (30.0, 30.6)
OFFSET = 0.02  # rad, by which joint 3's encoder is wrong from WRONG_FROM on


@pytest.fixture(scope="session")
def faulty(made_once: MadeOnce, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the bundled session's first 40 s; an encoder jumps at 15 s, everything is silent from 30 to 30.6 s."""
    return made_once.folder("faulty_session", spoil, tmp_path_factory.mktemp("faulty") / "faulty_session")


def spoil(path: Path) -> None:
    """Write that session."""
    stamps_ns, strokes, joints, imu = rows_in(ARCH_DRIVES)
    time = (stamps_ns - stamps_ns[0]) * 1e-9
    kept = (time < SECONDS) & ((time < GAP[0]) | (time > GAP[1]))
    joints[time >= WRONG_FROM, 2] += OFFSET
    arrays = strokes[kept], joints[kept], imu[kept]
    write_session(path, stamps_ns[kept], *arrays, {"origin": "synthetic, encoder 3 made wrong"})
    note_drives(path)


@pytest.fixture(scope="session")
def feed(faulty: Path, made_once: MadeOnce) -> Feed:
    return made_once.value("faulty_feed", lambda: read_all(bag_feed(faulty, load_scene(), Settings())))


def read_all(feed: BagFeed) -> BagFeed:
    feed.poll()
    while feed.is_reading:
        feed.poll()
    return feed


@pytest.fixture(scope="session")
def replayed(faulty: Path, made_once: MadeOnce, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of its replay, with ``summary.json`` and ``bag/``."""
    to = tmp_path_factory.mktemp("replayed")
    return made_once.folder("faulty_replayed", lambda folder: replay(faulty, load_scene(), folder), to)


class MonitorProcess:
    """``boom_twin monitor`` as a process; its log goes to a file."""

    def __init__(self, log: Path, *arguments: str) -> None:
        self._log, command = log, [sys.executable, "-m", "boom_twin.cli.main", "monitor", "--port", "0", *arguments]
        with log.open("w") as file:
            self.process = subprocess.Popen(command, stderr=file)
        end = time.monotonic() + 240.0
        while (found := re.search(r"open (http\S+)", self.said())) is None:
            assert self.process.poll() is None and time.monotonic() < end, self.said()
            time.sleep(0.1)
        self.url, parts = found[1], urlsplit(found[1])
        self.host, self.address = parts.netloc, (parts.hostname or "", parts.port or 0)

    def said(self) -> str:
        return self._log.read_text()

    def stop(self) -> int:
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(60.0)


@contextmanager
def monitoring(log: Path, *arguments: str) -> Iterator[MonitorProcess]:
    """Provide the page within a context."""
    process = MonitorProcess(log, *arguments)
    try:
        yield process
    finally:
        process.process.kill()
        process.process.wait()
