"""A recorder that is started and stopped from the page."""

from __future__ import annotations

import signal
from pathlib import Path
from threading import Thread

import pytest

from boom_twin.monitor.actions import RecorderProcess


def test_a_recording_that_is_being_completed_is_not_called_one_that_goes_on(tmp_path: Path) -> None:
    recording = RecorderProcess(tmp_path / "bags")
    recording.start()
    assert recording._process is not None
    recording._process.send_signal(signal.SIGSTOP)  # it takes its time to end
    assert recording.start() == "recording already"
    assert recording.stop() == "recording stopped"
    assert "is still being completed: start again when it has ended" in recording.start()
    recording._process.send_signal(signal.SIGCONT)
    recording._process.wait(240.0)
    assert recording.start().startswith("recording into")
    recording.close()


@pytest.mark.slow
def test_a_recorder_may_take_as_long_as_its_disk(tmp_path: Path) -> None:
    """The page ends while it does; before, it was killed after 10 s."""
    recording = RecorderProcess(tmp_path / "bags")
    recording.start()
    process = recording._process
    assert process is not None
    process.send_signal(signal.SIGSTOP)
    thread = Thread(target=recording.close)
    thread.start()
    thread.join(15.0)
    assert thread.is_alive() and process.poll() is None
    process.send_signal(signal.SIGCONT)
    thread.join()
    assert process.returncode != -signal.SIGKILL
