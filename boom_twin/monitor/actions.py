"""Actions of a viewer: marks, acknowledgements, and recordings started and stopped from the page."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from unicodedata import category

from ..bag.async_writer import PATIENCE
from ..system.child_process import end_process, python_command
from .data.feed import Feed
from .data.status import MAX_ALARMS

RECORDER_TIMEOUT = 2 * PATIENCE
"""Timeout (s) for the end of a recorder: longer than its wait for a slow disk, so that no messages are lost."""


class RecorderProcess:
    """Recorder in a child process, at most one at a time.

    ``boom_twin record`` with `options` into a new directory of `folder`.
    """

    def __init__(self, folder: Path, options: Sequence[str] = ()) -> None:
        self._folder, self._options = folder, options
        self._process: subprocess.Popen[bytes] | None = None
        self._is_stopped = False

    @property
    def is_running(self) -> bool:
        """Return True if a recorder is running."""
        return self._process is not None and self._process.poll() is None

    def start(self) -> str:
        """Start a recorder unless one is running; return a sentence for the viewer."""
        if self.is_running:
            ending = "the recording before this one is still being completed: start again when it has ended"
            return ending if self._is_stopped else "recording already"
        out = self._folder / datetime.now(UTC).strftime("session_%Y%m%d_%H%M%S")
        note = ("--note", "started from the monitor")
        command = python_command("boom_twin.cli.main", "record", "--out", str(out), *note, *self._options)
        self._process, self._is_stopped = subprocess.Popen(command, stdin=subprocess.DEVNULL), False
        return f"recording into {out}"

    def stop(self) -> str:
        """Signal the recorder to stop, without waiting; return a sentence for the viewer."""
        if not self.is_running or self._process is None:
            return "not recording"
        self._process.send_signal(signal.SIGINT)
        self._is_stopped = True
        return "recording stopped"

    def close(self) -> None:
        """Stop the recorder and wait until its files are complete."""
        if self.is_running and self._process is not None:
            end_process(self._process, RECORDER_TIMEOUT, signal.SIGINT)


NOTE_LENGTH = 500  # largest number of characters of a note
NO_TEXT = ("Cc", "Cs")  # unicode categories that cannot be published: control characters and surrogates
ACTS = ("mark", "acknowledge", "record")
AT_NODE = "acknowledge-at-node"  # permission to release ended alarms at the node, too, by ``acknowledge``


class ViewerActions:
    """Actions of viewers: those of `ACTS` and `AT_NODE` that are permitted at start."""

    def __init__(self, feed: Feed, permitted: frozenset[str], recording: RecorderProcess | None = None) -> None:
        self._feed, self._recording = feed, recording
        self.permitted = permitted if recording is not None else permitted - {"record"}
        if AT_NODE in permitted:
            self.permitted |= {"acknowledge"}
        if feed.end is not None:
            self.permitted -= {"mark", "record", AT_NODE}
        self._acts: dict[str, Callable[[dict[str, Any]], str]] = {
            "mark": self._mark,
            "acknowledge": self._acknowledge,
            "record": self._record,
        }

    @property
    def is_recording(self) -> bool:
        """Return True if a recording started by this monitor is running."""
        return self._recording is not None and self._recording.is_running

    def act(self, request: dict[str, Any]) -> dict[str, Any]:
        """Carry out a request and return the answer; raise ValueError if it is unknown."""
        name = request.get("do")
        if name not in self._acts:
            raise ValueError("unknown request")
        if name not in self.permitted:
            return {"kind": "answer", "do": name, "done": False, "words": "not permitted when the monitor was started"}
        return {"kind": "answer", "do": name, "done": True, "words": self._acts[name](request)}

    def _mark(self, request: dict[str, Any]) -> str:
        note = request.get("note")
        if not isinstance(note, str) or len(note) > NOTE_LENGTH or any(category(sign) in NO_TEXT for sign in note):
            raise ValueError(f"a note is a text of at most {NOTE_LENGTH} characters, none of them a control character")
        self._feed.publish(f"mark: {note}")
        return f"marked: {note}"

    def _acknowledge(self, request: dict[str, Any]) -> str:
        known = (self._feed.store.alarms.acknowledge(int(number)) for number in request["numbers"][:MAX_ALARMS])
        found = [alarm for alarm in known if alarm is not None]
        if not found:
            return "that alarm is not kept any more"
        for alarm in found if self._feed.end is None else []:
            self._feed.publish(f"acknowledged: {alarm.name}: {alarm.reason}")
        is_kept_by_node = any(alarm.causes and alarm.end is not None for alarm in found)
        asked = f"; {self._feed.release_alarms()}" if is_kept_by_node and AT_NODE in self.permitted else ""
        return f"acknowledged: {', '.join(alarm.name for alarm in found)}{asked}"

    def _record(self, request: dict[str, Any]) -> str:
        assert self._recording is not None
        return self._recording.start() if request.get("on") is True else self._recording.stop()
