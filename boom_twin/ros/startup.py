"""Start of a ROS process: signal handling, and a clear error where rclpy is missing."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from importlib.util import find_spec
from types import FrameType

from ..errors import UsageError
from ..system.processes import python_command

STOPS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Signals that end a process. A closed terminal sends SIGHUP; ``nohup`` ignores it."""

PREPARATION = "preparation"
"""Name of the thread that prepares a node's model."""


def stop_signals() -> tuple[signal.Signals, ...]:
    """Return the signals of `STOPS` that this process handles; SIGHUP is left out if it is ignored."""
    return tuple(each for each in STOPS if each is not signal.SIGHUP or signal.getsignal(each) is not signal.SIG_IGN)


def on_stop_signal(act: Callable[[], None]) -> None:
    """Call `act` at the first of `STOPS`, and ignore further ones."""

    def stop(number: int, frame: FrameType | None) -> None:
        for each in STOPS:
            signal.signal(each, signal.SIG_IGN)
        act()

    for each in stop_signals():
        signal.signal(each, stop)


def end_with_preparation(code: int) -> int:
    """Return the exit code; if the thread `PREPARATION` still works, end the process with it here.

    Python does not wait for this daemon thread. The compiler in it would crash while its library is unloaded.
    """
    if any(each.name == PREPARATION for each in threading.enumerate()):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    return code


def require_rclpy() -> None:
    """Raise UsageError with the remedy if rclpy or the requested middleware is not installed.

    Importing rclpy without its middleware ends the process. So a child process tries it.
    """
    if find_spec("rclpy") is None:
        raise UsageError(
            'rclpy is not installed, and this needs ROS 2. Run `pip install "boom_twin[ros]"`, '
            "or source the setup file of a ROS 2 Jazzy installation."
        )
    if name := os.environ.get("RMW_IMPLEMENTATION"):
        command = python_command("rclpy.impl.implementation_singleton")
        if subprocess.run(command, capture_output=True, check=False).returncode:
            told = "rclpy cannot load this middleware. Install its package, or unset the variable."
            raise UsageError(f"RMW_IMPLEMENTATION={name}: {told}")
