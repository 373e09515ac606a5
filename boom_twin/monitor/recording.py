"""A recording started and stopped from the page: ``boom_twin record`` as a process of its own."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from ..child_process import python_command

PARTING = 10.0
"""Seconds that it may take to complete its files."""


class Recording:
    """Runs one recorder at a time.

    Parameters
    ----------
    folder : Path
        Every recording gets a directory in it, named by its time (UTC).
    options : sequence of str
        Further arguments of ``boom_twin record``.
    """

    def __init__(self, folder: Path, options: Sequence[str] = ()) -> None:
        self._folder, self._options = folder, options
        self._process: subprocess.Popen[bytes] | None = None
        self._is_stopped = False

    @property
    def is_running(self) -> bool:
        """Whether a recorder runs."""
        return self._process is not None and self._process.poll() is None

    def start(self) -> str:
        """Start one, unless it runs already; gives what was done."""
        if self.is_running:
            ending = "the recording before this one is still being completed: start again when it has ended"
            return ending if self._is_stopped else "recording already"
        out = self._folder / datetime.now(UTC).strftime("session_%Y%m%d_%H%M%S")
        note = ("--note", "started from the monitor")
        command = python_command("boom_twin.cli.main", "record", "--out", str(out), *note, *self._options)
        self._process, self._is_stopped = subprocess.Popen(command, stdin=subprocess.DEVNULL), False
        return f"recording into {out}"

    def stop(self) -> str:
        """Stop it, without waiting for its end; gives what was done."""
        if not self.is_running or self._process is None:
            return "not recording"
        self._process.send_signal(signal.SIGINT)
        self._is_stopped = True
        return "recording stopped"

    def close(self) -> None:
        """Stop it and wait until its files are complete."""
        if self._process is not None:
            self.stop()
            try:
                self._process.wait(PARTING)
            except subprocess.TimeoutExpired:
                self._process.kill()
