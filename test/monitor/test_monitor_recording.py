"""A recorder that is started and stopped from the page."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from threading import Thread
from time import monotonic, sleep

import pytest
from eventually import eventually

from boom_twin.monitor import actions
from boom_twin.monitor.actions import RecorderProcess

SLOW_DISK = """
import signal, sys, time
from pathlib import Path
ended = []
signal.signal(signal.SIGINT, lambda *_: ended.append(1))
Path(sys.argv[1]).write_text("ready")
while not ended:
    time.sleep(0.02)
while not Path(sys.argv[2]).exists():
    time.sleep(0.02)
Path(sys.argv[2]).write_text("complete")
"""
"""A recorder whose disk takes as long as the test wants it to: it ends after SIGINT, once a file is there."""


@pytest.fixture
def slow_recorder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """Recorders are `SLOW_DISK`; calling it lets their disk be done."""
    ready, done = tmp_path / "ready", tmp_path / "done"
    command = (sys.executable, "-c", SLOW_DISK, str(ready), str(done))
    monkeypatch.setattr(actions, "python_command", lambda *_: command)
    return done.touch


def started(tmp_path: Path) -> RecorderProcess:
    """A recorder that runs, and notices signals."""
    recording = RecorderProcess(tmp_path / "bags")
    recording.start()
    until = monotonic() + 60.0
    while not (tmp_path / "ready").exists():
        assert monotonic() < until, "the recorder did not start"
        sleep(0.02)
    return recording


def test_a_recording_that_is_being_completed_is_not_called_one_that_goes_on(
    tmp_path: Path, slow_recorder: Callable[[], None]
) -> None:
    recording = started(tmp_path)
    assert recording.start() == "recording already"
    assert recording.stop() == "recording stopped"
    assert "is still being completed: start again when it has ended" in recording.start()
    slow_recorder()

    def ended() -> None:
        assert not recording.is_running

    eventually(ended, 60.0)
    assert recording.start().startswith("recording into")
    recording.close()


@pytest.mark.slow
def test_a_recorder_may_take_as_long_as_its_disk(tmp_path: Path, slow_recorder: Callable[[], None]) -> None:
    """The page ends while it does; before, it was killed after 10 s."""
    recording = started(tmp_path)
    thread = Thread(target=recording.close)
    thread.start()
    thread.join(15.0)
    assert thread.is_alive() and recording.is_running
    slow_recorder()
    thread.join()
    assert (tmp_path / "done").read_text() == "complete" and not recording.is_running
