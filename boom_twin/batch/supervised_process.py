"""Run a command as a separate process with limits of time and memory. The caller survives any end of it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from tempfile import TemporaryFile
from threading import Thread

LOOK_PERIOD = 0.1  # seconds between two measurements of the memory
STDERR_BYTES = 2000  # number of last bytes of a process's stderr that are reported


@dataclass(frozen=True, slots=True)
class Outcome:
    """Result of a supervised process."""

    output: bytes  # content of its stdout; whole only if there is no reason
    reason: str  # of the failure in one line; empty if it ended with code 0
    peak: int  # largest observed resident memory, bytes; pages that its processes share are counted in each


def run_supervised(command: Sequence[str], task: bytes, seconds: float, memory: int) -> Outcome:
    """Run `command` with the line `task` on stdin and return its result.

    Stdin stays open: its end shows the process that its caller has ended. The process leads a group of its own, and all of
    the group is ended with it. It may take so many `seconds`, and with all its children so much resident `memory`, bytes.
    """
    with TemporaryFile() as out, TemporaryFile() as told:
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=out, stderr=told, start_new_session=True)
        assert process.stdin is not None
        try:
            with suppress(BrokenPipeError):
                process.stdin.write(task)
                process.stdin.flush()
            reason, peak = _watch(process, seconds, memory)
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            code = process.wait()
            with suppress(BrokenPipeError):
                process.stdin.close()
        out.seek(0)
        if not reason and code:
            told.seek(max(0, told.seek(0, os.SEEK_END) - STDERR_BYTES))
            lines = told.read().decode(errors="replace").strip().splitlines()
            cause = f"signal {-code}" if code < 0 else f"itself with code {code}"
            reason = lines[-1] if lines and code > 0 else f"its process was ended by {cause}"
        return Outcome(out.read(), reason, peak)


def _watch(process: subprocess.Popen[bytes], seconds: float, memory: int) -> tuple[str, int]:
    """Wait for the end of a process. Return the limit that it passed (empty if none) and its largest observed memory, bytes."""
    end, peak = time.monotonic() + seconds, 0
    while True:
        with suppress(subprocess.TimeoutExpired):
            process.wait(LOOK_PERIOD)
            return "", peak
        peak = max(peak, _memory(process.pid))
        if peak > memory:
            return f"needs {peak / 1e6:.0f} MB of memory, more than {memory / 1e6:.0f} MB. Raise --memory.", peak
        if time.monotonic() > end:
            return f"takes longer than {seconds:g} s. Raise --timeout.", peak


def _memory(pid: int) -> int:
    """Return the resident memory of a process and all its children, bytes."""
    import psutil

    total = 0
    with suppress(psutil.Error):
        process = psutil.Process(pid)
        for each in (process, *process.children(recursive=True)):
            with suppress(psutil.Error):
                total += each.memory_info().rss
    return total


def end_with_caller() -> None:
    """End this process and its group when its caller ends. Call it after the line on stdin is read."""
    Thread(target=_wait_for_end, name="caller", daemon=True).start()


def _wait_for_end() -> None:
    sys.stdin.read()
    if os.getpgid(0) == os.getpid():
        os.killpg(0, signal.SIGKILL)
