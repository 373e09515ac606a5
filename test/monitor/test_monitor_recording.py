"""A recorder that is started and stopped from the page."""

from __future__ import annotations

import sys
from pathlib import Path
from threading import Thread

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


def test_a_recording_that_is_being_completed_is_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ready, done = tmp_path / "ready", tmp_path / "done"
    monkeypatch.setattr(actions, "python_command", lambda *_: (sys.executable, "-c", SLOW_DISK, str(ready), str(done)))

    def is_ready() -> None:
        assert ready.exists()

    recording = RecorderProcess(tmp_path / "bags")
    assert recording.start().startswith("recording into")
    eventually(is_ready, 60.0)
    assert recording.start() == "recording already"
    assert recording.stop() == "recording stopped"
    assert "is still being completed: start again when it has ended" in recording.start()
    page_ends = Thread(target=recording.close)
    page_ends.start()
    page_ends.join(1.0)
    assert page_ends.is_alive() and recording.is_running
    done.touch()
    page_ends.join()
    assert done.read_text() == "complete" and not recording.is_running
